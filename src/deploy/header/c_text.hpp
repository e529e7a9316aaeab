#pragma once

#include <cstdint>
#include <span>
#include <string>

namespace flappy::deploy {

/// An exact C literal: a float as hexadecimal single precision ("-0x1.8p+3F").
std::string c_number(float value);
std::string c_number(std::int32_t value);

/// Numbers in braces, broken into lines.
template <class N>
std::string c_row(std::span<const N> numbers);
/// `declaration = {...};`
template <class N>
std::string c_array(const std::string& declaration, std::span<const N> numbers) {
  return declaration + " = " + c_row(numbers) + ";\n";
}

extern template std::string c_row(std::span<const float>);
extern template std::string c_row(std::span<const std::int32_t>);

std::string c_comment(const std::string& text);

/// The end of a header that began with "#ifndef FLAPPY_NAME_H". Including a second header of the same name with another
/// `crc` is a compile error.
std::string end_of_header(const std::string& name, std::uint32_t crc);

std::string c_string(const std::string& text);

/// CRC-32 (IEEE 802.3) of the numbers' four bytes each, lowest first. `crc` is the CRC of preceding numbers, or 0.
std::uint32_t crc32(std::uint32_t crc, std::span<const std::int32_t> numbers);
std::uint32_t crc32(std::uint32_t crc, std::span<const float> numbers);

}  // namespace flappy::deploy
