#include "io/config.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <stdexcept>
#include <utility>

#include "io/installation.hpp"
#include "io/schema.hpp"
#include "io/toml.hpp"
#include "io/toml_writer.hpp"

namespace flappy::io {
namespace detail {

struct Section {
  Document* document;
  toml::table* table;
  std::string path;
  std::set<std::string, std::less<>> asked, accepted{};
};

struct Document {
  std::string name;
  toml::table root;
  std::map<const toml::table*, Section> sections;

  Section& section(toml::table& table, const std::string& path) {
    return sections.try_emplace(&table, Section{this, &table, path, {}}).first->second;
  }
};

}  // namespace detail

namespace {

using detail::Document;
using detail::Section;

constexpr std::size_t kMaxBytes = 1 << 20;  // toml++ takes quadratic time for some files
constexpr std::size_t kMaxDepth = 32;       // toml++ destroys tables that dotted keys nest recursively

constexpr std::string_view kTooDeep = "tables and arrays nest too deeply";
constexpr std::string_view kDepthAccepted = "at most 32 levels";
constexpr std::string_view kBoolean = "true or false";
constexpr std::string_view kString = "a string";
constexpr std::string_view kFile = "the name of a file";
constexpr std::string_view kTable = "a table";

struct Entry {
  Section* section;
  std::string_view key;  ///< below the section; dotted when tables on the way are missing
  std::string path;
  toml::node* node;
};

std::string element_of(const std::string& path, std::size_t index) { return path + "[" + std::to_string(index) + "]"; }

/// `file:line:column`; for an override the override itself; for a default only the file.
std::string place(const toml::source_region& source, const std::string& file) {
  if (!source.path || !source.begin) return file;
  if (*source.path != file) return *source.path;
  return file + ":" + std::to_string(source.begin.line) + ":" + std::to_string(source.begin.column);
}

std::string place(const Section& section) {
  const std::string& file = section.document->name;
  return section.path.empty() ? file : place(section.table->source(), file);
}

std::string place(const Entry& entry) {
  const bool written = entry.node && entry.node->source().path;
  return written ? place(entry.node->source(), entry.section->document->name) : place(*entry.section);
}

std::string line_of(const std::string& where, const std::string& path, std::string_view what,
                    std::string_view accepted) {
  std::string line = where + ": " + (path.empty() ? "" : path + ": ") + std::string(what);
  if (!accepted.empty()) line += "; accepted: " + std::string(accepted);
  return line;
}

[[noreturn]] void refuse(const std::string& where, const std::string& path, std::string_view what,
                         std::string_view accepted) {
  throw InputError(line_of(where, path, what, accepted));
}

[[noreturn]] void refuse(const Entry& entry, std::string_view what, std::string_view accepted) {
  refuse(place(entry), entry.path, what, accepted);
}

std::string kind(const toml::node& node) {
  if (node.is_table()) return "a table";
  if (node.is_array()) return "an array";
  if (node.is_string()) return "a string";
  if (node.is_integer()) return "an integer";
  if (node.is_floating_point()) return "a floating-point number";
  if (node.is_boolean()) return "a boolean";
  return "a date or time";
}

[[noreturn]] void refuse_kind(const Entry& entry, std::string_view accepted) {
  refuse(entry, "is " + kind(*entry.node), accepted);
}

[[noreturn]] void refuse_unknown(const Section& section, const toml::key& key,
                                 const std::set<std::string, std::less<>>& known) {
  const std::string where = place(key.source(), section.document->name);
  const std::string path = toml_path(section.path, key.str());
  const std::vector<std::string> names(known.begin(), known.end());
  const std::string same = in_another_unit(key.str(), names);
  if (!same.empty()) refuse(where, path, "unknown key; accepted here with another unit: " + toml_string(same), "");
  refuse(where, path, "unknown key", (names.empty() ? "no key here" : joined(names)) + did_you_mean(key.str(), names));
}

[[noreturn]] void refuse_missing(const Entry& entry, std::string_view accepted) {
  const Section& section = *entry.section;
  const std::string_view name = entry.key.substr(0, entry.key.find('.'));
  std::vector<std::string> unasked;
  for (const auto& [key, node] : *section.table) {
    if (!section.asked.contains(key.str())) unasked.emplace_back(key.str());
  }
  const std::string same = in_another_unit(name, unasked);
  if (!same.empty()) refuse_unknown(section, section.table->find(same)->first, section.asked);
  const std::string typo = nearest_name(name, unasked);
  refuse(entry, "is missing",
         std::string(accepted) + (typo.empty() ? "" : "; is it misspelt as " + toml_string(typo) + "?"));
}

void refuse_unasked(Section& section) {
  for (auto& [key, node] : *section.table) {
    if (!section.asked.contains(key.str())) refuse_unknown(section, key, section.asked);
    const std::string path = toml_path(section.path, key.str());
    if (auto* table = node.as_table()) refuse_unasked(section.document->section(*table, path));
    auto* array = node.as_array();
    for (std::size_t i = 0; array && i < array->size(); ++i) {
      auto* table = (*array)[i].as_table();
      if (table) refuse_unasked(section.document->section(*table, element_of(path, i)));
    }
  }
}

Section& section_of(const Entry& entry) {
  auto* table = entry.node->as_table();
  if (!table) refuse_kind(entry, kTable);
  return entry.section->document->section(*table, entry.path);
}

/// Marks the key, and the tables on the way to it, as asked for.
Entry find(Section& top, std::string_view key) {
  for (Section* section = &top;;) {
    // A key that the user quoted may itself contain dots.
    const std::size_t dot = section->table->contains(key) ? std::string_view::npos : key.find('.');
    const std::string_view name = key.substr(0, dot);
    if (!section->accepted.empty() && !section->accepted.contains(name))
      throw std::logic_error(toml_path(section->path, name) + " is asked for, but not among the keys accepted");
    section->asked.emplace(name);
    Entry entry{section, key, toml_path(section->path, name), section->table->get(name)};
    if (dot == std::string_view::npos) return entry;
    if (!entry.node) {
      entry.path += key.substr(dot);
      return entry;
    }
    section = &section_of(entry);
    key.remove_prefix(dot + 1);
  }
}

Entry find_required(Section& top, std::string_view key, std::string_view accepted) {
  Entry entry = find(top, key);
  if (!entry.node) refuse_missing(entry, accepted);
  return entry;
}

/// Writes a default into the table, for Config::resolved().
template <class T>
void write_default(const Entry& entry, T value) {
  toml::table* table = entry.section->table;
  std::string_view key = entry.key;
  for (std::size_t dot = key.find('.'); dot != std::string_view::npos; dot = key.find('.')) {
    table = table->insert(key.substr(0, dot), toml::table{}).first->second.as_table();
    key.remove_prefix(dot + 1);
  }
  table->insert(key, std::move(value));
  find(*entry.section, entry.key);
}

template <class T>
const T& value_of(const Entry& entry, std::string_view accepted) {
  if (const auto* value = entry.node->as<T>()) return value->get();
  refuse_kind(entry, accepted);
}

template <class T>
T value_or(Section& section, std::string_view key, const T& fallback, std::string_view accepted) {
  const Entry entry = find(section, key);
  if (entry.node) return value_of<T>(entry, accepted);
  write_default(entry, fallback);
  return fallback;
}

bool contains(const Range& range, double value) {
  return std::isfinite(value) && (range.above_low ? value > range.low : value >= range.low) && value <= range.high;
}

/// "a number from 0 to 1", "a number above 0, at most 1", "an integer of at least 1", ...
std::string describe(const std::string& noun, const std::string& low, const std::string& high, bool above_low) {
  if (low.empty() && high.empty()) return noun;
  if (low.empty()) return noun + " of at most " + high;
  if (above_low) return noun + " above " + low + (high.empty() ? "" : ", at most " + high);
  return high.empty() ? noun + " of at least " + low : noun + " from " + low + " to " + high;
}

std::string describe(const Range& range) {
  const auto limit = [](double value) { return std::isfinite(value) ? shortest_digits(value) : ""; };
  return describe("a number", limit(range.low), limit(range.high), range.above_low);
}

std::string describe(std::int64_t low, std::int64_t high) {
  using Limits = std::numeric_limits<std::int64_t>;
  return describe("an integer", low == Limits::min() ? "" : std::to_string(low),
                  high == Limits::max() ? "" : std::to_string(high), false);
}

double to_number(const Entry& entry, const Range& range) {
  const std::string accepted = describe(range);
  const auto* integer = entry.node->as_integer();
  const double value = integer ? static_cast<double>(integer->get()) : value_of<double>(entry, accepted);
  if (!std::isfinite(value)) refuse(entry, shortest_digits(value) + " is not finite", accepted);
  if (!contains(range, value)) refuse(entry, shortest_digits(value) + " is out of range", accepted);
  return value;
}

std::int64_t to_integer(const Entry& entry, std::int64_t low, std::int64_t high) {
  const std::string accepted = describe(low, high);
  const std::int64_t value = value_of<std::int64_t>(entry, accepted);
  if (value < low || value > high) refuse(entry, std::to_string(value) + " is out of range", accepted);
  return value;
}

std::vector<Entry> elements(const Entry& entry, std::string_view accepted) {
  auto* array = entry.node->as_array();
  if (!array) refuse_kind(entry, accepted);
  std::vector<Entry> all;
  for (std::size_t i = 0; i < array->size(); ++i) {
    all.push_back({entry.section, "", element_of(entry.path, i), &(*array)[i]});
  }
  return all;
}

std::vector<Entry> elements(Section& section, std::string_view key, std::string_view accepted) {
  return elements(find_required(section, key, accepted), accepted);
}

std::string describe_row(std::size_t length, const Range& each) {
  return "an array of " + std::to_string(length) + ", each " + describe(each);
}

std::vector<double> to_row(const Entry& entry, std::size_t length, const Range& each) {
  const std::string accepted = describe_row(length, each);
  const std::vector<Entry> all = elements(entry, accepted);
  if (all.size() != length) refuse(entry, "has " + std::to_string(all.size()) + " elements", accepted);
  std::vector<double> values;
  for (const Entry& element : all) values.push_back(to_number(element, each));
  return values;
}

/// Index of the last character of the string that begins at `begin`, or of its line where the string is not closed.
std::size_t end_of_string(std::string_view text, std::size_t begin) {
  const char mark = text[begin];
  const std::string three(3, mark);
  const bool multiline = text.substr(begin, 3) == three;
  for (std::size_t i = begin + (multiline ? 3 : 1); i < text.size(); ++i) {
    if (text[i] == '\\' && mark == '"') {
      ++i;
    } else if (!multiline && (text[i] == mark || text[i] == '\n')) {
      return i;
    } else if (multiline && text.substr(i, 3) == three) {
      // Up to two more marks belong to the string.
      return std::min({text.find_first_not_of(mark, i), i + 5, text.size()}) - 1;
    }
  }
  return text.size();
}

/// Where brackets or dotted keys nest too deeply; checked first, because toml++ builds and destroys tables recursively.
std::optional<std::size_t> find_too_deep(std::string_view text) {
  std::size_t brackets = 0, dots = 0;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    const auto is_one_of = [c](std::string_view set) { return set.find(c) != std::string_view::npos; };
    if (c == '#') {
      i = std::min(text.find('\n', i), text.size()) - 1;
    } else if (is_one_of("\"'")) {
      i = end_of_string(text, i);
    } else if (c == '.') {
      ++dots;
    } else if (is_one_of("[]{}=,\n")) {
      dots = 0;
      if (is_one_of("[{")) ++brackets;
      if (is_one_of("]}") && brackets > 0) --brackets;
    }
    if (brackets > kMaxDepth || dots > kMaxDepth) return i;
  }
  return std::nullopt;
}

std::size_t depth(const toml::node& node) {
  std::size_t deepest = 0;
  if (const auto* table = node.as_table()) {
    for (const auto& [key, below] : *table) deepest = std::max(deepest, depth(below));
  } else if (const auto* array = node.as_array()) {
    for (const auto& below : *array) deepest = std::max(deepest, depth(below));
  } else {
    return 0;
  }
  return deepest + 1;
}

/// `source` is the file or an override; toml++ keeps it with every value as its place.
toml::table parse_toml(std::string_view text, const std::string& source, const std::string& file) {
  if (const auto deep = find_too_deep(text)) {
    const std::string_view before = text.substr(0, *deep);
    const std::string line = std::to_string(1 + std::ranges::count(before, '\n'));
    const std::string column = std::to_string(before.size() - before.rfind('\n'));  // npos counts as -1
    refuse(source == file ? file + ":" + line + ":" + column : source, "", kTooDeep, kDepthAccepted);
  }
  try {
    return toml::parse(text, source);
  } catch (const toml::parse_error& error) {
    throw InputError(place(error.source(), file) + ": not valid TOML: " + std::string(error.description()));
  }
}

std::string_view trimmed(std::string_view text) {
  const std::size_t begin = std::min(text.find_first_not_of(" \t"), text.size());
  return text.substr(begin, text.find_last_not_of(" \t") + 1 - begin);
}

/// A table that contains only the override "a.b.c=value".
toml::table parse_override(std::string_view text, const std::string& file) {
  const std::string source = "--set " + std::string(text);
  const std::size_t equals = std::min(text.find('='), text.size());
  const std::string key(trimmed(text.substr(0, equals)));
  const std::string value(trimmed(text.substr(std::min(equals + 1, text.size()))));
  if (key.find('[') != std::string::npos) refuse(source, key, "is an element of an array", "the whole array");
  std::string letters = key;
  std::erase(letters, '.');
  if (!is_bare(letters) || value.empty() || value.find_first_of("\r\n") != std::string::npos) {
    refuse(source, "", "is not an override", "a.b.c=value");
  }
  const bool bare_word = value.find_first_of("\"'[{") != 0;
  try {
    return parse_toml(key + " = " + value, source, file);
  } catch (const InputError&) {
    if (!bare_word) throw;
  }
  return parse_toml(key + " = " + toml_string(value), source, file);
}

/// Moves the values of an override into the table, creating the tables on the way.
void merge(toml::table& into, toml::table& from, const std::string& source, const std::string& path) {
  for (auto& [key, node] : from) {
    auto* branch = node.as_table();
    auto* old = into.get(key.str());
    const std::string here = toml_path(path, key.str());
    if (!old || !branch || branch->is_inline()) {
      into.erase(key.str());  // otherwise the old key's place would stay
      into.insert(key, std::move(node));
    } else if (auto* below = old->as_table()) {
      merge(*below, *branch, source, here);
    } else {
      refuse(source, here, "is " + kind(*old), old->is_array() ? "the whole array" : "a table");
    }
  }
}

}  // namespace

