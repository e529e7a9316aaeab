// Pieces of C source.
#pragma once

#include <cstdint>
#include <span>
#include <string>

namespace flappy::deploy {

/// A number as C writes it, to the bit: hexadecimal, single precision ("-0x1.8p+3F").
std::string c_number(float value);
std::string c_number(std::int32_t value);

/// Numbers in braces, over as many lines as they need, the first of them where the caller is.
template <class N>
std::string c_row(std::span<const N> numbers);
/// `declaration = {...};`
template <class N>
std::string c_array(const std::string& declaration, std::span<const N> numbers) {
  return declaration + " = " + c_row(numbers) + ";\n";
}

extern template std::string c_row(std::span<const float>);
extern template std::string c_row(std::span<const std::int32_t>);

/// The lines of a text in one comment.
std::string c_comment(const std::string& text);

/// The end of what "#ifndef FLAPPY_NAME_H" begins: another header of the same prefix, with other numbers, is no silent copy of the first but an error.
std::string end_of_header(const std::string& name, std::uint32_t crc);

/// A string literal.
std::string c_string(const std::string& text);

/// CRC-32 (IEEE 802.3) of the numbers' four bytes each, lowest first, after those that gave `crc`, or 0.
std::uint32_t crc32(std::uint32_t crc, std::span<const std::int32_t> numbers);
std::uint32_t crc32(std::uint32_t crc, std::span<const float> numbers);

}  // namespace flappy::deploy
