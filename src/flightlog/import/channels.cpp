#include "flightlog/import/channels.hpp"

#include <cmath>
#include <utility>

namespace flappy::flightlog {
namespace {

/// Suffix of the first instance of a PX4 topic, which is often the only one and may be left out in a mapping.
const std::string kFirst = "[0]";

std::int64_t checked(std::int64_t t_ns) { return std::abs(static_cast<double>(t_ns)) <= kLatest_ns ? t_ns : kNoTime; }

}  // namespace

void Channel::add(std::int64_t received_ns, std::int64_t stamp_ns, const Row& row) {
  received_ns_.push_back(checked(received_ns));
  stamp_ns_.push_back(checked(stamp_ns));
  for (std::size_t k = 0; k < row.size(); ++k) {
    if (k == order_.size()) order_.emplace_back(row[k].name, slot(row[k].name));
    else if (order_[k].first != row[k].name) order_[k] = {row[k].name, slot(row[k].name)};
    if (const std::size_t at = order_[k].second; at != kUnwanted) {
      columns_[at].resize(received_ns_.size() - 1, std::numeric_limits<double>::quiet_NaN());
      columns_[at].push_back(row[k].value);
    }
  }
  for (auto& column : columns_) column.resize(received_ns_.size(), std::numeric_limits<double>::quiet_NaN());
}

std::size_t Channel::slot(const std::string& field) {
  const auto [found, fresh] = slots_.try_emplace(field, kUnwanted);
  if (fresh && (wanted_.empty() || wanted_.contains(field))) {
    found->second = columns_.size();
    columns_.emplace_back();
  }
  return found->second;
}

const std::vector<double>* Channel::column(std::string_view field) const {
  const auto found = slots_.find(field);
  return found == slots_.end() || found->second == kUnwanted ? nullptr : &columns_[found->second];
}

std::vector<std::string> Channel::fields() const {
  std::vector<std::string> list;
  for (const auto& [name, slot] : slots_) list.push_back(name);
  return list;
}

std::string Channel::unit(std::string_view field) const {
  const auto found = units_.find(field);
  return found == units_.end() ? "" : found->second;
}

const std::set<std::string>* Channels::of_channel(const Wanted& wanted, const std::string& channel) {
  auto found = wanted.find(channel);
  if (found == wanted.end() && channel.ends_with(kFirst))
    found = wanted.find(channel.substr(0, channel.size() - kFirst.size()));
  if (found == wanted.end()) found = wanted.find(kOnlyChannel);
  return found == wanted.end() ? nullptr : &found->second;
}

bool Channels::wants_time(const std::string& channel, const std::string& field) const {
  const auto* fields = of_channel(times_, channel);
  return fields && fields->contains(field);
}

void Channels::add_unit(const std::string& channel, const std::string& field, const std::string& unit) {
  if (!unit.empty()) channels_.at(channel).add_unit(field, unit);
}

bool Channels::wants(const std::string& channel, const std::string& field) const {
  const auto* fields = wanted(channel);
  return wanted_.empty() || (fields && (fields->empty() || fields->contains(field)));
}

void Channels::add(const std::string& channel, const std::vector<std::string>& fields) {
  auto found = channels_.find(channel);
  if (found == channels_.end()) {
    const auto* kept = wanted(channel);
    found = channels_.emplace(channel, Channel(kept ? *kept : std::set<std::string>())).first;
  }
  for (const std::string& field : fields)
    if (!field.empty()) found->second.add(field);
}

void Channels::add(const std::string& channel, std::int64_t received_ns, std::int64_t stamp_ns, const Row& row) {
  if (!wants(channel)) return;
  auto found = channels_.find(channel);
  if (found == channels_.end()) {
    add(channel);
    found = channels_.find(channel);
  }
  found->second.add(received_ns, stamp_ns, row);
}

const Channel* Channels::find(const std::string& name) const {
  if (name == kOnlyChannel) return channels_.size() == 1 ? &channels_.begin()->second : nullptr;
  auto found = channels_.find(name);
  if (found == channels_.end()) found = channels_.find(name + kFirst);
  return found == channels_.end() ? nullptr : &found->second;
}

std::vector<std::string> Channels::names() const {
  std::vector<std::string> list;
  for (const auto& [name, channel] : channels_) list.push_back(name);
  return list;
}

}  // namespace flappy::flightlog
