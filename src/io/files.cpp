#include "io/files.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cctype>
#include <cerrno>
#include <charconv>
#include <map>
#include <memory>
#include <system_error>
#include <utility>
#include <vector>

#include "io/installation.hpp"
#include "io/read_files.hpp"
#include "io/text.hpp"

namespace flappy::io {
namespace {

bool is_digit(char c) { return c >= '0' && c <= '9'; }

std::size_t substitution_cost(char a, char b) {
  const auto lower = [](char c) { return std::tolower(static_cast<unsigned char>(c)); };
  if (lower(a) == lower(b)) return 0;
  return is_digit(a) && is_digit(b) ? 3 : 1;  // digits cost more: r22 is not a misspelling of r33
}

/// The cost of insertions, deletions, substitutions and swaps of neighbours that turn one word into the other.
std::size_t edit_distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> before(b.size() + 1), last(b.size() + 1), row(b.size() + 1);
  for (std::size_t j = 0; j <= b.size(); ++j) last[j] = j;
  for (std::size_t i = 1; i <= a.size(); ++i) {
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      row[j] = std::min({last[j] + 1, row[j - 1] + 1, last[j - 1] + substitution_cost(a[i - 1], b[j - 1])});
      const bool swapped = i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1];
      if (swapped) row[j] = std::min(row[j], before[j - 2] + 1);
    }
    before.swap(last);
    last.swap(row);
  }
  return last[b.size()];
}

/// The key with its unit replaced by the SI unit of the same quantity: "mass_kg" for "mass_g".
std::string in_base_units(std::string_view key) {
  static const std::map<std::string_view, std::string_view> kBase = {
      {"m", "m"},    {"km", "m"},    {"cm", "m"},    {"mm", "m"},  {"um", "m"},   {"kg", "kg"},  {"g", "kg"},
      {"mg", "kg"},  {"s", "s"},     {"h", "s"},     {"ms", "s"},  {"us", "s"},   {"ns", "s"},   {"rad", "rad"},
      {"N", "N"},    {"mN", "N"},    {"uN", "N"},    {"Nm", "Nm"}, {"mNm", "Nm"}, {"uNm", "Nm"}, {"deg", "rad"},
      {"V", "V"},    {"mV", "V"},    {"A", "A"},     {"mA", "A"},  {"W", "W"},    {"mW", "W"},   {"mrad", "rad"},
      {"J", "J"},    {"mJ", "J"},    {"Hz", "Hz"},   {"hz", "Hz"}, {"kHz", "Hz"}, {"rpm", "Hz"}, {"Pa", "Pa"},
      {"kPa", "Pa"}, {"ohm", "ohm"}, {"mohm", "ohm"}};
  std::string unit;
  for (;;) {
    const std::size_t bar = key.rfind('_');
    if (bar == std::string_view::npos || bar == 0) break;
    const std::string_view last = key.substr(bar + 1);
    const std::size_t letters = last.find_last_not_of("0123456789") + 1;
    const auto base = kBase.find(last.substr(0, letters));
    if (base == kBase.end()) break;
    unit = "_" + std::string(base->second) + std::string(last.substr(letters)) + unit;
    key = key.substr(0, bar);
  }
  return std::string(key) + unit;
}

[[noreturn]] void refuse_file(const std::filesystem::path& path, std::string_view what, int error) {
  throw InputError(path.string() + ": " + std::string(what) + ": " + std::generic_category().message(error));
}

std::filesystem::path name_beside(const std::filesystem::path& path) {
  static std::atomic<unsigned> count = 0;
  auto name = path;
  name += ".tmp" + std::to_string(getpid()) + "-" + std::to_string(count++);
  return name;
}

}  // namespace

InputError::InputError(std::string_view line) : std::runtime_error(printable(line)) {}

