// What a recording holds, whatever wrote it: named channels of rows of named numbers, each with the time at which it was
// received and, where it says so itself, the time that it tells of. Importers fill it, and so may a recorder, row by row.
#pragma once

#include <cstdint>
#include <limits>
#include <map>
#include <set>
#include <string>
#include <string_view>
#include <vector>

namespace flappy::flightlog {

/// The latest time that a row may have, before 1970 or after: the differences of two fit 64 bits.
inline constexpr double kLatest_ns = 4e18;

/// Where a row has no such time. Others are nanoseconds of some clock.
inline constexpr std::int64_t kNoTime = std::numeric_limits<std::int64_t>::min();

struct Item {
  std::string name;
  double value;
};
using Row = std::vector<Item>;

/// In place of a channel's name: whichever there is, of a recording that has one.
inline const std::string kOnlyChannel = "*";

/// Fields by channel.
using Wanted = std::map<std::string, std::set<std::string>>;

class Channel {
 public:
  /// Nothing wanted: all of it.
  explicit Channel(std::set<std::string> wanted = {}) : wanted_(std::move(wanted)) {}

  void add(std::int64_t received_ns, std::int64_t stamp_ns, const Row& row);
  /// Makes a field known, though no row may have it.
  void add(const std::string& field) { slot(field); }
  const std::vector<std::int64_t>& received_ns() const { return received_ns_; }
  const std::vector<std::int64_t>& stamp_ns() const { return stamp_ns_; }
  /// One value for each row, NaN where it had none; null where there is no such field, or nobody wanted it.
  const std::vector<double>* column(std::string_view field) const;
  /// Names of all fields that rows had, wanted or not.
  std::vector<std::string> fields() const;

 private:
  static constexpr std::size_t kUnwanted = std::numeric_limits<std::size_t>::max();
  std::size_t slot(const std::string& field);

  std::set<std::string> wanted_;
  std::vector<std::int64_t> received_ns_, stamp_ns_;
  std::map<std::string, std::size_t, std::less<>> slots_;
  std::vector<std::vector<double>> columns_;
  std::vector<std::pair<std::string, std::size_t>> order_;  ///< of the row before, which the next is like
};

class Channels {
 public:
  /// Only rows of what is wanted are kept; nothing wanted: all.
  explicit Channels(Wanted wanted = {}) : wanted_(std::move(wanted)) {}

  bool wants(const std::string& channel) const { return wanted_.empty() || wanted_fields(channel) != nullptr; }
  bool wants(const std::string& channel, const std::string& field) const;
  /// Makes a channel and fields of it known, though no row of it may come. Fields without a name are none.
  void add(const std::string& channel, const std::vector<std::string>& fields = {});
  void add(const std::string& channel, std::int64_t received_ns, std::int64_t stamp_ns, const Row& row);
  /// `name`, or else `name`[0], or kOnlyChannel; null where it is not there.
  const Channel* find(const std::string& name) const;
  std::vector<std::string> names() const;

 private:
  /// Null where the channel is not wanted; empty where all of it is.
  const std::set<std::string>* wanted_fields(const std::string& channel) const;

  Wanted wanted_;
  std::map<std::string, Channel> channels_;
};

}  // namespace flappy::flightlog
