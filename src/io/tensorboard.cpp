#include "io/tensorboard.hpp"

#include <array>
#include <bit>
#include <cmath>

namespace flappy::io {
namespace {

constexpr std::array<std::uint32_t, 256> crc_table() {
  std::array<std::uint32_t, 256> table{};
  for (std::uint32_t i = 0; i < table.size(); ++i) {
    std::uint32_t value = i;
    for (int bit = 0; bit < 8; ++bit) value = (value >> 1) ^ ((value & 1) != 0 ? 0x82f63b78u : 0u);
    table[i] = value;
  }
  return table;
}

template <class T>
std::string little_endian(T value) {
  std::string text;
  for (std::size_t i = 0; i < sizeof value; ++i) text += static_cast<char>(value >> (8 * i) & 0xff);
  return text;
}

std::string masked_crc(std::string_view bytes) { return little_endian(std::rotr(crc32c(bytes), 15) + 0xa282ead8u); }

std::string frame(std::string_view data) {
  const std::string length = little_endian(std::uint64_t{data.size()});
  return length + masked_crc(length) + std::string(data) + masked_crc(data);
}

// Protobuf: a key consists of the field's number and the encoding of its value.

std::string varint(std::uint64_t value) {
  std::string text;
  for (; value > 0x7f; value >>= 7) text += static_cast<char>((value & 0x7f) | 0x80);
  return text + static_cast<char>(value);
}

std::string key(unsigned field, unsigned wire_type) { return varint(field << 3 | wire_type); }

std::string varint_field(unsigned field, std::uint64_t value) { return key(field, 0) + varint(value); }
std::string double_field(unsigned field, double value) {
  return key(field, 1) + little_endian(std::bit_cast<std::uint64_t>(value));
}
std::string bytes_field(unsigned field, std::string_view bytes) {
  return key(field, 2) + varint(bytes.size()) + std::string(bytes);
}
std::string float_field(unsigned field, float value) {
  return key(field, 5) + little_endian(std::bit_cast<std::uint32_t>(value));
}

}  // namespace

std::uint32_t crc32c(std::string_view bytes) {
  static constexpr auto kTable = crc_table();
  std::uint32_t crc = ~0u;
  for (const char c : bytes) crc = (crc >> 8) ^ kTable[(crc ^ static_cast<unsigned char>(c)) & 0xff];
  return ~crc;
}

std::string event_file_start(double wall_s) { return frame(double_field(1, wall_s) + bytes_field(3, "brain.Event:2")); }

std::string scalar_event(double wall_s, std::int64_t step, const std::vector<std::string>& tags,
                         std::span<const double> values) {
  std::string summary;
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (!std::isfinite(values[i])) continue;
    summary += bytes_field(1, bytes_field(1, tags[i]) + float_field(2, static_cast<float>(values[i])));
  }
  return frame(double_field(1, wall_s) + varint_field(2, static_cast<std::uint64_t>(step)) + bytes_field(5, summary));
}

std::size_t event_size(std::string_view bytes) {
  constexpr std::size_t kAround = 8 + 4 + 4;
  if (bytes.size() < kAround) return 0;
  std::uint64_t length = 0;
  for (std::size_t i = 0; i < 8; ++i) length |= std::uint64_t{static_cast<unsigned char>(bytes[i])} << (8 * i);
  return length > bytes.size() - kAround ? 0 : kAround + length;
}

}  // namespace flappy::io
