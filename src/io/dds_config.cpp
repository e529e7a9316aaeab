#include "io/dds_config.hpp"

#include <algorithm>
#include <cmath>

namespace flappy::io {
namespace {

constexpr std::size_t kMaxPeers = 64;

/// Whether ROS 2 accepts `text` as a part of a name.
bool is_name(const std::string& text) {
  const auto letter = [](char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_'; };
  return !text.empty() && text.size() <= 64 && letter(text[0]) &&
         std::ranges::all_of(text, [&](char c) { return letter(c) || (c >= '0' && c <= '9'); });
}

/// An address or host name, without characters that mean something in the XML that contains it.
bool is_address(const std::string& text) {
  return !text.empty() && text.size() <= 255 && std::ranges::all_of(text, [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '.' || c == '-' ||
           c == ':' || c == '[' || c == ']';
  });
}

}  // namespace

DdsConfig read_dds_config(const Table& root) {
  DdsConfig c;
  const auto table = root.optional_table("dds");
  if (!table) return c;
  const Table& t = *table;
  t.accept(
      {"enabled", "domain", "reach", "peers", "config", "namespace", "watch", "pace", "commands", "insecure", "keys"});
  c.enabled = t.boolean_or("enabled", false);
  c.domain = static_cast<int>(t.integer_or("domain", 0, 0, 232));
  const std::vector<std::string> reaches = {"loopback", "host", "network"};
  c.reach = static_cast<Reach>(std::ranges::find(reaches, t.choice_or("reach", "loopback", reaches)) - reaches.begin());
  c.from_environment = t.choice_or("config", "own", {"own", "environment"}) == "environment";
  if (t.has("peers")) c.peers = t.strings("peers");
  if (c.peers.size() > kMaxPeers) t.fail("peers", "has too many", "at most " + std::to_string(kMaxPeers));
  for (const std::string& peer : c.peers)
    if (!is_address(peer)) t.fail("peers", "\"" + peer + "\" is no address", "addresses or names of machines");
  if (!c.peers.empty() && c.reach != Reach::network)
    t.fail("peers", "would be asked on the network, which reach keeps us from", "reach = \"network\"");
  c.name_space = t.string_or("namespace", c.name_space);
  if (!is_name(c.name_space)) t.fail("namespace", "is no name of ROS 2", "letters, digits and _, no digit first");
  if (t.has("watch")) {
    c.watch.clear();
    for (const double number : t.numbers("watch", {0, 4294967295.0})) {
      if (number != std::floor(number)) t.fail("watch", "is no list of whole numbers", "[0, 7]");
      c.watch.push_back(static_cast<std::uint32_t>(number));
    }
    if (c.watch.empty() || c.watch.size() > kMaxWatched)
      t.fail("watch", "has " + std::to_string(c.watch.size()) + " flappers", "1 to " + std::to_string(kMaxWatched));
  }
  c.pace = t.number_or("pace", c.pace, {0, 1000});
  c.commands = t.boolean_or("commands", false);
  c.insecure = t.boolean_or("insecure", false);
  constexpr int kLastSecure = 230;  // Cyclone DDS accepts no higher domain in a governance file
  if (t.has("keys")) c.keys = t.file("keys");
  if (!c.keys.empty() && c.domain > kLastSecure)
    t.fail("domain", std::to_string(c.domain) + " takes no keys", "with keys, a domain of at most 230");
  const bool far = c.reach == Reach::network || c.from_environment;
  if (c.commands && far && c.keys.empty() && !c.insecure)
    t.fail("commands", "would be taken from anybody on the network",
           "keys = \"folder\" of DDS Security, or insecure = true");
  return c;
}

}  // namespace flappy::io
