// Packs columns of numbers into text within a page: rounded to multiples of a resolution, differences as
// variable-length integers, all columns together deflated (RFC 1950), in base64. web/packing.js unpacks them.
//
//   d_0 = round(x_0 / r), d_i = round(x_i / r) - round(x_(i-1) / r)    zigzag: 0, -1, 1, -2, ... become 0, 1, 2, 3, ...
//   seven bits a byte, the lowest first, the highest bit set where more bytes follow (Protocol Buffers' varint)
//
// Neighbouring samples of a sensor differ by about its noise: at a tenth of the noise, each takes about one byte.
#pragma once

#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace flappy::view {

class Packing {
 public:
  /// Packs a column and returns what the page needs to find it: {"at": first byte, "count": n, "step": resolution}.
  /// Throws std::invalid_argument for a value that is not a number, or whose magnitude is 2^52 resolutions or more.
  nlohmann::ordered_json add(std::span<const double> column, double resolution);

  std::string text() const;  ///< of all columns so far

 private:
  std::string bytes_;
};

std::string base64(std::string_view bytes);  ///< RFC 4648, with padding

}  // namespace flappy::view
