#include "flightlog/import/usdlog.hpp"

#include <zlib.h>

#include <algorithm>
#include <array>
#include <map>

#include "flightlog/import/bytes.hpp"
#include "io/files.hpp"
#include "io/text.hpp"

namespace flappy::flightlog {
namespace {

constexpr char kUsdlogMagic = '\xBC';
constexpr std::size_t kChecksum = 4;
constexpr std::uint16_t kMilliseconds = 1, kMicroseconds = 2;  // versions, by the unit of their times

struct Type {
  char code;
  std::size_t size;
  double (*read)(const char*);
};

constexpr std::array<Type, 15> kVariableTypes = {{{'c', 1, read_as<std::uint8_t>},
                                                  {'b', 1, read_as<std::int8_t>},
                                                  {'B', 1, read_as<std::uint8_t>},
                                                  {'?', 1, read_as<std::uint8_t>},
                                                  {'h', 2, read_as<std::int16_t>},
                                                  {'H', 2, read_as<std::uint16_t>},
                                                  {'i', 4, read_as<std::int32_t>},
                                                  {'I', 4, read_as<std::uint32_t>},
                                                  {'l', 4, read_as<std::int32_t>},
                                                  {'L', 4, read_as<std::uint32_t>},
                                                  {'q', 8, read_as<std::int64_t>},
                                                  {'Q', 8, read_as<std::uint64_t>},
                                                  {'e', 2, read_half},
                                                  {'f', 4, read_as<float>},
                                                  {'d', 8, read_as<double>}}};

struct Variable {
  std::string name;
  const Type* type;
};

struct Event {
  std::string name;
  std::vector<Variable> variables;
  std::size_t size = 0;
};

class UsdlogReader {
 public:
  UsdlogReader(std::string_view bytes, const std::string& name, Channels& channels, std::vector<std::string>& warnings)
      : bytes_(bytes), name_(name), channels_(channels), warnings_(warnings) {}

  void read() {
    at_ = 1;
    version_ = number<std::uint16_t>();
    if (version_ != kMilliseconds && version_ != kMicroseconds)
      fail("is a usdlog of version " + std::to_string(version_), "versions 1 and 2");
    for (auto kinds = number<std::uint16_t>(); kinds > 0; --kinds) read_kind();
    const bool whole = bytes_.size() >= at_ + kChecksum && checksum() == stored_checksum();
    const std::size_t end = whole ? bytes_.size() - kChecksum : bytes_.size();
    while (read_event(end)) continue;
    warn(whole, end);
  }

 private:
  [[noreturn]] void fail(const std::string& what, const std::string& accepted) const {
    throw io::InputError(name_ + ": " + what + "; accepted: " + accepted);
  }

  template <class T>
  T number() {
    if (bytes_.size() - at_ < sizeof(T)) fail("ends within its head", "a whole log of the microSD card");
    at_ += sizeof(T);
    return number_at<T>(bytes_.data() + at_ - sizeof(T));
  }

  std::string text() {
    const std::size_t end = bytes_.find('\0', at_);
    if (end == std::string_view::npos) fail("ends within its head", "a whole log of the microSD card");
    const std::string_view found = bytes_.substr(at_, end - at_);
    if (found.empty() || !std::ranges::all_of(found, [](char c) { return c >= 0x20 && c < 0x7f; }))
      fail("has a damaged head: a name at byte " + std::to_string(at_) + " is no text", "a log of the microSD card");
    at_ = end + 1;
    return std::string(found);
  }

  void read_kind() {
    const auto id = number<std::uint16_t>();
    Event event{text(), {}, 0};
    std::vector<std::string> fields;
    for (auto count = number<std::uint16_t>(); count > 0; --count) {
      const std::string given = text();
      const std::size_t open = given.size() < 4 ? 0 : given.size() - 3;
      const auto type = std::ranges::find(kVariableTypes, open > 0 ? given[open + 1] : '\0', &Type::code);
      if (open == 0 || given[open] != '(' || given.back() != ')' || type == kVariableTypes.end())
        fail("variable \"" + io::shortened(given) + "\" of event " + io::shortened(event.name) + " has no known type",
             "as in stateEstimate.x(f)");
      fields.push_back(given.substr(0, open));
      event.variables.push_back({fields.back(), &*type});
      event.size += type->size;
    }
    const auto same = [&](const auto& known) { return known.first == id || known.second.name == event.name; };
    if (std::ranges::any_of(events_, same))
      fail("describes event " + io::shortened(event.name) + " twice", "a log of the microSD card");
    events_.emplace(id, event);
    channels_.add(event.name, fields);
  }

  /// False at the end, and where what follows is no whole event of a known kind.
  bool read_event(std::size_t end) {
    const std::size_t time_size = version_ == kMilliseconds ? 4 : 8, head = 2 + time_size;
    if (end - at_ < head) return false;
    const auto known = events_.find(number_at<std::uint16_t>(bytes_.data() + at_));
    if (known == events_.end() || end - at_ < head + known->second.size) return false;
    const char* from = bytes_.data() + at_ + 2;
    const double t_ns =
        version_ == kMilliseconds ? 1e6 * read_as<std::uint32_t>(from) : 1e3 * read_as<std::uint64_t>(from);
    const std::int64_t time = t_ns < kLatest_ns ? static_cast<std::int64_t>(t_ns) : kNoTime;
    row_.clear();
    from += time_size;
    for (const Variable& v : known->second.variables) {
      row_.push_back({v.name, v.type->read(from)});
      from += v.type->size;
    }
    channels_.add(known->second.name, time, time, row_);
    at_ += head + known->second.size;
    return true;
  }

  void warn(bool whole, std::size_t end) const {
    const auto say = [&](const std::string& what) { warnings_.push_back(name_ + ": " + what); };
    const std::size_t left = end - at_;
    if (!whole && left == kChecksum) return say("has a wrong checksum: some of its numbers may be damaged");
    if (left == 0 && whole) return;
    const bool cut = left < 2 || events_.contains(number_at<std::uint16_t>(bytes_.data() + at_));
    say((cut ? std::string("ends within an event") : "has an event of no known kind") + ", at byte " +
        std::to_string(at_) + (whole ? "" : ", without a sound checksum") + ": read as far as it goes");
  }

  std::uint32_t checksum() const {
    uLong sum = crc32(0, nullptr, 0);
    const auto* from = reinterpret_cast<const Bytef*>(bytes_.data());
    for (std::size_t left = bytes_.size() - kChecksum; left > 0;) {
      const auto some = static_cast<uInt>(std::min<std::size_t>(left, 1 << 30));
      sum = crc32(sum, from, some);
      from += some, left -= some;
    }
    return static_cast<std::uint32_t>(sum);
  }
  std::uint32_t stored_checksum() const { return number_at<std::uint32_t>(bytes_.data() + bytes_.size() - kChecksum); }

  std::string_view bytes_;
  const std::string& name_;
  Channels& channels_;
  std::vector<std::string>& warnings_;
  std::size_t at_ = 0;
  std::uint16_t version_ = 0;
  std::map<std::uint16_t, Event> events_;
  Row row_;
};

}  // namespace

// The third byte is the upper one of the version, which is small; text in UTF-8 never begins with the first.
bool is_usdlog(std::string_view bytes) { return bytes.size() > 4 && bytes[0] == kUsdlogMagic && bytes[2] == '\0'; }

void read_usdlog(std::string_view bytes, const std::string& name, Channels& channels,
                 std::vector<std::string>& warnings) {
  UsdlogReader(bytes, name, channels, warnings).read();
}

}  // namespace flappy::flightlog
