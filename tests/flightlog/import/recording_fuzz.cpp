// Any bytes must be read as a recording as far as they go, or refused: MCAP, messages in CDR with their definitions, ULog,
// usdlog, DataFlash, C3D, tables and exports of motion capture. The first byte says which. Built with libFuzzer
// (FLAPPY_LIBFUZZER) this searches for bytes that break it; otherwise it replays the files and folders it is given.
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <string_view>

#include "flightlog/import/c3d.hpp"
#include "flightlog/import/dataflash.hpp"
#include "flightlog/import/message_rows.hpp"
#include "flightlog/import/table.hpp"
#include "flightlog/import/ulog.hpp"
#include "flightlog/import/usdlog.hpp"
#include "flightlog/ros/bag.hpp"
#include "flightlog/ros/cdr.hpp"
#include "flightlog/ros/mcap.hpp"
#include "io/files.hpp"

namespace {

using namespace flappy;
using namespace flappy::flightlog;

void require(bool condition) {
  if (!condition) std::abort();
}

void read_mcap(std::string_view bytes) {
  ros::McapReader reader(bytes, "fuzz");
  while (const auto message = reader.next()) {
    try {
      MessageRows(ros::layout_of({message->topic->name, message->topic->type, message->topic->definition}))
          .read(message->bytes);
    } catch (const ros::MessageError&) {
    }
  }
}

/// A definition, a zero, and a message of it: what is read and written again must read as the same.
void read_message(std::string_view bytes) {
  const std::size_t end = std::min(bytes.find('\0'), bytes.size());
  ros::Definitions definitions;
  definitions.add("p/msg/M", bytes.substr(0, end));
  const auto layout = definitions.layout("p/msg/M");
  const ros::Members members = decode(*layout, bytes.substr(std::min(end + 1, bytes.size())));
  const std::string written = encode(*layout, members);
  require(encode(*layout, decode(*layout, written)) == written);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const std::string_view bytes(reinterpret_cast<const char*>(data) + 1, size - 1);
  try {
    if (data[0] == 'm') read_mcap(bytes);
    if (data[0] == 'c') read_message(bytes);
    Channels all;
    std::vector<std::string> ignored;
    if (data[0] == 'f' && is_dataflash(bytes)) read_dataflash(bytes, "fuzz", all, ignored);
    if (data[0] == 'l' && is_dataflash_text(bytes)) read_dataflash_text(bytes, "fuzz", all, ignored);
    if (data[0] == '3' && is_c3d(bytes)) read_c3d(bytes, "fuzz", "fuzz", all, ignored);
    if (data[0] == 't') read_table(bytes, "fuzz", "fuzz", all, ignored);
    if (data[0] == 'u' || (data[0] == 'd' && is_usdlog(bytes))) {
      Channels channels;
      std::vector<std::string> warnings;
      (data[0] == 'u' ? read_ulog : read_usdlog)(bytes, "fuzz", channels, warnings);
    }
  } catch (const ros::MessageError&) {
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
