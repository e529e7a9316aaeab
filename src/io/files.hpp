// Faults of the user, and the files that the user names.
#pragma once

#include <cstdio>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

namespace flappy::io {

/// A mistake of the user. what() is the whole line to print on stderr before exiting with 2;
/// control characters in it are shown as \xNN.
class InputError : public std::runtime_error {
 public:
  explicit InputError(std::string_view line);
};

/// The name that `wrong` is a likely misspelling of; empty when there is none.
std::string nearest_name(std::string_view wrong, const std::vector<std::string>& names);

/// The name that differs from `wrong` in nothing but its unit, as mass_kg does from mass_g; empty when there
/// is none.
std::string in_another_unit(std::string_view wrong, const std::vector<std::string>& names);

/// `; did you mean "x"?` with the nearest name, or nothing.
std::string did_you_mean(std::string_view wrong, const std::vector<std::string>& names);

/// "a, b, c".
std::string joined(const std::vector<std::string>& words, std::string_view between = ", ");

/// A number in the shortest digits that read back to the same double.
std::string shortest_digits(double value);

/// The bytes of a file. InputError when it cannot be read.
std::string read_text(const std::filesystem::path& path);

/// A file that appears under its name only when complete: written beside it, then renamed onto it.
/// InputError when it cannot be written, or when something other than a regular file is in its place.
class AtomicFile {
 public:
  explicit AtomicFile(std::filesystem::path path);
  /// Leaves nothing behind unless committed.
  ~AtomicFile();
  AtomicFile(const AtomicFile&) = delete;
  AtomicFile& operator=(const AtomicFile&) = delete;

  void write(std::string_view text);
  /// Flushes to the disk and renames; call it once, last. Should the power fail, the new name is there only after
  /// sync_folder().
  void commit();

 private:
  [[noreturn]] void refuse(int error) const;

  std::filesystem::path path_;
  std::filesystem::path temporary_;
  std::FILE* file_ = nullptr;
};

/// Makes a folder, and those above it, where it is not there yet. InputError where nothing can be written in it.
void make_folder(const std::filesystem::path& folder);

/// Brings the names of a folder's files onto the disk.
void sync_folder(const std::filesystem::path& folder);

/// Refuses before the work what could not be written after it: InputError where `path` cannot be written, or is one of
/// `inputs` under whatever name.
void check_output(const std::filesystem::path& path, const std::vector<std::filesystem::path>& inputs = {});

/// Writes a whole file through AtomicFile.
void write_atomically(const std::filesystem::path& path, std::string_view text);

}  // namespace flappy::io
