#include "flightlog/import/dataflash.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <optional>
#include <set>

#include "flightlog/import/bytes.hpp"
#include "io/files.hpp"
#include "io/text.hpp"

namespace flappy::flightlog {
namespace {

constexpr std::string_view kDataflashMark = "\xA3\x95";
constexpr std::size_t kDataflashHead = 3;
constexpr std::uint8_t kFmt = 128;
constexpr std::size_t kFmtSize = 89;
constexpr std::size_t kArrayNumbers = 32;  // numbers of letter 'a'

struct Letter {
  char letter;
  std::size_t size;
  double (*read)(const char*);  ///< null: a text
  double per_unit = 1;          ///< divides, which rounds better than a factor
};

constexpr std::array<Letter, 22> kLetters = {{{'a', 2 * kArrayNumbers, read_as<std::int16_t>},
                                              {'b', 1, read_as<std::int8_t>},
                                              {'B', 1, read_as<std::uint8_t>},
                                              {'M', 1, read_as<std::uint8_t>},
                                              {'g', 2, read_half},
                                              {'h', 2, read_as<std::int16_t>},
                                              {'H', 2, read_as<std::uint16_t>},
                                              {'i', 4, read_as<std::int32_t>},
                                              {'I', 4, read_as<std::uint32_t>},
                                              {'q', 8, read_as<std::int64_t>},
                                              {'Q', 8, read_as<std::uint64_t>},
                                              {'f', 4, read_as<float>},
                                              {'d', 8, read_as<double>},
                                              {'c', 2, read_as<std::int16_t>, 1e2},
                                              {'C', 2, read_as<std::uint16_t>, 1e2},
                                              {'e', 4, read_as<std::int32_t>, 1e2},
                                              {'E', 4, read_as<std::uint32_t>, 1e2},
                                              {'L', 4, read_as<std::int32_t>, 1e7},
                                              {'n', 4, nullptr},
                                              {'N', 16, nullptr},
                                              {'Z', 64, nullptr},
                                              {'\0', 0, nullptr}}};

const Letter* letter_of(char letter) {
  const auto found = std::ranges::find(kLetters, letter, &Letter::letter);
  return letter == '\0' || found == kLetters.end() ? nullptr : &*found;
}

std::vector<std::string_view> parts_of(std::string_view text) {
  std::vector<std::string_view> parts;
  while (true) {
    const std::size_t end = std::min(text.find(','), text.size());
    std::string_view part = text.substr(0, end);
    while (!part.empty() && part.front() == ' ') part.remove_prefix(1);
    while (!part.empty() && (part.back() == ' ' || part.back() == '\r')) part.remove_suffix(1);
    parts.push_back(part);
    if (end == text.size()) return parts;
    text.remove_prefix(end + 1);
  }
}

/// The type of a message, as its FMT describes it.
struct MessageType {
  std::string name, letters;
  std::vector<std::string> columns;
  std::size_t size = 0;                 ///< bytes of a message with its head
  std::optional<std::size_t> instance;  ///< the column that FMTU marks
  std::vector<std::string> fields;      ///< those of numbers; one of an array has its index
  Row row;

  bool sound() const { return columns.size() == letters.size() && !columns.empty(); }
};

using MessageTypes = std::map<int, MessageType>;

/// What the binary and the text form share.
class DataflashReader {
 public:
  DataflashReader(std::string name, Channels& channels, std::vector<std::string>& warnings)
      : name_(std::move(name)), channels_(channels), warnings_(warnings) {}

 protected:
  void say(const std::string& what) const { warnings_.push_back(name_ + ": " + what); }

