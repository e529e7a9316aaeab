#include "flightlog/import/ulog.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cstring>
#include <map>
#include <optional>

#include "io/files.hpp"

namespace flappy::flightlog {
namespace {

constexpr std::string_view kMagic("ULog\x01\x12\x35", 7);
constexpr std::size_t kHeader = 16, kMessageHeader = 3;
constexpr std::size_t kDeepest = 8, kMostValues = 4096;
constexpr std::int64_t kMicrosecond_ns = 1000;

struct Basic {
  std::string_view name;
  std::size_t size;
  double (*read)(const char*);
};

template <class T>
double read_as(const char* bytes) {
  T value;
  std::memcpy(&value, bytes, sizeof(T));
  return static_cast<double>(value);
}

constexpr std::array<Basic, 12> kBasics = {{{"int8_t", 1, read_as<std::int8_t>},
                                            {"uint8_t", 1, read_as<std::uint8_t>},
                                            {"int16_t", 2, read_as<std::int16_t>},
                                            {"uint16_t", 2, read_as<std::uint16_t>},
                                            {"int32_t", 4, read_as<std::int32_t>},
                                            {"uint32_t", 4, read_as<std::uint32_t>},
                                            {"int64_t", 8, read_as<std::int64_t>},
                                            {"uint64_t", 8, read_as<std::uint64_t>},
                                            {"float", 4, read_as<float>},
                                            {"double", 8, read_as<double>},
                                            {"bool", 1, read_as<std::uint8_t>},
                                            {"char", 1, read_as<std::uint8_t>}}};

/// A member of a format: "float[3] gyro_rad".
struct Member {
  std::string type, name;
  std::size_t count = 0;  ///< of an array
};

/// A number of a message by its place; what pads has no name.
struct Place {
  std::string name;
  std::size_t offset;
  const Basic* basic;
};

using Layout = std::vector<Place>;

class UlogReader {
 public:
  UlogReader(std::string_view bytes, std::string name, Channels& channels, std::vector<std::string>& warnings)
      : bytes_(bytes), name_(std::move(name)), channels_(channels), warnings_(warnings) {}

  void read() {
    std::size_t at = kHeader;
    while (at < bytes_.size()) {
      // a logger that died may end amid a message; what was appended later stands where the flags say
      const auto appended = std::ranges::find_if(appended_, [&](std::uint64_t offset) { return offset > at; });
      const std::size_t end =
          appended == appended_.end() ? bytes_.size() : std::min(bytes_.size(), std::size_t{*appended});
      if (end - at < kMessageHeader || end - at - kMessageHeader < number<std::uint16_t>(bytes_.substr(at))) {
        if (end == bytes_.size())
          warnings_.push_back(name_ + ": ends within a message, at byte " + std::to_string(at) +
                              ": read as far as it goes");
        at = end;
        continue;
      }
      const auto size = number<std::uint16_t>(bytes_.substr(at));
      message(bytes_[at + 2], bytes_.substr(at + kMessageHeader, size));
      at += kMessageHeader + size;
    }
    if (bad_ > 0) warnings_.push_back(name_ + ": " + std::to_string(bad_) + " damaged messages: left out");
    if (lost_ms_ > 0) warnings_.push_back(name_ + ": the logger itself dropped " + std::to_string(lost_ms_) + " ms");
  }

 private:
  struct Topic {
    std::string channel;
    const Layout* layout;
    bool wanted;
  };

  template <class T>
  static T number(std::string_view bytes) {
    T value;
    std::memcpy(&value, bytes.data(), sizeof(T));
    return value;
  }

  void message(char type, std::string_view content) {
    switch (type) {
      case 'B':
        return flags(content);
      case 'F':
        return format(content);
      case 'A':
        return subscribe(content);
      case 'D':
        return data(content);
      case 'O':
        if (content.size() >= 2) lost_ms_ += number<std::uint16_t>(content);
        return;
      default:
        return;
    }
  }

  void flags(std::string_view content) {
    constexpr std::size_t kFlags = 16, kOffsets = 3;
    if (content.size() < kFlags + kOffsets * 8) return void(++bad_);
    if ((content[8] & ~1) != 0 || std::ranges::any_of(content.substr(9, 7), [](char c) { return c != 0; }))
      throw io::InputError(name_ +
                           ": is a ULog of a kind that is newer than this reader; accepted: appended data alone");
    for (std::size_t i = 0; i < kOffsets; ++i)
      if (const auto offset = number<std::uint64_t>(content.substr(kFlags + 8 * i)); offset > 0)
        appended_.push_back(offset);
  }

