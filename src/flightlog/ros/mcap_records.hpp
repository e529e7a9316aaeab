// Records of MCAP as bytes: a code, the length of the content, and the content.
#pragma once

#include <cstdint>
#include <cstring>
#include <stdexcept>
#include <string>
#include <string_view>

#include "flightlog/ros/layout.hpp"

namespace flappy::flightlog::ros::mcap {

inline constexpr std::string_view kMagic("\x89MCAP0\r\n", 8);
inline constexpr std::size_t kHead = 9;  ///< code and length

enum Code : std::uint8_t {
  kHeader = 1,
  kFooter,
  kSchema,
  kChannel,
  kMessage,
  kChunk,
  kMessageIndex,
  kChunkIndex,
  kAttachment,
  kAttachmentIndex,
  kStatistics,
  kMetadata,
  kMetadataIndex,
  kSummaryOffset,
  kDataEnd,
};

/// Appends numbers and strings. Numbers are little endian, which is also the order in memory on supported machines.
class Bytes {
 public:
  template <class T>
  Bytes& number(T value) {
    char raw[sizeof(T)];
    std::memcpy(raw, &value, sizeof(T));
    text_.append(raw, sizeof(T));
    return *this;
  }
  Bytes& string(std::string_view text) {
    number(static_cast<std::uint32_t>(text.size()));
    text_ += text;
    return *this;
  }
  Bytes& raw(std::string_view bytes) {
    text_ += bytes;
    return *this;
  }
  const std::string& text() const { return text_; }
  std::string record(Code code) const {
    Bytes head;
    head.number<std::uint8_t>(code).number<std::uint64_t>(text_.size());
    return head.text_ + text_;
  }

 private:
  std::string text_;
};

/// Reads numbers and strings from the front; MessageError where too few bytes are left.
class Parts {
 public:
  explicit Parts(std::string_view bytes) : rest_(bytes) {}
  template <class T>
  T number() {
    T value;
    std::memcpy(&value, raw(sizeof(T)).data(), sizeof(T));
    return value;
  }
  std::string_view string() { return raw(number<std::uint32_t>()); }
  std::string_view raw(std::uint64_t size) {
    if (size > rest_.size()) throw MessageError("is shorter than it says");
    const std::string_view taken = rest_.substr(0, size);
    rest_.remove_prefix(size);
    return taken;
  }
  std::string_view rest() const { return rest_; }

 private:
  std::string_view rest_;
};

}  // namespace flappy::flightlog::ros::mcap
