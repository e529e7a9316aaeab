#include "io/tensorboard.hpp"

#include <gtest/gtest.h>

#include <limits>

namespace flappy::io {
namespace {

std::string bytes(std::initializer_list<int> values) {
  std::string text;
  for (const int value : values) text += static_cast<char>(value);
  return text;
}

// RFC 3720, B.4, and the check value of the CRC catalogue
TEST(Tensorboard, Crc32cAgreesWithTheStandard) {
  EXPECT_EQ(crc32c(""), 0u);
  EXPECT_EQ(crc32c("123456789"), 0xe3069283u);
  EXPECT_EQ(crc32c(std::string(32, '\0')), 0x8a9136aau);
  EXPECT_EQ(crc32c(std::string(32, '\xff')), 0x62a8ab43u);
  std::string rising;
  for (int i = 0; i < 32; ++i) rising += static_cast<char>(i);
  EXPECT_EQ(crc32c(rising), 0x46dd794eu);
}

// The frames byte for byte, written out by hand from the protobuf encoding; 1.5 is 3ff8000000000000, 0.5f 3f000000.
TEST(Tensorboard, WritesTheBytesOfTheFormat) {
  const std::string start = event_file_start(1.5);
  ASSERT_EQ(start.size(), 16 + 9 + 15u);
  EXPECT_EQ(start.substr(0, 8), bytes({24, 0, 0, 0, 0, 0, 0, 0}));
  EXPECT_EQ(start.substr(12, 24), bytes({0x09, 0, 0, 0, 0, 0, 0, 0xf8, 0x3f, 0x1a, 13}) + "brain.Event:2");
  const std::string event =
      scalar_event(1.5, 200, {"a", "gone", "bc"}, std::vector{0.5, std::numeric_limits<double>::infinity(), -0.5});
  const std::string data = bytes({0x09, 0, 0, 0, 0, 0, 0, 0xf8, 0x3f}) + bytes({0x10, 0xc8, 0x01}) + bytes({0x2a, 21}) +
                           bytes({0x0a, 8, 0x0a, 1, 'a', 0x15, 0, 0, 0, 0x3f}) +
                           bytes({0x0a, 9, 0x0a, 2, 'b', 'c', 0x15, 0, 0, 0, 0xbf});
  EXPECT_EQ(event.substr(12, event.size() - 16), data);
  const auto mask = [](std::uint32_t crc) { return ((crc >> 15) | (crc << 17)) + 0xa282ead8u; };
  const auto word = [](std::uint32_t v) {
    return bytes({int(v & 255), int(v >> 8 & 255), int(v >> 16 & 255), int(v >> 24)});
  };
  EXPECT_EQ(event.substr(8, 4), word(mask(crc32c(event.substr(0, 8)))));
  EXPECT_EQ(event.substr(event.size() - 4), word(mask(crc32c(data))));
}

TEST(Tensorboard, KnowsWhereAFrameEnds) {
  const std::string event = event_file_start(1.5);
  EXPECT_EQ(event_size(event), event.size());
  EXPECT_EQ(event_size(event + "more"), event.size());
  for (std::size_t size = 0; size < event.size(); ++size) EXPECT_EQ(event_size(event.substr(0, size)), 0u);
  EXPECT_EQ(event_size(std::string(40, '\xff')), 0u);
}

}  // namespace
}  // namespace flappy::io