Table::Table(std::shared_ptr<Section> section) : section_(std::move(section)) {}

Table Table::below(Section& section) const { return Table({section_, &section}); }

double Table::number(std::string_view key, Range range) const {
  return to_number(find_required(*section_, key, describe(range)), range);
}

double Table::number_or(std::string_view key, double fallback, Range range) const {
  const Entry entry = find(*section_, key);
  if (entry.node) return to_number(entry, range);
  if (contains(range, fallback)) write_default(entry, fallback);
  return fallback;
}

std::int64_t Table::integer(std::string_view key, std::int64_t low, std::int64_t high) const {
  return to_integer(find_required(*section_, key, describe(low, high)), low, high);
}

void Table::schema(std::int64_t read) const {
  const std::string accepted = std::to_string(read);
  const Entry entry = find_required(*section_, "schema", accepted);
  const std::int64_t given = value_of<std::int64_t>(entry, accepted);
  if (given != read) refuse(entry, other_schema(given, read), accepted);
}

std::int64_t Table::integer_or(std::string_view key, std::int64_t fallback, std::int64_t low, std::int64_t high) const {
  const Entry entry = find(*section_, key);
  if (entry.node) return to_integer(entry, low, high);
  if (fallback >= low && fallback <= high) write_default(entry, fallback);
  return fallback;
}

