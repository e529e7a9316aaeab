// ULog files, as a test writes them.
#pragma once

#include <cstdint>
#include <cstring>
#include <string>

namespace flappy::test {

class UlogText {
 public:
  explicit UlogText(const std::string& flags = std::string(40, '\0')) {
    text = std::string("ULog\x01\x12\x35\x01", 8) + std::string(8, '\0');
    message('B', flags);
  }
  UlogText& message(char type, const std::string& content) {
    text += bytes(static_cast<std::uint16_t>(content.size())) + type + content;
    return *this;
  }
  UlogText& format(const std::string& definition) { return message('F', definition); }
  UlogText& topic(std::uint8_t instance, std::uint16_t id, const std::string& name) {
    return message('A', bytes(instance) + bytes(id) + name);
  }
  UlogText& data(std::uint16_t id, const std::string& content) { return message('D', bytes(id) + content); }

  template <class T>
  static std::string bytes(T value) {
    std::string raw(sizeof(T), '\0');
    std::memcpy(raw.data(), &value, sizeof(T));
    return raw;
  }

  std::string text;
};

}  // namespace flappy::test