  /// False for a description that contradicts itself; `size` 0: that of a text, where it says nothing.
  bool describe(int id, std::size_t size, std::string_view name, std::string_view letters, std::string_view columns) {
    MessageType type{std::string(name), std::string(letters), {}, size, std::nullopt, {}, {}};
    for (const std::string_view column : parts_of(columns)) type.columns.emplace_back(column);
    std::size_t length = kDataflashHead;
    const auto is_word = [](char c) { return c > 0x20 && c < 0x7f; };
    bool sound = !name.empty() && std::ranges::all_of(name, is_word);
    for (std::size_t k = 0; k < letters.size(); ++k) {
      const Letter* letter = letter_of(letters[k]);
      sound = sound && letter && k < type.columns.size() && !type.columns[k].empty() &&
              std::ranges::all_of(type.columns[k], is_word);
      if (!sound) break;
      length += letter->size;
      if (!letter->read) continue;
      if (letters[k] != 'a') type.fields.push_back(type.columns[k]);
      for (std::size_t i = 0; letters[k] == 'a' && i < kArrayNumbers; ++i)
        type.fields.push_back(type.columns[k] + "[" + std::to_string(i) + "]");
    }
    if (!sound || !type.sound() || (size > 0 && length != size)) return false;
    for (const std::string& field : type.fields) type.row.push_back({field, 0});
    types_[id] = std::move(type);
    return true;
  }

  void mark_instance(int id, std::string_view units) {
    const std::size_t at = units.find('#');
    if (const auto type = types_.find(id); type != types_.end() && at < type->second.columns.size())
      type->second.instance = at;
  }

  /// Whether a type describes others, and is no channel.
  static bool describes(const MessageType& type) {
    constexpr std::array<std::string_view, 4> kNames = {"FMT", "FMTU", "UNIT", "MULT"};
    return std::ranges::find(kNames, type.name) != kNames.end();
  }

  /// Adds the row of a message, whose times are among its numbers.
  void add(MessageType& type) {
    std::string channel = type.name;
    std::int64_t t_ns = kNoTime;
    for (const Item& item : type.row) {
      if (type.instance && item.name == type.columns[*type.instance] && std::isfinite(item.value))
        channel += "[" + io::shortest_digits(item.value) + "]";
      const double unit_ns = item.name == "TimeUS" ? 1e3 : item.name == "TimeMS" ? 1e6 : 0;
      if (unit_ns > 0 && item.value >= 0 && item.value * unit_ns < kLatest_ns)
        t_ns = std::llround(item.value * unit_ns);
    }
    if (declared_.insert(channel).second) channels_.add(channel, type.fields);
    channels_.add(channel, t_ns, t_ns, type.row);
  }

  std::string name_;
  Channels& channels_;
  std::vector<std::string>& warnings_;
  MessageTypes types_;
  std::set<std::string> declared_;
  std::set<int> contradictory_;  ///< types whose FMT is
};

class DataflashBinary : public DataflashReader {
 public:
  DataflashBinary(std::string_view bytes, const std::string& name, Channels& channels,
                  std::vector<std::string>& warnings)
      : DataflashReader(name, channels, warnings), bytes_(bytes) {
    describe(kFmt, kFmtSize, "FMT", "BBnNZ", "Type,Length,Name,Format,Columns");
  }

  void read() {
    // descriptions first: FMTU may come after messages that it is about
    walk([&](const MessageType& type, std::size_t at) {
      if (type.name == "FMT") learn(at);
    });
    walk([&](const MessageType& type, std::size_t at) {
      const auto id = number_of(type, at, "FmtType");
      if (type.name == "FMTU" && id) mark_instance(static_cast<int>(*id), text_of(type, at, "UnitIds"));
    });
    skips_ = skipped_ = 0;
    cut_at_.reset();
    walk([&](MessageType& type, std::size_t at) { take(type, at); });
    if (!contradictory_.empty())
      say("describes " + std::to_string(contradictory_.size()) + " types of messages in a damaged way: left out");
    if (skips_ > 0)
      say("is damaged: " + std::to_string(skipped_) + " bytes skipped in " + std::to_string(skips_) +
          (skips_ > 1 ? " places, the first" : " place,") + " at byte " + std::to_string(first_skip_));
    if (cut_at_) say("ends within a message, at byte " + std::to_string(*cut_at_) + ": read as far as it goes");
  }

 private:
  /// The type of the message at `at`, if one that is known begins there; it may reach beyond the end.
  MessageType* begins(std::size_t at) {
    if (bytes_.size() - at < kDataflashHead || !bytes_.substr(at).starts_with(kDataflashMark)) return nullptr;
    const auto found = types_.find(static_cast<unsigned char>(bytes_[at + 2]));
    return found == types_.end() ? nullptr : &found->second;
  }

