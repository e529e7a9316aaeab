#include "view/packing.hpp"

#include <zlib.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <stdexcept>

namespace flappy::view {
namespace {

void put_varint(std::string& bytes, std::int64_t value) {
  auto left = (static_cast<std::uint64_t>(value) << 1) ^ static_cast<std::uint64_t>(value >> 63);
  for (; left > 0x7f; left >>= 7) bytes += static_cast<char>(0x80 | (left & 0x7f));
  bytes += static_cast<char>(left);
}

}  // namespace

nlohmann::ordered_json Packing::add(std::span<const double> column, double resolution) {
  const std::size_t at = bytes_.size();
  std::int64_t before = 0;
  for (const double x : column) {
    const double steps = x / resolution;
    if (!(std::abs(steps) < 0x1p52)) throw std::invalid_argument("a value cannot be packed");
    const std::int64_t now = std::llround(steps);
    put_varint(bytes_, now - before);
    before = now;
  }
  return {{"at", at}, {"count", column.size()}, {"step", resolution}};
}

std::string Packing::text() const {
  uLongf size = compressBound(bytes_.size());
  std::string deflated(size, '\0');
  const int failed = compress2(reinterpret_cast<Bytef*>(deflated.data()), &size,
                               reinterpret_cast<const Bytef*>(bytes_.data()), bytes_.size(), 6);
  if (failed != Z_OK) throw std::runtime_error("zlib could not deflate");
  return base64(std::string_view(deflated).substr(0, size));
}

std::string base64(std::string_view bytes) {
  static constexpr char kDigits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    const std::size_t n = std::min<std::size_t>(3, bytes.size() - i);
    std::uint32_t bits = 0;
    for (std::size_t k = 0; k < 3; ++k) bits = bits << 8 | (k < n ? static_cast<unsigned char>(bytes[i + k]) : 0u);
    for (std::size_t k = 0; k < 4; ++k) text += k <= n ? kDigits[bits >> (18 - 6 * k) & 63] : '=';
  }
  return text;
}

}  // namespace flappy::view
