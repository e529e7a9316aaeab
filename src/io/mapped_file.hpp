// A large file mapped into memory; the system reads a part of it when it is first accessed.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string_view>

namespace flappy::io {

class MappedFile {
 public:
  /// Throws InputError where it cannot be read.
  explicit MappedFile(const std::filesystem::path& path);
  ~MappedFile();
  MappedFile(const MappedFile&) = delete;
  MappedFile& operator=(const MappedFile&) = delete;

  std::string_view bytes() const { return {data_, size_}; }

 private:
  const char* data_ = nullptr;
  std::size_t size_ = 0;
};

}  // namespace flappy::io