  /// "name:type name;type name;".
  void format(std::string_view content) {
    const std::size_t colon = content.find(':');
    if (colon == std::string_view::npos) return void(++bad_);
    std::vector<Member>& members = formats_[std::string(content.substr(0, colon))];
    members.clear();
    std::string_view rest = content.substr(colon + 1);
    while (!rest.empty()) {
      const std::size_t end = std::min(rest.find(';'), rest.size());
      const std::string_view text = rest.substr(0, end);
      rest.remove_prefix(std::min(end + 1, rest.size()));
      const std::size_t space = text.find(' ');
      if (space == std::string_view::npos) continue;
      Member member{std::string(text.substr(0, space)), std::string(text.substr(space + 1))};
      if (const std::size_t open = member.type.find('['); open != std::string::npos) {
        std::from_chars(member.type.data() + open + 1, member.type.data() + member.type.size(), member.count);
        if (member.count == 0) return void(++bad_);
        member.type.resize(open);
      }
      members.push_back(std::move(member));
    }
  }

  /// False where a type is unknown, or there are too many of them.
  bool lay(const std::string& type, const std::string& path, std::size_t depth, std::size_t& offset,
           Layout& layout) const {
    const auto format = formats_.find(type);
    if (format == formats_.end() || format->second.empty() || depth > kDeepest) return false;
    for (const Member& member : format->second) {
      const std::string name = path.empty() ? member.name : path + "." + member.name;
      const auto basic = std::ranges::find(kBasics, member.type, &Basic::name);
      const bool pads = member.name.starts_with("_padding");
      for (std::size_t i = 0; i < std::max<std::size_t>(member.count, 1); ++i) {
        const std::string element = member.count > 0 ? name + "[" + std::to_string(i) + "]" : name;
        if (basic == kBasics.end()) {
          if (!lay(member.type, element, depth + 1, offset, layout)) return false;
          continue;
        }
        if (layout.size() >= kMostValues) return false;
        layout.push_back({pads ? "" : element, offset, basic});
        offset += basic->size;
      }
    }
    return true;
  }

  void subscribe(std::string_view content) {
    if (content.size() < 4) return void(++bad_);
    const auto instance = static_cast<unsigned>(static_cast<unsigned char>(content[0]));
    const auto id = number<std::uint16_t>(content.substr(1));
    const std::string type(content.substr(3));
    auto layout = layouts_.find(type);
    if (layout == layouts_.end()) {
      Layout made;
      std::size_t size = 0;
      if (!lay(type, "", 0, size, made)) {
        warnings_.push_back(name_ + ": topic " + type + " has no format that can be read: left out");
        return;
      }
      layout = layouts_.emplace(type, std::move(made)).first;
    }
    const std::string channel = type + "[" + std::to_string(instance) + "]";
    topics_[id] = {channel, &layout->second, channels_.wants(channel)};
    channels_.add(channel);
  }

  void data(std::string_view content) {
    if (content.size() < 2) return void(++bad_);
    const auto topic = topics_.find(number<std::uint16_t>(content));
    if (topic == topics_.end() || !topic->second.wanted) return;
    content.remove_prefix(2);
    row_.clear();
    std::int64_t timestamp_ns = kNoTime, sample_ns = kNoTime;
    for (const Place& place : *topic->second.layout) {
      if (place.name.empty()) continue;  // padding at the end is not written
      if (place.offset + place.basic->size > content.size()) return void(++bad_);
      const char* const at = content.data() + place.offset;
      row_.push_back({place.name, place.basic->read(at)});
      if (place.basic->size != 8) continue;
      const auto t_us = number<std::uint64_t>({at, 8});
      if (t_us > std::uint64_t{1} << 52) continue;  // no time
      if (place.name == "timestamp") timestamp_ns = static_cast<std::int64_t>(t_us) * kMicrosecond_ns;
      if (place.name == "timestamp_sample" && t_us > 0) sample_ns = static_cast<std::int64_t>(t_us) * kMicrosecond_ns;
    }
    channels_.add(topic->second.channel, timestamp_ns, sample_ns == kNoTime ? timestamp_ns : sample_ns, row_);
  }

  std::string_view bytes_;
  std::string name_;
  Channels& channels_;
  std::vector<std::string>& warnings_;
  std::map<std::string, std::vector<Member>> formats_;
  std::map<std::string, Layout> layouts_;
  std::map<std::uint16_t, Topic> topics_;
  std::vector<std::uint64_t> appended_;
  Row row_;
  std::size_t bad_ = 0, lost_ms_ = 0;
};

}  // namespace

bool is_ulog(std::string_view bytes) { return bytes.starts_with(kMagic); }

void read_ulog(std::string_view bytes, const std::string& name, Channels& channels,
               std::vector<std::string>& warnings) {
  if (!is_ulog(bytes)) throw io::InputError(name + ": is no ULog; accepted: a file that begins as one");
  UlogReader(bytes, name, channels, warnings).read();
}

}  // namespace flappy::flightlog
