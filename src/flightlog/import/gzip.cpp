#include "flightlog/import/gzip.hpp"

#include <zlib.h>

#include <algorithm>
#include <limits>
#include <memory>
#include <stdexcept>

#include "io/files.hpp"

namespace flappy::flightlog {

bool is_gzip(std::string_view bytes) { return bytes.starts_with("\x1f\x8b"); }

std::string gunzipped(std::string_view bytes, const std::string& name, std::vector<std::string>& warnings) {
  constexpr int kLargestWindow = 15, kGzip = 16;
  constexpr std::size_t kChunk = 1 << 18;
  z_stream stream = {};
  if (inflateInit2(&stream, kLargestWindow + kGzip) != Z_OK) throw std::runtime_error("zlib does not start");
  const std::unique_ptr<z_stream, decltype(&inflateEnd)> guard(&stream, inflateEnd);
  std::string text;
  int result = Z_OK;
  while (true) {
    if (stream.avail_in == 0 && !bytes.empty()) {
      const std::size_t part = std::min<std::size_t>(bytes.size(), std::numeric_limits<uInt>::max());
      stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(bytes.data()));
      stream.avail_in = static_cast<uInt>(part);
      bytes.remove_prefix(part);
    }
    const std::size_t before = text.size();
    text.resize(before + kChunk);
    stream.next_out = reinterpret_cast<Bytef*>(text.data() + before);
    stream.avail_out = static_cast<uInt>(kChunk);
    result = inflate(&stream, Z_NO_FLUSH);
    text.resize(before + kChunk - stream.avail_out);
    // A gzip file may consist of several members.
    if (result == Z_STREAM_END && (stream.avail_in > 0 || !bytes.empty())) result = inflateReset(&stream);
    if (result != Z_OK || (stream.avail_in == 0 && bytes.empty() && stream.avail_out > 0)) break;
  }
  if (result == Z_STREAM_END) return text;
  if (text.empty()) throw io::InputError(name + ": is no whole file of gzip; accepted: what gzip made");
  warnings.push_back(name + ": is damaged or was cut off: read as far as it goes");
  return text;
}

}  // namespace flappy::flightlog