bool Table::boolean(std::string_view key) const {
  return value_of<bool>(find_required(*section_, key, kBoolean), kBoolean);
}

bool Table::boolean_or(std::string_view key, bool fallback) const {
  return value_or<bool>(*section_, key, fallback, kBoolean);
}

std::string Table::string(std::string_view key) const {
  return value_of<std::string>(find_required(*section_, key, kString), kString);
}

std::string Table::string_or(std::string_view key, std::string_view fallback) const {
  return value_or<std::string>(*section_, key, std::string(fallback), kString);
}

std::string Table::choice(std::string_view key, const std::vector<std::string>& accepted) const {
  std::string list;
  for (const auto& each : accepted) list += (list.empty() ? "" : ", ") + toml_string(each);
  const Entry entry = find_required(*section_, key, list);
  const auto& value = value_of<std::string>(entry, list);
  if (std::ranges::find(accepted, value) == accepted.end()) {
    refuse(entry, toml_string(value) + " is not known", list + did_you_mean(value, accepted));
  }
  return value;
}

std::string Table::choice_or(std::string_view key, std::string_view fallback,
                             const std::vector<std::string>& accepted) const {
  return has(key) ? choice(key, accepted) : string_or(key, fallback);
}

std::vector<double> Table::numbers(std::string_view key, Range each) const {
  std::vector<double> values;
  for (const Entry& entry : elements(*section_, key, "an array, each " + describe(each))) {
    values.push_back(to_number(entry, each));
  }
  return values;
}

