#include "server/jobs/names.hpp"

#include <algorithm>
#include <cctype>
#include <cstddef>
#include <string_view>

#include "io/files.hpp"
#include "server/jobs/job.hpp"

namespace flappy::server {
namespace {

namespace fs = std::filesystem;

constexpr const char* kAcceptedNames =
    "a name of letters, digits, \"_\", \"-\", \".\" and \"/\", each part beginning with a letter, a digit or \"_\"";

bool is_plain(char c) { return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_'; }

}  // namespace

bool is_name(std::string_view name) {
  if (name.size() > kMaxOfConfig) return false;
  while (true) {
    const std::string_view part = name.substr(0, name.find('/'));
    if (part.empty() || !is_plain(part.front())) return false;
    if (!std::ranges::all_of(part, [](char c) { return is_plain(c) || c == '-' || c == '.'; })) return false;
    if (part.size() == name.size()) return true;
    name.remove_prefix(part.size() + 1);
  }
}

fs::path below(const fs::path& folder, const std::string& name, const std::string& what) {
  if (name.size() > kMaxOfConfig)
    throw io::InputError(what + ": has " + std::to_string(name.size()) + " characters; accepted: at most " +
                         std::to_string(kMaxOfConfig));
  const auto refuse = [&](const std::string& why) -> io::InputError {
    return io::InputError(what + ": \"" + shown(name) + "\" " + why);
  };
  if (!is_name(name)) throw refuse(std::string("is no name; accepted: ") + kAcceptedNames);
  std::error_code error;
  const fs::path root = fs::canonical(folder, error);
  if (error) throw io::InputError(folder.string() + ": cannot be read: " + error.message());
  fs::path found = fs::canonical(root / name, error);
  if (error) throw refuse("is not there; accepted: what lies below the allowed folder");
  // compare part by part, so that /a/bc is not below /a/b
  const auto differ = std::ranges::mismatch(root, found);
  if (differ.in1 != root.end() || differ.in2 == found.end())
    throw refuse("leads out of the allowed folder; accepted: what lies below it");
  return found;
}

void check_override(const std::string& override) {
  const auto refuse = [&](const std::string& what) {
    throw io::InputError("override: \"" + shown(override, kMaxOfOverride) + "\" " + what);
  };
  if (override.size() > kMaxOfOverride)
    refuse("... has " + std::to_string(override.size()) + " characters; accepted: at most " +
           std::to_string(kMaxOfOverride));
  const std::size_t equal = override.find('=');
  const std::string_view key = std::string_view(override).substr(0, equal);
  if (equal == std::string::npos || !is_name(key) || key.find('/') != std::string_view::npos)
    refuse("is not KEY=VALUE; accepted: as a.b=1");
  const std::string_view value = std::string_view(override).substr(equal + 1);
  const bool printable = std::ranges::all_of(value, [](unsigned char c) { return c >= 0x20 && c < 0x7f; });
  if (!printable || value.find_first_of("/\\") != std::string_view::npos || value.find("..") != std::string_view::npos)
    refuse("may name a file; accepted: a value without \"/\", \"\\\", \"..\" and control characters");
}

}  // namespace flappy::server
