// A file that grows record by record, and one process at a time in a folder.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string_view>

namespace flappy::io {

/// Every write() is whole or not there. InputError, naming the file, when it cannot be written.
class AppendFile {
 public:
  /// Goes on after the first `keep` bytes; what was behind them is cut off.
  explicit AppendFile(std::filesystem::path path, std::uint64_t keep = 0);
  ~AppendFile();
  AppendFile(const AppendFile&) = delete;
  AppendFile& operator=(const AppendFile&) = delete;

  /// Handed to the system when it returns.
  void write(std::string_view text);
  /// Onto the disk.
  void sync();

 private:
  [[noreturn]] void refuse(int error) const;

  std::filesystem::path path_;
  int descriptor_;
  std::uint64_t size_;
};

/// Takes a folder for this process alone, until the object or the process ends, and removes what a killed process left
/// half written in it (AtomicFile). InputError when another process has the folder.
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