std::vector<double> Table::numbers(std::string_view key, std::size_t length, Range each) const {
  return to_row(find_required(*section_, key, describe_row(length, each)), length, each);
}

std::vector<std::vector<double>> Table::rows(std::string_view key, std::size_t width, Range each) const {
  std::vector<std::vector<double>> all;
  for (const Entry& entry : elements(*section_, key, "an array, each " + describe_row(width, each))) {
    all.push_back(to_row(entry, width, each));
  }
  return all;
}

std::vector<std::string> Table::strings(std::string_view key) const {
  std::vector<std::string> values;
  for (const Entry& entry : elements(*section_, key, "an array of strings")) {
    values.push_back(value_of<std::string>(entry, kString));
  }
  return values;
}

std::filesystem::path Table::file(std::string_view key) const {
  const Entry entry = find_required(*section_, key, kFile);
  const auto& name = value_of<std::string>(entry, kFile);
  if (name.empty()) refuse(entry, "is empty", kFile);
  if (name.find('\0') != std::string::npos) refuse(entry, "holds a NUL character", kFile);
  return std::filesystem::path(section_->document->name).parent_path() / name;
}

Table Table::table(std::string_view key) const {
  find_required(*section_, key, kTable);
  return *optional_table(key);
}

std::optional<Table> Table::optional_table(std::string_view key) const {
  const Entry entry = find(*section_, key);
  if (!entry.node) return std::nullopt;
  return below(section_of(entry));
}

