#include "flightlog/ros/layout.hpp"

#include <algorithm>
#include <charconv>
#include <optional>
#include <set>

namespace flappy::flightlog::ros {
namespace {

constexpr std::size_t kDeepest = 32;

const std::map<std::string_view, Kind> kBasic = {
    {"bool", Kind::boolean},    {"byte", Kind::byte},     {"char", Kind::uint8},    {"int8", Kind::int8},
    {"uint8", Kind::uint8},     {"int16", Kind::int16},   {"uint16", Kind::uint16}, {"int32", Kind::int32},
    {"uint32", Kind::uint32},   {"int64", Kind::int64},   {"uint64", Kind::uint64}, {"float32", Kind::float32},
    {"float64", Kind::float64}, {"string", Kind::string},
};

bool blank(char c) { return c == ' ' || c == '\t' || c == '\r'; }

std::string_view trimmed(std::string_view text) {
  while (!text.empty() && blank(text.front())) text.remove_prefix(1);
  while (!text.empty() && blank(text.back())) text.remove_suffix(1);
  return text;
}

std::string_view take_line(std::string_view& rest) {
  const std::size_t end = rest.find('\n');
  const std::string_view line = rest.substr(0, end);
  rest.remove_prefix(end == std::string_view::npos ? rest.size() : end + 1);
  return trimmed(line);
}

std::string_view take_word(std::string_view& rest) {
  const auto end = static_cast<std::size_t>(std::ranges::find_if(rest, blank) - rest.begin());
  const std::string_view word = rest.substr(0, end);
  rest = trimmed(rest.substr(end));
  return word;
}

std::size_t to_size(std::string_view text, std::string_view line) {
  std::size_t value = 0;
  const auto [stop, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || stop != text.data() + text.size() || value == 0)
    throw MessageError("\"" + std::string(line) + "\" has no size where one is needed");
  return value;
}

/// A member from its line; a message type is not resolved yet.
struct Member {
  LayoutField field;
  std::string type;  ///< name of a message type; else empty
};

std::string resolved(std::string_view type, std::string_view package) {
  if (type == "Header") return "std_msgs/msg/Header";
  if (type.find('/') == std::string_view::npos) return std::string(package) + "/msg/" + std::string(type);
  return full_type_name(type);
}

bool is_name(std::string_view word) {
  return !word.empty() && std::ranges::all_of(word, [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' || c == '/';
  });
}

/// Parses a line; nothing for an empty line, a comment or a constant.
std::optional<Member> parse_member(std::string_view line, std::string_view package) {
  if (line.empty() || line.front() == '#') return {};
  std::string_view rest = line;
  std::string_view type = take_word(rest);
  // "type NAME=value" and "type NAME = value" are constants, "type name value" has a default
  const std::size_t name_end = std::min(rest.find_first_of(" \t=#"), rest.size());
  const std::string_view name = rest.substr(0, name_end);
  if (trimmed(rest.substr(name_end)).starts_with('=')) return {};
  Member member;
  LayoutField& field = member.field;
  field.name = name;
  if (type.ends_with(']')) {
    const std::size_t open = type.rfind('[');
    if (open == std::string_view::npos) throw MessageError("\"" + std::string(line) + "\" has a stray ]");
    std::string_view size = type.substr(open + 1, type.size() - open - 2);
    type = type.substr(0, open);
    field.many = size.empty() ? Many::unbounded : size.starts_with("<=") ? Many::bounded : Many::array;
    if (field.many == Many::bounded) size.remove_prefix(2);
    if (!size.empty()) field.capacity = to_size(size, line);
  }
  if (const std::size_t bound = type.find("<="); bound != std::string_view::npos) {
    if (type.substr(0, bound) != "string") throw MessageError("\"" + std::string(line) + "\" bounds what is no string");
    field.string_capacity = to_size(type.substr(bound + 2), line);
    type = type.substr(0, bound);
  }
  if (!is_name(type) || !is_name(name)) throw MessageError("\"" + std::string(line.substr(0, 80)) + "\" is no member");
  if (type == "wstring") throw MessageError(field.name + " is a wstring, which is not read");
  if (const auto basic = kBasic.find(type); basic != kBasic.end()) field.kind = basic->second;
  else member.type = resolved(type, package);
  return member;
}

std::vector<Member> parse(std::string_view text, std::string_view type) {
  const std::string_view package = type.substr(0, type.find('/'));
  std::vector<Member> members;
  while (!text.empty())
    if (auto member = parse_member(take_line(text), package)) members.push_back(std::move(*member));
  return members;
}

bool is_separator(std::string_view line) {
  return line.size() >= 10 && line.find_first_not_of('=') == std::string_view::npos;
}

}  // namespace

std::string full_type_name(std::string_view name) {
  const std::size_t first = name.find('/');
  if (first == std::string_view::npos || name.find('/', first + 1) != std::string_view::npos) return std::string(name);
  return std::string(name.substr(0, first)) + "/msg/" + std::string(name.substr(first + 1));
}

void Definitions::add(std::string_view type, std::string_view text) {
  std::string name = full_type_name(type), part;
  const auto keep = [&] { texts_.try_emplace(name, part); };
  bool named = true;
  while (!text.empty()) {
    const std::string_view line = take_line(text);
    if (is_separator(line)) {
      if (named) keep();
      part.clear();
      named = false;
    } else if (!named && line.starts_with("MSG:")) {
      name = full_type_name(trimmed(line.substr(4)));
      named = true;
    } else {
      part += std::string(line) + "\n";
    }
  }
  if (named) keep();
}

std::shared_ptr<const Layout> Definitions::layout(std::string_view type) const {
  std::map<std::string, std::shared_ptr<const Layout>> done;
  const auto make = [&](const auto& self, const std::string& name, std::size_t depth) -> std::shared_ptr<const Layout> {
    if (depth > kDeepest) throw MessageError(name + " contains itself");
    if (const auto found = done.find(name); found != done.end()) return found->second;
    const auto text = texts_.find(name);
    if (text == texts_.end()) throw MessageError(name + " has no definition");
    auto made = std::make_shared<Layout>();
    made->name = name;
    for (Member& member : parse(text->second, name)) {
      if (!member.type.empty()) member.field.message = self(self, member.type, depth + 1);
      made->fields.push_back(std::move(member.field));
    }
    return done[name] = made;
  };
  return make(make, full_type_name(type), 0);
}

std::string Definitions::concatenated(std::string_view type) const {
  const std::string name = full_type_name(type);
  std::set<std::string> seen = {name};
  std::vector<std::string> order = {name};
  std::string all;
  for (std::size_t i = 0; i < order.size(); ++i) {
    const auto text = texts_.find(order[i]);
    if (text == texts_.end()) throw MessageError(order[i] + " has no definition");
    if (i > 0) {
      const std::size_t slash = order[i].find('/');
      all += std::string(80, '=') + "\nMSG: " + order[i].substr(0, slash) + order[i].substr(order[i].rfind('/')) + "\n";
    }
    all += text->second;
    for (const Member& member : parse(text->second, order[i]))
      if (!member.type.empty() && seen.insert(member.type).second) order.push_back(member.type);
  }
  return all;
}

std::vector<std::string> Definitions::names() const {
  std::vector<std::string> list;
  for (const auto& [name, text] : texts_) list.push_back(name);
  return list;
}

}  // namespace flappy::flightlog::ros
