// Any folder must be read as a flight log or refused, and what was read must survive being written. The input is one
// text of several files, each after a line "==== name". Built with libFuzzer (FLAPPY_LIBFUZZER) this searches for a
// text that breaks it; otherwise it replays the files and folders it is given.
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <string_view>

#include "flightlog/flight_log.hpp"

namespace {

using namespace flappy;

void require(bool condition) {
  if (!condition) std::abort();
}

flightlog::LogFiles split(std::string_view text) {
  constexpr std::string_view kMark = "==== ";
  flightlog::LogFiles files;
  std::string* file = nullptr;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('\n'), text.size() - 1) + 1;
    const std::string_view line = text.substr(0, end);
    text.remove_prefix(end);
    if (line.starts_with(kMark))
      file = &files[std::string(line.substr(kMark.size(), line.find_last_not_of("\r\n") + 1 - kMark.size()))];
    else if (file) *file += line;
  }
  return files;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  try {
    const flightlog::LogFiles files = split({reinterpret_cast<const char*>(data), size});
    const flightlog::FlightLog log = flightlog::parse_flight_log(files, "fuzz");
    require(flightlog::parse_flight_log(flightlog::flight_log_files(log), "fuzz") == log);
  } catch (const io::InputError& error) {
    // One printable line; anything else that is thrown ends the program.
    const std::string_view line = error.what();
    require(!line.empty());
    for (const char c : line) require(static_cast<unsigned char>(c) >= 0x20);
  }
  return 0;
}

#ifndef FLAPPY_LIBFUZZER
int main(int argc, char** argv) {
  std::size_t count = 0;
  for (int i = 1; i < argc; ++i) {
    for (const auto& entry : std::filesystem::directory_iterator(argv[i])) {
      const std::string text = io::read_text(entry.path());
      LLVMFuzzerTestOneInput(reinterpret_cast<const std::uint8_t*>(text.data()), text.size());
      ++count;
    }
  }
  std::printf("replayed %zu files\n", count);
  return count > 0 ? 0 : 1;
}
#endif
