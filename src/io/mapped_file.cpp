#include "io/mapped_file.hpp"

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <system_error>

#include "io/files.hpp"
#include "io/read_files.hpp"

namespace flappy::io {

MappedFile::MappedFile(const std::filesystem::path& path) {
  const auto refuse = [&](int error) {
    throw InputError(path.string() + ": cannot be read: " + std::generic_category().message(error));
  };
  const int descriptor = open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (descriptor < 0) refuse(errno);
  struct stat status = {};
  int error = fstat(descriptor, &status) == 0 ? 0 : errno;
  if (error == 0 && S_ISDIR(status.st_mode)) error = EISDIR;
  size_ = error == 0 ? static_cast<std::size_t>(status.st_size) : 0;
  if (size_ > 0) {
    void* const address = mmap(nullptr, size_, PROT_READ, MAP_PRIVATE, descriptor, 0);
    if (address == MAP_FAILED) error = errno;
    else data_ = static_cast<const char*>(address);
  }
  close(descriptor);
  if (error != 0) refuse(error);
  note_read(path);
}

MappedFile::~MappedFile() {
  if (data_) munmap(const_cast<char*>(data_), size_);
}

}  // namespace flappy::io
