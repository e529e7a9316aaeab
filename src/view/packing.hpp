// Columns of numbers as text that a page carries. Each column is rounded to whole multiples of a resolution, differences of
// neighbours are written as variable-length integers, and all columns together are deflated (RFC 1950) and written in base64.
// web/packing.js reads them.
//
//   d_0 = round(x_0 / r), d_i = round(x_i / r) - round(x_(i-1) / r)      zigzag: 0, -1, 1, -2, ... become 0, 1, 2, 3, ...
//   seven bits a byte, the lowest first, the highest bit set where more follow (Protocol Buffers' varint)
//
// Samples of a sensor differ by about its noise, so a resolution of a tenth of that leaves a byte for each.
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
  /// What the page needs to find the column again: {"at": first byte, "count": n, "step": resolution}.
  /// std::invalid_argument for a value that is no number, or 2^52 resolutions and more from 0.
  nlohmann::ordered_json add(std::span<const double> column, double resolution);

  /// Of all columns so far.
  std::string text() const;

 private:
  std::string bytes_;
};

/// RFC 4648, with padding.
std::string base64(std::string_view bytes);

}  // namespace flappy::view
