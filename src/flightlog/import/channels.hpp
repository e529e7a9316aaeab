// A recording in any format: named channels of rows with named numbers, time of receipt and, if any, stamp.
#pragma once

#include <array>
#include <bit>
#include <cstdint>
#include <limits>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

namespace flappy::flightlog {

/// Largest absolute value of a time, in ns from 1970, so that the difference of two times fits 64 bits.
inline constexpr double kLatest_ns = 4e18;

/// Marks a row without a time. All other times are nanoseconds of some clock.
inline constexpr std::int64_t kNoTime = std::numeric_limits<std::int64_t>::min();

/// What a message holds in place of a number that it says is not measured: a NaN with bits of its own.
inline constexpr double kNotMeasured = std::bit_cast<double>(std::uint64_t{0x7ff8'0000'0000'f1a9});
inline bool is_not_measured(double value) {
  return std::bit_cast<std::uint64_t>(value) == std::bit_cast<std::uint64_t>(kNotMeasured);
}

struct Item {
  std::string name;
  double value;
};
using Row = std::vector<Item>;

/// Stands for the name of the channel in a recording that has only one.
inline const std::string kOnlyChannel = "*";

/// A field of a coordinate of a point or marker, m, is the point's name and one of these.
inline constexpr std::array kPointAxes = {".x_m", ".y_m", ".z_m"};

/// Field of the number of a table's row, from 0: rows that are left out count. Only where it is wanted.
inline const std::string kFrame = "#frame";

/// The wanted fields of each channel; an empty set: all its fields.
using Wanted = std::map<std::string, std::set<std::string>>;

/// Head of an export of a motion-capture system.
struct Capture {
  std::string program;
  bool says_up;  ///< whether z is up in it unless its user chose otherwise
  std::vector<std::string> bodies, markers;
};

class Channel {
 public:
  /// Keeps the `wanted` fields; none given: all fields.
  explicit Channel(std::set<std::string> wanted = {}) : wanted_(std::move(wanted)) {}

  void add(std::int64_t received_ns, std::int64_t stamp_ns, const Row& row);
  /// Registers a field even if no row ever has it.
  void add(const std::string& field) { slot(field); }
  const std::vector<std::int64_t>& received_ns() const { return received_ns_; }
  const std::vector<std::int64_t>& stamp_ns() const { return stamp_ns_; }
  /// One value for each row, NaN where the row lacks it; null where the field is unknown or not wanted.
  const std::vector<double>* column(std::string_view field) const;
  /// Unit of a field by the recording; empty: it names none.
  std::string unit(std::string_view field) const;
  void add_unit(const std::string& field, const std::string& unit) { units_[field] = unit; }
  /// Null where the channel is of no motion-capture system.
  const Capture* capture() const { return capture_ ? &*capture_ : nullptr; }
  void describe(Capture capture) { capture_ = std::move(capture); }
  /// Names of all fields, wanted or not.
  std::vector<std::string> fields() const;

 private:
  static constexpr std::size_t kUnwanted = std::numeric_limits<std::size_t>::max();
  std::size_t slot(const std::string& field);

  std::set<std::string> wanted_;
  std::vector<std::int64_t> received_ns_, stamp_ns_;
  std::map<std::string, std::size_t, std::less<>> slots_;
  std::map<std::string, std::string, std::less<>> units_;
  std::optional<Capture> capture_;
  std::vector<std::vector<double>> columns_;
  std::vector<std::pair<std::string, std::size_t>> order_;  ///< fields and slots of the last row; the next is alike
};

class Channels {
 public:
  /// Keeps only wanted channels and fields; nothing given: all. `times` are those of them that are times.
  explicit Channels(Wanted wanted = {}, Wanted times = {}) : wanted_(std::move(wanted)), times_(std::move(times)) {}

  bool wants(const std::string& channel) const { return wanted_.empty() || wanted(channel) != nullptr; }
  bool wants(const std::string& channel, const std::string& field) const;
  /// The wanted fields of a channel: null where it is not wanted, empty where all are.
  const std::set<std::string>* wanted(const std::string& channel) const { return of_channel(wanted_, channel); }
  bool wants_time(const std::string& channel, const std::string& field) const;
  /// Says the unit of a field of a channel that is known already; empty: not said.
  void add_unit(const std::string& channel, const std::string& field, const std::string& unit);
  /// Registers a channel and its fields even if no row of it ever comes. Empty field names are ignored.
  void add(const std::string& channel, const std::vector<std::string>& fields = {});
  void add(const std::string& channel, std::int64_t received_ns, std::int64_t stamp_ns, const Row& row);
  /// Describes a channel that is known already.
  void describe(const std::string& channel, Capture capture) { channels_.at(channel).describe(std::move(capture)); }
  /// The channel `name`, else `name`[0]; kOnlyChannel finds a recording's only channel. Null where there is none.
  const Channel* find(const std::string& name) const;
  std::vector<std::string> names() const;

 private:
  static const std::set<std::string>* of_channel(const Wanted& wanted, const std::string& channel);

  Wanted wanted_, times_;
  std::map<std::string, Channel> channels_;
};

}  // namespace flappy::flightlog