std::string nearest_name(std::string_view wrong, const std::vector<std::string>& names) {
  std::string nearest;
  std::size_t least = wrong.size();
  for (const auto& name : names) {
    const std::size_t allowed = std::max(name.size(), wrong.size()) / 4;
    // Compare lengths first, which bounds the work whatever the user wrote.
    if (name.size() > wrong.size() + allowed || wrong.size() > name.size() + allowed) continue;
    const std::size_t distance = edit_distance(wrong, name);
    if (distance <= allowed && distance < least) {
      nearest = name;
      least = distance;
    }
  }
  return nearest;
}

std::string in_another_unit(std::string_view wrong, const std::vector<std::string>& names) {
  const std::string base = in_base_units(wrong);
  const auto found = std::ranges::find_if(names, [&](const auto& name) { return in_base_units(name) == base; });
  return found == names.end() ? "" : *found;
}

std::string did_you_mean(std::string_view wrong, const std::vector<std::string>& names) {
  const std::string name = nearest_name(wrong, names);
  return name.empty() ? "" : "; did you mean \"" + name + "\"?";
}

std::string joined(const std::vector<std::string>& words, std::string_view between) {
  std::string text;
  for (const std::string& word : words) text.append(text.empty() ? "" : between).append(word);
  return text;
}

std::string shortest_digits(double value) {
  std::array<char, 32> digits;
  return {digits.data(), std::to_chars(digits.begin(), digits.end(), value).ptr};
}

std::string read_text(const std::filesystem::path& path) {
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> file(std::fopen(shipped(path).c_str(), "rbe"), std::fclose);
  if (!file) refuse_file(path, "cannot be read", errno);
  note_read(shipped(path));
  std::string text;
  std::array<char, 1 << 16> buffer;
  while (const std::size_t count = std::fread(buffer.data(), 1, buffer.size(), file.get())) {
    text.append(buffer.data(), count);
  }
  if (std::ferror(file.get())) refuse_file(path, "cannot be read", errno);
  return text;
}

AtomicFile::AtomicFile(std::filesystem::path path) : path_(std::move(path)), temporary_(name_beside(path_)) {
  require_unread(path_);
  // Renaming onto a device such as /dev/null would destroy it.
  std::error_code ignored;
  const auto status = std::filesystem::status(path_, ignored);
  if (std::filesystem::is_directory(status)) refuse(EISDIR);
  if (std::filesystem::exists(status) && !std::filesystem::is_regular_file(status)) {
    throw InputError(path_.string() + ": cannot be written: Not a regular file");
  }
  file_ = std::fopen(temporary_.c_str(), "wbe");
  if (!file_) refuse(errno);
}

AtomicFile::~AtomicFile() {
  if (!file_) return;
  std::fclose(file_);
  unlink(temporary_.c_str());
}

void AtomicFile::write(std::string_view text) {
  if (std::fwrite(text.data(), 1, text.size(), file_) != text.size()) refuse(errno);
}

void AtomicFile::commit() {
  if (std::fflush(file_) != 0 || fsync(fileno(file_)) != 0) refuse(errno);
  if (std::rename(temporary_.c_str(), path_.c_str()) != 0) refuse(errno);
  std::fclose(std::exchange(file_, nullptr));
  note_written(path_);
}

void AtomicFile::refuse(int error) const { refuse_file(path_, "cannot be written", error); }

std::string folder_name(const std::filesystem::path& folder) {
  return (folder.has_filename() ? folder : folder.parent_path()).filename().string();
}

void make_folder(const std::filesystem::path& folder) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (!error && access(folder.c_str(), W_OK) != 0) error = std::error_code(errno, std::generic_category());
  if (error) throw InputError(folder.string() + ": cannot be written: " + error.message());
}

void sync_folder(const std::filesystem::path& folder) {
  const int descriptor = open(folder.empty() ? "." : folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (descriptor < 0) refuse_file(folder, "cannot be read", errno);
  fsync(descriptor);  // some file systems refuse this for a folder; nothing more can be done there
  close(descriptor);
}

void check_output(const std::filesystem::path& path) {
  announce_output(path);
  const AtomicFile opened(path);
}

void write_atomically(const std::filesystem::path& path, std::string_view text) {
  AtomicFile file(path);
  file.write(text);
  file.commit();
}

}  // namespace flappy::io
