#include "flightlog/ros/cdr.hpp"

#include <algorithm>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstring>
#include <limits>

namespace flappy::flightlog::ros {
namespace {

static_assert(std::endian::native == std::endian::little);

std::size_t size_of(Kind kind) {
  switch (kind) {
    case Kind::int16:
    case Kind::uint16:
      return 2;
    case Kind::int32:
    case Kind::uint32:
    case Kind::float32:
      return 4;
    case Kind::int64:
    case Kind::uint64:
    case Kind::float64:
      return 8;
    default:
      return 1;
  }
}

class Lengthened {
 public:
  Lengthened(std::string& path, std::string_view name) : path_(path), size_(path.size()) {
    if (!path.empty()) path += '.';
    path += name;
  }
  Lengthened(std::string& path, std::size_t index) : path_(path), size_(path.size()) {
    char digits[24];
    path += '[';
    path.append(digits, std::to_chars(digits, digits + sizeof digits, index).ptr);
    path += ']';
  }
  ~Lengthened() { path_.resize(size_); }
  Lengthened(const Lengthened&) = delete;
  Lengthened& operator=(const Lengthened&) = delete;

 private:
  std::string& path_;
  std::size_t size_;
};

class Reader {
 public:
  Reader(std::string_view bytes, const Visitor& visit) : visit_(visit) {
    constexpr std::size_t kHead = 4;
    // The second byte is the representation: 0 is plain CDR in big endian, 1 in little endian.
    if (bytes.size() < kHead || bytes[0] != 0 || (bytes[1] != 0 && bytes[1] != 1))
      throw MessageError("begins with no header of plain CDR, as where messages are compressed one by one");
    swap_ = bytes[1] == 0;
    bytes_ = bytes.substr(kHead);
  }

  void message(const Layout& layout) {
    if (layout.fields.empty()) take(1);  // an empty struct is one byte on the wire
    for (const LayoutField& field : layout.fields) {
      const Lengthened longer(path_, field.name);
      if (field.many == Many::one) one(field);
      else several(field);
    }
  }

 private:
  std::string_view take(std::size_t size) {
    if (size > bytes_.size() - at_) throw MessageError(path_ + ": the message ends before it");
    const std::string_view taken = bytes_.substr(at_, size);
    at_ += size;
    return taken;
  }

  template <class T>
  T number() {
    const std::size_t over = at_ % sizeof(T);
    if (over != 0) take(sizeof(T) - over);
    char raw[sizeof(T)];
    std::memcpy(raw, take(sizeof(T)).data(), sizeof(T));
    if (swap_) std::reverse(raw, raw + sizeof(T));
    return std::bit_cast<T>(raw);
  }

  std::string_view string(const LayoutField& field) {
    const auto size = number<std::uint32_t>();
    if (size == 0) return {};  // some senders omit the zero of an empty string
    const std::string_view text = take(size);
    if (text.back() != 0) throw MessageError(path_ + ": is a string without an end");
    if (field.string_capacity > 0 && size - 1 > field.string_capacity)
      throw MessageError(path_ + ": is longer than " + std::to_string(field.string_capacity));
    return text.substr(0, size - 1);
  }

  Scalar scalar(const LayoutField& field) {
    switch (field.kind) {
      case Kind::int8:
        return std::int64_t{number<std::int8_t>()};
      case Kind::int16:
        return std::int64_t{number<std::int16_t>()};
      case Kind::int32:
        return std::int64_t{number<std::int32_t>()};
      case Kind::int64:
        return number<std::int64_t>();
      case Kind::uint16:
        return std::uint64_t{number<std::uint16_t>()};
      case Kind::uint32:
        return std::uint64_t{number<std::uint32_t>()};
      case Kind::uint64:
        return number<std::uint64_t>();
      case Kind::float32:
        return double{number<float>()};
      case Kind::float64:
        return number<double>();
      case Kind::string:
        return string(field);
      default:
        return std::uint64_t{number<std::uint8_t>()};
    }
  }

  void one(const LayoutField& field) {
    if (field.message) message(*field.message);
    else visit_(path_, scalar(field));
  }

  void several(const LayoutField& field) {
    const std::size_t count = field.many == Many::array ? field.capacity : number<std::uint32_t>();
    if (field.many == Many::bounded && count > field.capacity)
      throw MessageError(path_ + ": has " + std::to_string(count) + " elements, at most " +
                         std::to_string(field.capacity) + " are declared");
    if (count > bytes_.size() - at_) throw MessageError(path_ + ": the message ends before it");
    for (std::size_t i = 0; i < count; ++i) {
      if (i == kMaxElements && !field.message && field.kind != Kind::string) {
        take((count - i) * size_of(field.kind));
        return;
      }
      if (i >= kMaxElements && !field.message) {
        string(field);
        continue;
      }
      const Lengthened longer(path_, i);
      one(field);
    }
  }

