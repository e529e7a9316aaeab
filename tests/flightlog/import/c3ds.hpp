// C3D files, as a test writes them.
#pragma once

#include <bit>
#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

namespace flappy::test {

enum class Processor : char { intel = 84, dec = 85, mips = 86 };

/// Numbers of a processor, and the parameters that are added.
class C3dText {
 public:
  explicit C3dText(Processor processor, bool real) : processor_(processor), real_(real) {}

  std::string word(int value) const {
    const auto low = static_cast<char>(value & 0xff), high = static_cast<char>(value >> 8 & 0xff);
    return processor_ == Processor::mips ? std::string{high, low} : std::string{low, high};
  }
  std::string real(double value) const {
    // VAX F: an exponent that is larger by 2, upper half first
    auto bits = std::bit_cast<std::uint32_t>(static_cast<float>(processor_ == Processor::dec ? 4 * value : value));
    if (processor_ == Processor::dec) bits = std::rotl(bits, 16);
    const std::string lower = word(static_cast<int>(bits & 0xffff)), upper = word(static_cast<int>(bits >> 16));
    return processor_ == Processor::mips ? upper + lower : lower + upper;
  }
  /// A coordinate, an analog sample or a residual's word as this file stores it.
  std::string stored(double value) const { return real_ ? real(value) : word(static_cast<int>(std::lround(value))); }

  C3dText& group(int id, const std::string& name) {
    parameters += std::string{static_cast<char>(name.size()), static_cast<char>(-id)} + name + word(3) + '\0';
    return *this;
  }
  C3dText& add(int id, const std::string& name, int type, const std::string& sizes, const std::string& data) {
    const std::string rest = static_cast<char>(type) + (static_cast<char>(sizes.size()) + sizes) + data + '\0';
    parameters += std::string{static_cast<char>(name.size()), static_cast<char>(id)} + name +
                  word(static_cast<int>(rest.size() + 2)) + rest;
    return *this;
  }
  C3dText& integers(int id, const std::string& name, const std::vector<int>& values) {
    std::string data;
    for (const int v : values) data += word(v);
    return add(id, name, 2, values.size() == 1 ? "" : std::string(1, static_cast<char>(values.size())), data);
  }
  C3dText& reals(int id, const std::string& name, const std::vector<double>& values) {
    std::string data;
    for (const double v : values) data += real(v);
    return add(id, name, 4, values.size() == 1 ? "" : std::string(1, static_cast<char>(values.size())), data);
  }
  C3dText& texts(int id, const std::string& name, const std::vector<std::string>& values) {
    std::string data;
    for (std::string v : values) {
      v.resize(12, ' ');
      data += v;
    }
    return add(id, name, -1, std::string{12, static_cast<char>(values.size())}, data);
  }

  static std::string padded(std::string bytes) { return bytes + std::string(-bytes.size() % 512, '\0'); }
  /// The block where the data begin: behind header and parameters, whose sizes do not depend on it.
  int data_block() const { return 2 + static_cast<int>((parameters.size() + 4 + 511) / 512); }

  std::string file(int points, int analog_samples, int times, int frames, double scale, double rate_Hz,
                   const std::string& data) const {
    const std::string head = std::string("\x02\x50", 2) + word(points) + word(analog_samples) + word(1) + word(frames) +
                             word(0) + real(scale) + word(data_block()) + word(times) + real(rate_Hz);
    const std::string blocks = {'\1', '\x50', static_cast<char>(data_block() - 2), static_cast<char>(processor_)};
    return padded(head) + padded(blocks + parameters) + padded(data);
  }

  std::string parameters;

 private:
  Processor processor_;
  bool real_;
};

}  // namespace flappy::test
