// Errors of the user, and reading and writing of the files that the user names.
#pragma once

#include <cstdio>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

namespace flappy::io {

/// An error of the user. what() is the line to print on stderr before exiting with 2, with control characters as \xNN.
class InputError : public std::runtime_error {
 public:
  explicit InputError(std::string_view line);
};

/// The name of which `wrong` is probably a misspelling; empty where there is none.
std::string nearest_name(std::string_view wrong, const std::vector<std::string>& names);

/// The name that differs from `wrong` in its unit only, such as mass_kg for mass_g; empty where there is no such name.
std::string in_another_unit(std::string_view wrong, const std::vector<std::string>& names);

/// `; did you mean "x"?` with the nearest name; empty where there is none.
std::string did_you_mean(std::string_view wrong, const std::vector<std::string>& names);

std::string joined(const std::vector<std::string>& words, std::string_view between = ", ");

/// A number with the shortest digits that read back as the same double.
std::string shortest_digits(double value);

/// The bytes of a file. Throws InputError where it cannot be read.
std::string read_text(const std::filesystem::path& path);

/// A file that appears under its name only when it is complete: written to a temporary file in its folder, then
/// renamed. Throws InputError where it cannot be written, or where something other than a regular file has its name.
class AtomicFile {
 public:
  explicit AtomicFile(std::filesystem::path path);
  /// Removes the temporary file unless commit() was called.
  ~AtomicFile();
  AtomicFile(const AtomicFile&) = delete;
  AtomicFile& operator=(const AtomicFile&) = delete;

  void write(std::string_view text);
  /// Flushes to the disk and renames; call it once, last. The name survives a power failure only after sync_folder().
  void commit();

 private:
  [[noreturn]] void refuse(int error) const;

  std::filesystem::path path_;
  std::filesystem::path temporary_;
  std::FILE* file_ = nullptr;
};

/// The last name of a path: "escape" of "runs/escape" and of "runs/escape/".
std::string folder_name(const std::filesystem::path& folder);

/// Makes a folder and its parents where they are missing. Throws InputError where the folder cannot be written to.
void make_folder(const std::filesystem::path& folder);

/// Flushes a folder to the disk, so that the names of its files survive a power failure.
void sync_folder(const std::filesystem::path& folder);

/// Call it before long work: throws InputError where `path` cannot be written or was read (read_files.hpp). To read it
/// from now on is refused.
void check_output(const std::filesystem::path& path);

void write_atomically(const std::filesystem::path& path, std::string_view text);

}  // namespace flappy::io