  std::string_view bytes_;
  const Visitor& visit_;
  std::string path_;
  std::size_t at_ = 0;
  bool swap_ = false;
};

class Writer {
 public:
  explicit Writer(const Members& members) : members_(members) {}

  void message(const Layout& layout) {
    if (layout.fields.empty()) number<std::uint8_t>(0);
    for (const LayoutField& field : layout.fields) {
      const Lengthened longer(path_, field.name);
      if (field.many == Many::one) one(field);
      else several(field);
    }
  }

  std::string bytes() && { return std::string("\0\1\0\0", 4) + std::move(bytes_); }

 private:
  template <class T>
  void number(T value) {
    bytes_.resize((bytes_.size() + sizeof(T) - 1) / sizeof(T) * sizeof(T));
    char raw[sizeof(T)];
    std::memcpy(raw, &value, sizeof(T));
    bytes_.append(raw, sizeof(T));
  }

  template <class T>
  void given_number() {
    const auto found = members_.find(path_);
    if (found == members_.end()) return number(T{});
    std::visit(
        [&](const auto& value) {
          if constexpr (std::is_arithmetic_v<std::decay_t<decltype(value)>>) number(static_cast<T>(value));
          else throw MessageError(path_ + ": is text where a number belongs");
        },
        found->second);
  }

  void given_string(const LayoutField& field) {
    const auto found = members_.find(path_);
    const std::string none, *text = &none;
    if (found != members_.end()) text = std::get_if<std::string>(&found->second);
    if (!text) throw MessageError(path_ + ": is a number where text belongs");
    if (field.string_capacity > 0 && text->size() > field.string_capacity)
      throw MessageError(path_ + ": is longer than " + std::to_string(field.string_capacity));
    number(static_cast<std::uint32_t>(text->size() + 1));
    bytes_.append(*text);
    bytes_ += '\0';
  }

  void one(const LayoutField& field) {
    switch (field.kind) {
      case Kind::message:
        return message(*field.message);
      case Kind::int8:
        return given_number<std::int8_t>();
      case Kind::int16:
        return given_number<std::int16_t>();
      case Kind::uint16:
        return given_number<std::uint16_t>();
      case Kind::int32:
        return given_number<std::int32_t>();
      case Kind::uint32:
        return given_number<std::uint32_t>();
      case Kind::int64:
        return given_number<std::int64_t>();
      case Kind::uint64:
        return given_number<std::uint64_t>();
      case Kind::float32:
        return given_number<float>();
      case Kind::float64:
        return given_number<double>();
      case Kind::string:
        return given_string(field);
      default:
        return given_number<std::uint8_t>();
    }
  }

  /// Whether `members_` has element `i` of the sequence at the path, or a member of that element.
  bool has_element(std::size_t i) {
    const Lengthened longer(path_, i);
    const auto found = members_.lower_bound(path_);
    return found != members_.end() && found->first.starts_with(path_);
  }

  void several(const LayoutField& field) {
    std::size_t count = field.capacity;
    if (field.many != Many::array) {
      count = 0;
      while (has_element(count)) ++count;
      if (field.many == Many::bounded && count > field.capacity)
        throw MessageError(path_ + ": has " + std::to_string(count) + " elements, at most " +
                           std::to_string(field.capacity) + " are declared");
      number(static_cast<std::uint32_t>(count));
    }
    for (std::size_t i = 0; i < count; ++i) {
      const Lengthened longer(path_, i);
      one(field);
    }
  }

  const Members& members_;
  std::string path_, bytes_;
};

}  // namespace

double to_number(const Scalar& scalar) {
  return std::visit(
      [](const auto& value) {
        if constexpr (std::is_arithmetic_v<std::decay_t<decltype(value)>>) return static_cast<double>(value);
        else return std::numeric_limits<double>::quiet_NaN();
      },
      scalar);
}

void decode(const Layout& layout, std::string_view bytes, const Visitor& visit) {
  Reader(bytes, visit).message(layout);
}

Members decode(const Layout& layout, std::string_view bytes) {
  Members members;
  decode(layout, bytes, [&](std::string_view path, const Scalar& value) {
    std::visit(
        [&](const auto& v) {
          if constexpr (std::is_same_v<std::decay_t<decltype(v)>, std::string_view>)
            members.emplace(path, std::string(v));
          else members.emplace(path, v);
        },
        value);
  });
  return members;
}

std::string encode(const Layout& layout, const Members& members) {
  Writer writer(members);
  writer.message(layout);
  return std::move(writer).bytes();
}

}  // namespace flappy::flightlog::ros