  bool marked(std::size_t at) const {
    return at == bytes_.size() || bytes_.substr(at).starts_with(kDataflashMark.substr(0, bytes_.size() - at));
  }

  /// Calls `found` for each message. One that no other follows is believed unless another begins within it, as where
  /// bytes were lost.
  void walk(const std::function<void(MessageType&, std::size_t)>& found) {
    for (std::size_t at = 0; at < bytes_.size();) {
      MessageType* type = begins(at);
      if (type && bytes_.size() - at < type->size) {
        const std::size_t next = next_sound(at + 1, bytes_.size());
        if (next == bytes_.size()) {
          cut_at_ = at;
          return;
        }
        skip(at, next);
        at = next;
        continue;
      }
      const std::size_t end = type ? at + type->size : 0;
      if (type && (marked(end) || next_sound(at + 1, end) == end)) {
        found(*type, at);
        at = end;
        continue;
      }
      const std::size_t next = next_sound(at + 1, bytes_.size());
      skip(at, next);
      at = next;
    }
  }

  std::size_t next_sound(std::size_t from, std::size_t end) {
    for (std::size_t at = bytes_.find(kDataflashMark, from); at < end; at = bytes_.find(kDataflashMark, at + 1))
      if (const MessageType* type = begins(at); type && bytes_.size() - at >= type->size && marked(at + type->size))
        return at;
    return end;
  }

  void skip(std::size_t from, std::size_t to) {
    if (skips_++ == 0) first_skip_ = from;
    skipped_ += to - from;
  }

  /// Offset of a column and its letter.
  std::optional<std::pair<std::size_t, const Letter*>> place_of(const MessageType& type,
                                                                std::string_view column) const {
    std::size_t offset = kDataflashHead;
    for (std::size_t k = 0; k < type.columns.size(); ++k) {
      const Letter* letter = letter_of(type.letters[k]);
      if (type.columns[k] == column) return std::pair(offset, letter);
      offset += letter->size;
    }
    return std::nullopt;
  }
  std::optional<double> number_of(const MessageType& type, std::size_t at, std::string_view column) const {
    const auto place = place_of(type, column);
    if (!place || !place->second->read) return std::nullopt;
    return place->second->read(bytes_.data() + at + place->first);
  }
  std::string_view text_of(const MessageType& type, std::size_t at, std::string_view column) const {
    const auto place = place_of(type, column);
    if (!place || place->second->read) return "";
    const std::string_view text = bytes_.substr(at + place->first, place->second->size);
    return text.substr(0, text.find('\0'));
  }

  void learn(std::size_t at) {
    const MessageType fmt = types_.at(kFmt);
    const int id = static_cast<int>(*number_of(fmt, at, "Type"));
    const auto size = static_cast<std::size_t>(*number_of(fmt, at, "Length"));
    if (id == kFmt) return;  // of itself
    if (!describe(id, size, text_of(fmt, at, "Name"), text_of(fmt, at, "Format"), text_of(fmt, at, "Columns")))
      contradictory_.insert(id);
    else contradictory_.erase(id);
  }

  void take(MessageType& type, std::size_t at) {
    if (describes(type)) return;
    if (type.row.empty() || !channels_.wants(type.name)) {
      if (!type.instance) {
        if (declared_.insert(type.name).second) channels_.add(type.name, type.fields);
        return;
      }
    }
    std::size_t field = 0;
    const char* from = bytes_.data() + at + kDataflashHead;
    for (const char code : type.letters) {
      const Letter& letter = *letter_of(code);
      const std::size_t numbers = code == 'a' ? kArrayNumbers : 1;
      for (std::size_t i = 0; letter.read && i < numbers; ++i)
        type.row[field++].value = letter.read(from + i * letter.size / numbers) / letter.per_unit;
      from += letter.size;
    }
    add(type);
  }

  std::string_view bytes_;
  std::size_t skips_ = 0, skipped_ = 0, first_skip_ = 0;
  std::optional<std::size_t> cut_at_;
};

class DataflashText : public DataflashReader {
 public:
  using DataflashReader::DataflashReader;