std::vector<Table> Table::tables(std::string_view key) const {
  std::vector<Table> all;
  if (!find(*section_, key).node) return all;
  for (const Entry& entry : elements(*section_, key, "an array of tables")) {
    all.push_back(below(section_of(entry)));
  }
  return all;
}

void Table::accept(const std::vector<std::string>& names) const {
  section_->accepted = {names.begin(), names.end()};
  for (const auto& [key, node] : *section_->table)
    if (!section_->accepted.contains(key.str())) refuse_unknown(*section_, key, section_->accepted);
}

bool Table::has(std::string_view key) const { return find(*section_, key).node != nullptr; }
bool Table::is_table(std::string_view key) const {
  const Entry entry = find(*section_, key);
  return entry.node != nullptr && entry.node->is_table();
}

bool Table::is_array(std::string_view key) const {
  const Entry entry = find(*section_, key);
  return entry.node != nullptr && entry.node->is_array();
}

std::vector<std::string> Table::keys() const {
  std::vector<std::string> names;
  for (const auto& [key, node] : *section_->table) names.emplace_back(key.str());
  return names;
}

std::string Table::path() const { return section_->path; }

void Table::fail(std::string_view key, std::string_view what, std::string_view accepted) const {
  if (key.empty()) refuse(place(*section_), section_->path, what, accepted);
  refuse(find(*section_, key), what, accepted);
}

void Table::finish() const { refuse_unasked(*section_); }

Config::Config(std::shared_ptr<Document> document) : document_(std::move(document)) {}

Config Config::load(const std::filesystem::path& path, const std::vector<std::string>& overrides) {
  const std::filesystem::path file = shipped(path);
  return parse(read_text(file), file.string(), overrides);
}

Config Config::parse(std::string_view text, const std::string& name, const std::vector<std::string>& overrides) {
  if (text.size() > kMaxBytes) {
    refuse(name, "", "is " + std::to_string(text.size()) + " bytes long", "at most " + std::to_string(kMaxBytes));
  }
  auto document = std::make_shared<Document>(Document{name, parse_toml(text, name, name), {}});
  for (const auto& each : overrides) {
    toml::table values = parse_override(each, name);
    merge(document->root, values, "--set " + each, "");
  }
  if (depth(document->root) > kMaxDepth) refuse(name, "", kTooDeep, kDepthAccepted);
  return Config(std::move(document));
}

Table Config::root() const { return Table({document_, &document_->section(document_->root, "")}); }

std::string Config::resolved() const { return toml_text(document_->root); }

std::string Config::resolved_without(std::string_view table) const {
  toml::table rest = document_->root;
  rest.erase(table);
  return toml_text(rest);
}

}  // namespace flappy::io
