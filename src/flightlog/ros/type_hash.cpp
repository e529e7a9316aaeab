#include "flightlog/ros/type_hash.hpp"

#include "io/sha256.hpp"

namespace flappy::flightlog::ros {
namespace {

constexpr int kBoundedString = 21;
/// Step between the type numbers of a kind, its array, its bounded and its unbounded sequence.
constexpr int kStep = 48;

int type_id(const LayoutField& field) {
  const int kind = field.string_capacity > 0 ? kBoundedString : static_cast<int>(field.kind);
  return kind + kStep * static_cast<int>(field.many);
}

std::string member(const std::string& name, int id, std::size_t capacity, std::size_t string_capacity,
                   const std::string& nested) {
  return "{\"name\": \"" + name + "\", \"type\": {\"type_id\": " + std::to_string(id) +
         ", \"capacity\": " + std::to_string(capacity) + ", \"string_capacity\": " + std::to_string(string_capacity) +
         ", \"nested_type_name\": \"" + nested + "\"}}";
}

std::string description(const Layout& layout) {
  std::string members;
  for (const LayoutField& field : layout.fields) {
    if (!members.empty()) members += ", ";
    members += member(field.name, type_id(field), field.capacity, field.string_capacity,
                      field.message ? field.message->name : "");
  }
  // A struct without members has this member in the description, as in IDL.
  if (members.empty()) members = member("structure_needs_at_least_one_member", static_cast<int>(Kind::uint8), 0, 0, "");
  return "{\"type_name\": \"" + layout.name + "\", \"fields\": [" + members + "]}";
}

void collect(const Layout& layout, std::map<std::string, const Layout*>& found) {
  for (const LayoutField& field : layout.fields)
    if (field.message && found.try_emplace(field.message->name, field.message.get()).second)
      collect(*field.message, found);
}

}  // namespace

std::string type_description(const Layout& layout) {
  std::map<std::string, const Layout*> referenced;
  collect(layout, referenced);
  std::string list;
  for (const auto& [name, type] : referenced) list += (list.empty() ? "" : ", ") + description(*type);
  return "{\"type_description\": " + description(layout) + ", \"referenced_type_descriptions\": [" + list + "]}";
}

std::string type_hash(const Layout& layout) { return "RIHS01_" + io::sha256(type_description(layout)); }

}  // namespace flappy::flightlog::ros