  void read(std::string_view text) {
    each_line(text, [&](const std::vector<std::string_view>& cells) {
      if (cells[0] == "FMT" && cells.size() >= 6) learn(cells);
    });
    each_line(text, [&](const std::vector<std::string_view>& cells) {
      if (cells[0] == "FMTU" && cells.size() >= 4) mark_instance(static_cast<int>(number(cells[2])), cells[3]);
    });
    each_line(text, [&](const std::vector<std::string_view>& cells) { take(cells); });
    if (!contradictory_.empty())
      say("describes " + std::to_string(contradictory_.size()) + " types of messages in a damaged way: left out");
    if (bad_ > 0)
      say(std::to_string(bad_) + " lines left out, the first of them line " + std::to_string(first_bad_) +
          ", which is of no type with as many cells");
  }

 private:
  void each_line(std::string_view text, const std::function<void(const std::vector<std::string_view>&)>& found) {
    line_ = 0;
    while (!text.empty()) {
      ++line_;
      const std::size_t end = std::min(text.find('\n'), text.size());
      const std::vector<std::string_view> cells = parts_of(text.substr(0, end));
      text.remove_prefix(std::min(end + 1, text.size()));
      if (cells.size() > 1 || !cells[0].empty()) found(cells);
    }
  }

  static double number(std::string_view cell) {
    double value = 0;
    const auto [end, error] = std::from_chars(cell.data(), cell.data() + cell.size(), value);
    return error == std::errc() && end == cell.data() + cell.size() ? value : std::numeric_limits<double>::quiet_NaN();
  }

  void learn(const std::vector<std::string_view>& cells) {
    const double id = number(cells[1]);
    const std::string_view columns(
        cells[5].data(), static_cast<std::size_t>(cells.back().data() + cells.back().size() - cells[5].data()));
    if (id == kFmt) return;
    const bool sound = id >= 0 && id < 256 && describe(static_cast<int>(id), 0, cells[3], cells[4], columns);
    if (sound) by_name_[std::string(cells[3])] = static_cast<int>(id);
    else contradictory_.insert(std::isfinite(id) ? static_cast<int>(std::clamp(id, -1.0, 256.0)) : -1);
  }

  void take(const std::vector<std::string_view>& cells) {
    if (cells[0] == "FMT") return;
    const auto known = by_name_.find(std::string(cells[0]));
    if (known == by_name_.end()) return bad();
    MessageType& type = types_.at(known->second);
    if (describes(type)) return;
    // a text may hold commas: it is the last column where it does
    const bool ends_in_text = !letter_of(type.letters.back())->read;
    if (cells.size() != type.columns.size() + 1 && !(ends_in_text && cells.size() > type.columns.size() + 1))
      return bad();
    if (type.letters.find('a') != std::string::npos) return;
    std::size_t field = 0;
    for (std::size_t k = 0; k < type.columns.size(); ++k)
      if (letter_of(type.letters[k])->read) type.row[field++].value = number(cells[k + 1]);
    add(type);
  }

  void bad() {
    if (bad_++ == 0) first_bad_ = line_;
  }

  std::map<std::string, int, std::less<>> by_name_;
  std::size_t line_ = 0, bad_ = 0, first_bad_ = 0;
};

}  // namespace

bool is_dataflash(std::string_view bytes) { return bytes.starts_with("\xA3\x95\x80"); }

bool is_dataflash_text(std::string_view bytes) {
  constexpr std::size_t kLooked = 4096;  // above its formats a log may say which firmware and board wrote it
  const std::string_view head = bytes.substr(0, kLooked);
  for (const std::string_view first : {"FMT, 128, 89", "FMT,128,89"})
    if (const std::size_t at = head.find(first); at == 0 || (at != std::string_view::npos && head[at - 1] == '\n'))
      return true;
  return false;
}

void read_dataflash(std::string_view bytes, const std::string& name, Channels& channels,
                    std::vector<std::string>& warnings) {
  DataflashBinary(bytes, name, channels, warnings).read();
}

void read_dataflash_text(std::string_view text, const std::string& name, Channels& channels,
                         std::vector<std::string>& warnings) {
  DataflashText(name, channels, warnings).read(text);
}

}  // namespace flappy::flightlog
