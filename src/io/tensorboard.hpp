// TensorBoard's event files: TFRecord frames, each with an Event in protobuf.
//   frame: length (8 bytes), its masked CRC-32C, data, its masked CRC-32C; little endian
//   Event: wall_time = 1 (double), step = 2 (int64), file_version = 3 (string), summary = 5
//   Summary: value = 1, repeated: tag = 1 (string), simple_value = 2 (float)
// tensorflow/core/lib/io/record_writer.h, tensorflow/core/util/event.proto, tensorflow/core/framework/summary.proto
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace flappy::io {

/// CRC-32C (Castagnoli), RFC 3720.
std::uint32_t crc32c(std::string_view bytes);

std::string event_file_start(double wall_s);

/// The frame of one event with a scalar for each tag; leaves out values that are not finite. `wall_s` is Unix time.
std::string scalar_event(double wall_s, std::int64_t step, const std::vector<std::string>& tags,
                         std::span<const double> values);

/// The size of the frame at the beginning of `bytes`; 0 where the frame is incomplete.
std::size_t event_size(std::string_view bytes);

}  // namespace flappy::io
