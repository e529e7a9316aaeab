#include "io/append_file.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <cerrno>
#include <regex>
#include <system_error>
#include <utility>

#include "io/files.hpp"
#include "io/read_files.hpp"

namespace flappy::io {

namespace {

/// The path, unless the file is to be emptied although it is read.
std::filesystem::path replaceable(std::filesystem::path path, std::uint64_t keep) {
  if (keep == 0) require_unread(path);
  return path;
}

}  // namespace

AppendFile::AppendFile(std::filesystem::path path, std::uint64_t keep)
    : path_(replaceable(std::move(path), keep)),
      descriptor_(open(path_.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC | (keep == 0 ? O_TRUNC : 0), 0666)),
      size_(keep) {
  if (descriptor_ < 0) refuse(errno);
  if (keep == 0 || ftruncate(descriptor_, static_cast<off_t>(keep)) == 0) {
    note_written(path_);
    return;
  }
  const int error = errno;
  close(descriptor_);
  refuse(error);
}

AppendFile::~AppendFile() { close(descriptor_); }

void AppendFile::write(std::string_view text) {
  std::size_t written = 0;
  while (written < text.size()) {
    const ssize_t count = ::write(descriptor_, text.data() + written, text.size() - written);
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) {
      const int error = errno;
      [[maybe_unused]] const int half_record_stays = ftruncate(descriptor_, static_cast<off_t>(size_));
      refuse(error);
    }
    written += static_cast<std::size_t>(count);
  }
  size_ += text.size();
}

void AppendFile::sync() {
  // pipes and devices cannot be synchronised
  if (fsync(descriptor_) != 0 && errno != EINVAL && errno != EROFS) refuse(errno);
}

void AppendFile::refuse(int error) const {
  throw InputError(path_.string() + ": cannot be written: " + std::generic_category().message(error));
}

bool is_temporary(const std::filesystem::path& path) {
  static const std::regex temporary(R"(.+\.tmp\d+-\d+)");
  return std::regex_match(path.filename().string(), temporary);
}

FolderLock::FolderLock(const std::filesystem::path& folder)
    : descriptor_(open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC)) {
  const auto refuse = [&](const std::string& what) {
    if (descriptor_ >= 0) close(descriptor_);
    throw InputError(folder.string() + ": " + what);
  };
  if (descriptor_ < 0) refuse("cannot be read: " + std::generic_category().message(errno));
  if (flock(descriptor_, LOCK_EX | LOCK_NB) != 0) {
    // other errors mean a file system without locks: go on without one
    if (errno == EWOULDBLOCK) refuse("another process is at work here; accepted: wait for it, or another folder");
  }
  note_own_folder(folder);
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator(folder, error))
    if (entry.is_regular_file(error) && is_temporary(entry.path())) unlink(entry.path().c_str());
}

FolderLock::~FolderLock() { close(descriptor_); }

}  // namespace flappy::io
