// Typed reading of TOML. Every fault is an InputError that gives the place, the fault and the accepted values:
//
//   v.toml:3:11: torso.mass_kg: -0.01 is out of range; accepted: a number above 0, at most 1
//
// Keys are dotted paths relative to a table. A reader may first call accept() with the keys that it knows; it reads
// every key, then calls finish(), which refuses the keys that were not read.
#pragma once

#include <cstdint>
#include <filesystem>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "io/files.hpp"

namespace flappy::io {

namespace detail {
struct Document;
struct Section;
}  // namespace detail

/// The finite numbers from low to high; `above_low` excludes low.
struct Range {
  double low = -std::numeric_limits<double>::infinity();
  double high = std::numeric_limits<double>::infinity();
  bool above_low = false;
};

constexpr Range positive(double high = std::numeric_limits<double>::infinity()) { return {0, high, true}; }
constexpr Range non_negative(double high = std::numeric_limits<double>::infinity()) { return {0, high, false}; }

/// A handle on one table; copies share it, and it keeps the configuration alive. Its readers refuse a key that is
/// missing, of another type or not accepted. The `_or` readers return the fallback for a missing key and write it into
/// Config::resolved(); a fallback that is not accepted means "not set" and is not written.
class Table {
 public:
  double number(std::string_view key, Range range = {}) const;
  double number_or(std::string_view key, double fallback, Range range = {}) const;
  std::int64_t integer(std::string_view key, std::int64_t low, std::int64_t high) const;
  /// Requires the key "schema" with the value `read`.
  void schema(std::int64_t read) const;
  std::int64_t integer_or(std::string_view key, std::int64_t fallback, std::int64_t low, std::int64_t high) const;
  bool boolean(std::string_view key) const;
  bool boolean_or(std::string_view key, bool fallback) const;
  std::string string(std::string_view key) const;
  std::string string_or(std::string_view key, std::string_view fallback) const;
  std::string choice(std::string_view key, const std::vector<std::string>& accepted) const;
  std::string choice_or(std::string_view key, std::string_view fallback,
                        const std::vector<std::string>& accepted) const;
  std::vector<double> numbers(std::string_view key, Range each = {}) const;
  std::vector<double> numbers(std::string_view key, std::size_t length, Range each = {}) const;
  /// Reads any number of arrays of exactly `width` numbers.
  std::vector<std::vector<double>> rows(std::string_view key, std::size_t width, Range each = {}) const;
  std::vector<std::string> strings(std::string_view key) const;
  /// A file name; a relative name is relative to the folder of the configuration file. The file need not exist.
  std::filesystem::path file(std::string_view key) const;

  Table table(std::string_view key) const;
  std::optional<Table> optional_table(std::string_view key) const;
  /// Empty where the array of tables is missing.
  std::vector<Table> tables(std::string_view key) const;

  /// Refuses other keys of this table, so that a misspelt key is reported before a missing one. Then read only `names`.
  void accept(const std::vector<std::string>& names) const;
  bool has(std::string_view key) const;  ///< counts as reading the key
  bool is_table(std::string_view key) const;
  bool is_array(std::string_view key) const;
  std::vector<std::string> keys() const;  ///< sorted
  std::string path() const;               ///< full dotted path; empty for the root
  /// Throws an InputError of the caller's choice about a key, or about this table where `key` is empty.
  [[noreturn]] void fail(std::string_view key, std::string_view what, std::string_view accepted) const;
  /// Logs a warning with the place of the key, which is accepted all the same.
  void warn(std::string_view key, std::string_view what) const;
  /// Refuses every key, in this table and in tables below, that was not read.
  void finish() const;

 private:
  friend class Config;
  explicit Table(std::shared_ptr<detail::Section> section);
  Table below(detail::Section& section) const;

  std::shared_ptr<detail::Section> section_;
};

class Config {
 public:
  /// Reads a file. Overrides are "a.b.c=value", as given to --set: the value is TOML, else a bare word, taken as a
  /// string. They replace values and create tables; an element of an array cannot be overridden.
  static Config load(const std::filesystem::path& path, const std::vector<std::string>& overrides = {});
  /// Reads text. `name` is the file name for messages; relative file names start at its folder.
  static Config parse(std::string_view text, const std::string& name, const std::vector<std::string>& overrides = {});

  Table root() const;
  /// TOML with overrides and defaults, which reads identically under the same name. File names stay as written.
  std::string resolved() const;
  /// resolved() without one table of the root, for a table that has no influence on results.
  std::string resolved_without(std::string_view table) const;

 private:
  explicit Config(std::shared_ptr<detail::Document> document);

  std::shared_ptr<detail::Document> document_;
};

}  // namespace flappy::io
