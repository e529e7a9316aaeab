#include "flightlog/import/ulog.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <map>
#include <optional>
#include <set>

#include "flightlog/import/bytes.hpp"
#include "flightlog/import/not_measured.hpp"
#include "io/files.hpp"
#include "io/text.hpp"

namespace flappy::flightlog {
namespace {

constexpr std::string_view kMagic("ULog\x01\x12\x35", 7);
constexpr std::size_t kHeader = 16, kMessageHeader = 3;
constexpr std::size_t kDeepest = 8, kMaxValues = 4096, kMaxSize = 65535;
constexpr std::size_t kFlags = 16, kOffsets = 3;  // message of flags: its bytes of flags, offsets of appended data
constexpr std::string_view kTypes = "BFAIMPQDRLCOS";
constexpr std::size_t kLongestName = 256;
constexpr std::string_view kSync("\x2F\x73\x13\x20\x25\x0C\xBB\x12", 8);
constexpr std::int64_t kMicrosecond_ns = 1000;

struct Basic {
  std::string_view name;
  std::size_t size;
  double (*read)(const char*);
};

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
  std::size_t count = 0;  ///< size of an array; 0: no array
};

/// A number in a message and its offset; padding has an empty name.
struct Place {
  std::string name;
  std::size_t offset;
  const Basic* basic;
};

struct Layout {
  std::vector<Place> places;
  std::size_t size = 0;
  /// Least size of a message: the logger does not write padding at the end.
  std::size_t least_size() const {
    const auto last =
        std::ranges::find_if(places.rbegin(), places.rend(), [](const Place& p) { return !p.name.empty(); });
    return last == places.rend() ? 0 : last->offset + last->basic->size;
  }
};

bool is_text(std::string_view bytes) {
  return std::ranges::all_of(bytes, [](char c) { return c >= 0x20 && c < 0x7f; });
}

bool is_name(std::string_view bytes) {
  return !bytes.empty() && std::ranges::all_of(bytes, [](unsigned char c) {
    return std::isalnum(c) != 0 || c == '_' || c == '/' || c == '-';
  });
}

class UlogReader {
 public:
  UlogReader(std::string_view bytes, std::string name, Channels& channels, std::vector<std::string>& warnings)
      : bytes_(bytes), name_(std::move(name)), channels_(channels), warnings_(warnings) {}

  void read() {
    std::size_t at = kHeader;
    while (at < bytes_.size()) {
      const auto found = message_at(at);
      if (found && believed(*found)) {
        take(*found);
        at = found->next;
      } else {
        at = skip(at);
      }
    }
    warn();
  }

 private:
  struct Topic {
    std::string channel;
    const Layout* layout;  ///< null where the format cannot be read
    bool wanted;
    NotMeasured not_measured;
  };

  struct Message {
    char type;
    std::string_view content;
    std::size_t at, next;  ///< offset of the message and of the next one
  };

  // ---- finding messages in a file that may be damaged

  /// End of the part of the file that contains `at`. A logger that died may end within a message; the flags give the
  /// offsets of data appended later.
  std::size_t end_of_part(std::size_t at) const {
    std::size_t end = bytes_.size();
    for (const std::uint64_t offset : appended_)
      if (offset > at) end = std::min(end, std::size_t{offset});
    return end;
  }

  /// The message at an offset; nothing where the part ends before the message does.
  std::optional<Message> message_at(std::size_t at) const {
    const std::size_t end = end_of_part(at);
    if (at >= end || end - at < kMessageHeader) return std::nullopt;
    const std::size_t size = number<std::uint16_t>(bytes_.substr(at));
    if (end - at - kMessageHeader < size) return std::nullopt;
    return Message{bytes_[at + 2], bytes_.substr(at + kMessageHeader, size), at, at + kMessageHeader + size};
  }

