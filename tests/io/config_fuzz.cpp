// Any bytes must be read or refused, and what was read must survive Config::resolved(). Built with libFuzzer
// (FLAPPY_LIBFUZZER) this searches for bytes that break it; otherwise it replays the files and folders it is
// given.
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <sstream>

#include "io/config.hpp"

namespace {

using flappy::io::Config;
using flappy::io::InputError;
using flappy::io::Table;
using Read = std::function<void(const Table&)>;

const std::vector<Read> kReads = {
    [](const Table& t) { t.number("number"); },
    [](const Table& t) { t.number("torso.mass_kg", flappy::io::positive(1)); },
    [](const Table& t) {
      t.number_or("torso.length_m", 0.1, {0.01, 1});
    },
    [](const Table& t) { t.number_or("left.motor.resistance_ohm", 1); },
    [](const Table& t) { t.integer("integer", -5, 5); },
    [](const Table& t) { t.integer_or("seed", 1, 0, 9); },
    [](const Table& t) { t.boolean("flag"); },
    [](const Table& t) { t.boolean_or("quiet", true); },
    [](const Table& t) { t.string("name"); },
    [](const Table& t) { t.string_or("title", "none"); },
    [](const Table& t) {
      t.choice("task", {"hover", "landing"});
    },
    [](const Table& t) { t.numbers("gains", flappy::io::non_negative()); },
    [](const Table& t) { t.numbers("gains", 3); },
    [](const Table& t) {
      t.rows("walls", 2, {-9, 9});
    },
    [](const Table& t) { t.strings("axes"); },
    [](const Table& t) { t.file("vehicle"); },
    [](const Table& t) { t.table("torso"); },
    [](const Table& t) { t.optional_table("effects"); },
    [](const Table& t) {
      for (const Table& wall : t.tables("wall")) wall.number_or("x_m", 0);
    },
    [](const Table& t) {
      for (const auto& key : t.keys()) t.table(key).number("gain");
    },
    [](const Table& t) { t.fail("torso.mass_kg", "is odd", "another"); },
    [](const Table& t) { t.fail("", "is odd", ""); },
    [](const Table& t) { t.finish(); },
};

void require(bool condition) {
  if (!condition) std::abort();
}

/// An InputError must be one printable line; anything else that is thrown ends the program.
void attempt(const std::function<void()>& action) {
  try {
    action();
  } catch (const InputError& error) {
    const std::string line = error.what();
    require(!line.empty());
    for (const char c : line) require(static_cast<unsigned char>(c) >= 0x20);
  }
}

/// Lines such as "# --set a.b=1" are overrides; to TOML they are comments.
std::vector<std::string> overrides_in(const std::string& text) {
  const std::string mark = "# --set ";
  std::vector<std::string> overrides;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    if (line.starts_with(mark)) overrides.push_back(line.substr(mark.size()));
  }
  return overrides;
}

void read_all(const Config& config) {
  for (const Read& read : kReads) {
    attempt([&] { read(config.root()); });
  }
  const std::string resolved = config.resolved();
  if (resolved.size() < 1 << 20) require(Config::parse(resolved, "fuzz.toml").resolved() == resolved);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string text(reinterpret_cast<const char*>(data), size);
  attempt([&] { read_all(Config::parse(text, "fuzz.toml", overrides_in(text))); });
  return 0;
}

#ifndef FLAPPY_LIBFUZZER
int main(int argc, char** argv) {
  namespace fs = std::filesystem;
  std::size_t count = 0;
  const auto replay = [&](const fs::path& path) {
    const std::string text = flappy::io::read_text(path);
    LLVMFuzzerTestOneInput(reinterpret_cast<const std::uint8_t*>(text.data()), text.size());
    ++count;
  };
  for (int i = 1; i < argc; ++i) {
    if (!fs::is_directory(argv[i])) {
      replay(argv[i]);
      continue;
    }
    for (const auto& entry : fs::recursive_directory_iterator(argv[i])) {
      if (entry.is_regular_file()) replay(entry.path());
    }
  }
  std::printf("replayed %zu files\n", count);
  return count > 0 ? 0 : 1;
}
#endif
