// Files that grow record by record, and locks that give one process a folder for itself.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string_view>

namespace flappy::io {

/// A write() appears in the file completely or not at all. Throws InputError where the file cannot be written.
class AppendFile {
 public:
  /// Keeps the first `keep` bytes of the file, cuts off the rest, and appends from there.
  explicit AppendFile(std::filesystem::path path, std::uint64_t keep = 0);
  ~AppendFile();
  AppendFile(const AppendFile&) = delete;
  AppendFile& operator=(const AppendFile&) = delete;

  /// Hands the text to the operating system; sync() brings it onto the disk.
  void write(std::string_view text);
  void sync();

 private:
  [[noreturn]] void refuse(int error) const;

  std::filesystem::path path_;
  int descriptor_;
  std::uint64_t size_;
};

/// Whether it is named as the temporary file of an AtomicFile.
bool is_temporary(const std::filesystem::path& path);

/// Locks a folder, which is the command's own then (read_files.hpp), until the object or the process ends, and removes
/// temporary files of a killed process (AtomicFile).
/// Throws InputError where another process has locked the folder. Has no effect on file systems without locks.
class FolderLock {
 public:
  explicit FolderLock(const std::filesystem::path& folder);
  ~FolderLock();
  FolderLock(const FolderLock&) = delete;
  FolderLock& operator=(const FolderLock&) = delete;

 private:
  int descriptor_;
};

}  // namespace flappy::io