  /// Whether the content of a message is plausible for its type.
  bool sound(const Message& m) const {
    const std::string_view c = m.content;
    const auto key_at = [&](std::size_t i) {  // a length and this number of characters
      return c.size() > i && c[i] > 0 && c.size() > i + static_cast<unsigned char>(c[i]) &&
             is_text(c.substr(i + 1, static_cast<unsigned char>(c[i])));
    };
    switch (m.type) {
      case 'B':
        return m.at == kHeader && c.size() >= kFlags + kOffsets * 8;
      case 'F': {
        const std::size_t colon = c.substr(0, kLongestName).find(':');
        return colon != std::string_view::npos && is_name(c.substr(0, colon)) && is_text(c);
      }
      case 'A':
        return c.size() > 3 && c.size() <= 3 + kLongestName && is_name(c.substr(3));
      case 'D': {
        if (c.size() < 2) return false;
        const auto known = sizes_.find(number<std::uint16_t>(c));
        return known != sizes_.end() && c.size() >= known->second.first && c.size() <= known->second.second;
      }
      case 'I':
      case 'P':
        return key_at(0);
      case 'M':
      case 'Q':
        return key_at(1);
      case 'L':
      case 'C':  // 'L' and 'C' begin with a log level
        return c.size() >= 9 && c[0] >= '0' && c[0] <= '7';
      case 'R':
      case 'O':
        return c.size() == 2;
      case 'S':
        return c == kSync;
      default:
        return false;
    }
  }

  /// Whether a sound message follows, after at most `others` unsound ones, or the part ends.
  bool goes_on(std::size_t at, int others) const {
    if (at == end_of_part(at - 1)) return true;
    const auto m = message_at(at);
    if (!m) return cut_off(at);
    return sound(*m) || (others > 0 && goes_on(m->next, others - 1));
  }

  /// Whether the part ends within a message that begins at this offset.
  bool cut_off(std::size_t at) const {
    const std::string_view rest = bytes_.substr(at, end_of_part(at) - at);
    if (rest.size() < kMessageHeader) return true;
    const std::size_t left = rest.size() - kMessageHeader, size = number<std::uint16_t>(rest);
    if (left >= size || kTypes.find(rest[2]) == std::string_view::npos) return false;
    if (rest[2] != 'D' || rest.size() < kMessageHeader + 2) return true;
    const auto known = sizes_.find(number<std::uint16_t>(rest.substr(kMessageHeader)));
    return known != sizes_.end() && size <= known->second.second;
  }

  /// Whether to trust a message: a sound definition, without which a topic is lost; data if another message follows, as
  /// none would in step after a lost byte; any other unless data lie within it, because then its size is damaged.
  bool believed(const Message& m) const {
    const bool is_sound = sound(m);
    if (is_sound && (m.type == 'F' || m.type == 'A')) return true;
    if (!goes_on(m.next, is_sound ? 2 : 1)) return false;
    return (is_sound && m.type == 'D') || next_sound(m.at + 1, m.next, "DS") == m.next;
  }

  /// The next offset before `end` with a sound message of one of these types that another message follows; else `end`.
  std::size_t next_sound(std::size_t from, std::size_t end, std::string_view types) const {
    for (std::size_t at = from; at < end; ++at)
      if (const auto m = message_at(at);
          m && types.find(m->type) != std::string_view::npos && sound(*m) && goes_on(m->next, 1))
        return at;
    return end;
  }

  /// Returns the offset of the next message and counts the bytes skipped.
  std::size_t skip(std::size_t at) {
    const std::size_t end = end_of_part(at), to = next_sound(at + 1, end, "DSFA");
    if (to == end && end == bytes_.size() && cut_off(at)) {
      cut_at_ = at;
    } else {
      if (skips_++ == 0) first_skip_ = at;
      skipped_ += to - at;
    }
    return to;
  }

  void warn() {
    const auto say = [&](const std::string& what) { warnings_.push_back(name_ + ": " + what); };
    if (skips_ > 0)
      say("is damaged: " + std::to_string(skipped_) + " bytes skipped in " + std::to_string(skips_) +
          (skips_ > 1 ? " places, the first" : " place,") + " at byte " + std::to_string(first_skip_));
    if (cut_at_) say("ends within a message, at byte " + std::to_string(*cut_at_) + ": read as far as it goes");
    if (bad_ > 0) say(std::to_string(bad_) + " damaged messages left out");
    if (unknown_ > 0) say(std::to_string(unknown_) + " messages of kinds that are not known left out");
    if (orphans_ > 0) say(std::to_string(orphans_) + " messages of topics that are not announced left out");
    if (lost_ms_ > 0) say("the logger itself dropped " + std::to_string(lost_ms_) + " ms");
  }

  // ---- interpreting messages

  template <class T>
  static T number(std::string_view bytes) {
    return number_at<T>(bytes.data());
  }

  void take(const Message& message) {
    const std::string_view content = message.content;
    if (!sound(message) && message.type != 'D')
      return void(++(kTypes.find(message.type) == std::string_view::npos ? unknown_ : bad_));
    switch (message.type) {
      case 'B':
        return flags(content);
      case 'F':
        return format(content);
      case 'A':
        return subscribe(content);
      case 'D':
        return data(content);
      case 'O':
        lost_ms_ += number<std::uint16_t>(content);
        return;
      default:
        return;
    }
  }

