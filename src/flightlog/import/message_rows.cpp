#include "flightlog/import/message_rows.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>

#include "flightlog/ros/cdr.hpp"

namespace flappy::flightlog {
namespace {

constexpr std::int64_t kSecond_ns = 1'000'000'000;
constexpr double kMaxSeconds = 4e9;  // about the limit of 32 bits

/// "transforms[0]" of "transforms[0].child_frame_id"; empty where `path` is not the `member` of an element.
std::string_view element_of(std::string_view path, std::string_view member) {
  if (!path.ends_with(member)) return {};
  path.remove_suffix(member.size());
  return path.ends_with(']') && path.find('.') == std::string_view::npos ? path : std::string_view();
}

}  // namespace

const Row& MessageRows::read(std::string_view bytes) {
  std::size_t count = 0;
  double sec = 0;
  bool open_stamp = false;
  stamp_ns_ = kNoTime;
  names_.clear();
  named_.clear();
  ros::decode(*layout_, bytes, [&](std::string_view path, const ros::Scalar& value) {
    if (const auto* text = std::get_if<std::string_view>(&value)) {
      if (path.starts_with("name[")) names_.emplace_back(*text);
      std::string_view element = element_of(path, ".child_frame_id");
      if (element.empty()) element = element_of(path, ".name");
      if (!element.empty()) named_.emplace_back(element, *text);
      return;
    }
    const double number = ros::to_number(value);
    // a definition may use any type for seconds: exclude values that would overflow
    const bool fits = std::abs(number) < kMaxSeconds;
    if (stamp_ns_ == kNoTime && fits && path.ends_with("stamp.sec")) {
      sec = number;
      open_stamp = true;
    } else if (open_stamp && fits && path.ends_with("stamp.nanosec")) {
      stamp_ns_ = static_cast<std::int64_t>(sec) * kSecond_ns + static_cast<std::int64_t>(number);
      open_stamp = false;
    }
    if (count == row_.size()) row_.emplace_back();
    row_[count].name = path;
    row_[count++].value = number;
  });
  row_.resize(count);
  not_measured_.mark(row_);
  rename();
  return row_;
}

void MessageRows::rename() {
  if (names_.empty() && named_.empty()) return;
  for (Item& item : row_) {
    const std::size_t open = item.name.find('['), close = item.name.find(']');
    if (close == std::string::npos || open > close || item.name.find('.') < open) continue;
    const std::string_view element = std::string_view(item.name).substr(0, close + 1);
    const auto named = std::ranges::find(named_, element, &std::pair<std::string, std::string>::first);
    std::size_t index = names_.size();
    std::from_chars(item.name.data() + open + 1, item.name.data() + close, index);
    if (named != named_.end()) item.name.replace(open + 1, close - open - 1, named->second);
    else if (close + 1 == item.name.size() && index < names_.size())
      item.name.replace(open + 1, close - open - 1, names_[index]);
  }
}

}  // namespace flappy::flightlog
