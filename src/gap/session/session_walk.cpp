#include "gap/session/session_walk.hpp"

#include <algorithm>
#include <chrono>
#include <cstdio>

#include "io/files.hpp"

namespace flappy::gap {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

SessionWalk::SessionWalk(const VectorXd& times, double at, double walk) {
  const Index n = times.size();
  const double first = std::min(times.minCoeff(), at);
  MatrixXd r(n, n);
  VectorXd k(n);
  for (Index i = 0; i < n; ++i) {
    for (Index j = 0; j < n; ++j) r(i, j) = (i == j) + walk * (std::min(times[i], times[j]) - first);
    k[i] = walk * (std::min(times[i], at) - first);
  }
  inverse_ = r.inverse();
  const VectorXd ones = inverse_.rowwise().sum();
  const double sum = ones.sum(), missing = 1 - ones.dot(k);
  mean_ = ones / sum;
  const VectorXd from_rest = inverse_ * k;
  next_ = mean_ + from_rest - from_rest.sum() * mean_;
  factor_ = 1 + walk * (at - first) - k.dot(from_rest) + missing * missing / sum;
}

double SessionWalk::sum_of_squares(const VectorXd& x) const {
  const VectorXd rest = x.array() - mean_.dot(x);
  return rest.dot(inverse_ * rest);
}

namespace {

/// Days from an epoch; none: `name` begins with no date.
std::optional<double> day_of(const std::string& name) {
  const std::string own = io::folder_name(name);
  int year = 0, month = 0, day = 0, hour = 0, minute = 0;
  const int read = std::sscanf(own.c_str(), "%4d-%2d-%2d%*1[T _]%2d:%2d", &year, &month, &day, &hour, &minute);
  if (read < 3) return std::nullopt;
  const std::chrono::year_month_day date{std::chrono::year(year), std::chrono::month(static_cast<unsigned>(month)),
                                         std::chrono::day(static_cast<unsigned>(day))};
  if (!date.ok() || hour < 0 || hour > 23 || minute < 0 || minute > 59) return std::nullopt;
  const double days = static_cast<double>(std::chrono::sys_days(date).time_since_epoch().count());
  return read < 5 ? days : days + (hour + minute / 60.0) / 24;
}

}  // namespace

SessionTimes session_times(const std::vector<std::string>& references, const std::vector<std::string>& tests) {
  const std::vector<int> of = session_numbers(references);
  const Index n = 1 + *std::ranges::max_element(of);
  SessionTimes times{VectorXd::LinSpaced(n, 0, static_cast<double>(n - 1)), static_cast<double>(n)};
  VectorXd days(n);
  double day = 0;
  for (std::size_t f = 0; f < references.size(); ++f) {
    const std::optional<double> dated = day_of(references[f]);
    if (!dated) return times;
    days[of[f]] = *dated;
  }
  for (const std::string& test : tests) {
    const std::optional<double> dated = day_of(test);
    if (!dated) return times;
    day += *dated / static_cast<double>(tests.size());
  }
  // of one day alone nothing is known of the time between sessions
  const double span = days.maxCoeff() - days.minCoeff(), spacing = span > 0 ? span / static_cast<double>(n - 1) : 1;
  return {(days.array() - days.minCoeff()) / spacing, (day - days.minCoeff()) / spacing};
}

}  // namespace flappy::gap