  void flags(std::string_view content) {
    if ((content[8] & ~1) != 0 || std::ranges::any_of(content.substr(9, 7), [](char c) { return c != 0; }))
      throw io::InputError(name_ +
                           ": is a ULog of a kind that is newer than this reader; accepted: appended data alone");
    for (std::size_t i = 0; i < kOffsets; ++i)
      if (const auto offset = number<std::uint64_t>(content.substr(kFlags + 8 * i)); offset > 0)
        appended_.push_back(offset);
  }

  /// Reads a format "name:type name;type name;".
  void format(std::string_view content) {
    const std::size_t colon = content.find(':');
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

  /// Adds a type's numbers, nested ones too. False for an unknown type, too deep nesting, or too many numbers.
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
        if (layout.places.size() >= kMaxValues) return false;
        layout.places.push_back({pads ? "" : element, offset, basic});
        offset += basic->size;
      }
    }
    return true;
  }

  void subscribe(std::string_view content) {
    const auto instance = static_cast<unsigned>(static_cast<unsigned char>(content[0]));
    const auto id = number<std::uint16_t>(content.substr(1));
    const std::string type(content.substr(3));
    unannounced_.erase(id);
    auto layout = layouts_.find(type);
    if (layout == layouts_.end()) {
      Layout made;
      if (!lay(type, "", 0, made.size, made)) {
        warnings_.push_back(name_ + ": topic " + io::shortened(type) + " has no format that can be read: left out");
        sizes_[id] = {0, kMaxSize};
        topics_.erase(id);
        return;
      }
      layout = layouts_.emplace(type, std::move(made)).first;
    }
    const std::string channel = type + "[" + std::to_string(instance) + "]";
    topics_.insert_or_assign(id, Topic{channel, &layout->second, channels_.wants(channel), NotMeasured(type)});
    sizes_[id] = {2 + layout->second.least_size(), 2 + layout->second.size};
    channels_.add(channel);
  }

  void data(std::string_view content) {
    if (content.size() < 2) return void(++bad_);
    const auto id = number<std::uint16_t>(content);
    // The announcement may be lost: messages with this number and size belong to one topic.
    if (sizes_.try_emplace(id, content.size(), content.size()).second) unannounced_.insert(id);
    if (unannounced_.contains(id)) return void(++orphans_);
    const auto topic = topics_.find(id);
    if (topic == topics_.end() || !topic->second.wanted) return;
    content.remove_prefix(2);
    row_.clear();
    std::int64_t timestamp_ns = kNoTime, sample_ns = kNoTime;
    for (const Place& place : topic->second.layout->places) {
      if (place.name.empty()) continue;  // padding at the end is not written
      if (place.offset + place.basic->size > content.size()) return void(++bad_);
      const char* const at = content.data() + place.offset;
      row_.push_back({place.name, place.basic->read(at)});
      if (place.basic->size != 8) continue;
      const auto t_us = number<std::uint64_t>({at, 8});
      if (t_us > std::uint64_t{1} << 52) continue;  // implausible as a time
      if (place.name == "timestamp") timestamp_ns = static_cast<std::int64_t>(t_us) * kMicrosecond_ns;
      if (place.name == "timestamp_sample" && t_us > 0) sample_ns = static_cast<std::int64_t>(t_us) * kMicrosecond_ns;
    }
    topic->second.not_measured.mark(row_);
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
  /// Least and largest size of the data messages of each topic, including the topic's number.
  std::map<std::uint16_t, std::pair<std::size_t, std::size_t>> sizes_;
  std::set<std::uint16_t> unannounced_;
  std::size_t bad_ = 0, unknown_ = 0, orphans_ = 0, lost_ms_ = 0, skips_ = 0, skipped_ = 0, first_skip_ = 0;
  std::optional<std::size_t> cut_at_;
};

}  // namespace

bool is_ulog(std::string_view bytes) { return bytes.starts_with(kMagic); }

void read_ulog(std::string_view bytes, const std::string& name, Channels& channels,
               std::vector<std::string>& warnings) {
  if (!is_ulog(bytes)) throw io::InputError(name + ": is no ULog; accepted: a file that begins as one");
  UlogReader(bytes, name, channels, warnings).read();
}

}  // namespace flappy::flightlog
