#include "model/posterior.hpp"

#include <algorithm>
#include <cmath>

#include "io/toml_writer.hpp"

namespace flappy::model {
namespace {

using Rows = std::vector<std::vector<double>>;

/// Share of a correlation that rounding may leave instead of 0, in files and matrix products.
constexpr double kRounding = 1e-9;

/// Whether a equals b up to rounding, relative to their possible `size`.
bool same(double a, double b, double size) { return std::abs(a - b) <= kRounding * size; }

std::string numbers(const std::vector<double>& values) {
  std::string text;
  for (const double v : values) text += (text.empty() ? "" : ", ") + io::toml_number(v);
  return "[" + text + "]";
}

void check_covariance(const io::Table& table, const Posterior& p) {
  const auto place = [&](std::size_t i, std::size_t j) { return "of " + p.names[i] + " and " + p.names[j]; };
  for (std::size_t i = 0; i < p.names.size(); ++i)
    for (std::size_t j = 0; j <= i; ++j)
      if (!same(p.covariance[i][j], p.covariance[j][i], std::abs(p.covariance[i][j]) + std::abs(p.covariance[j][i])))
        table.fail("covariance", "is not symmetric: " + place(i, j), "the same number on both sides of the diagonal");
  if (!lower_factor(p))
    table.fail("covariance", "is not positive semidefinite",
               "variances of 0 or more, and correlations that can be together");
}

}  // namespace

Posterior read_posterior(const io::Table& table, const Vehicle& vehicle) {
  Vehicle copy = vehicle;
  const std::vector<Parameter> known = parameters(copy);
  std::vector<std::string> paths;
  for (const Parameter& p : known) paths.push_back(p.path);
  Posterior posterior;
  posterior.names = table.strings("names");
  const std::size_t n = posterior.names.size();
  if (n == 0) table.fail("names", "is empty", "paths of this file");
  posterior.means = table.numbers("means", n);
  for (std::size_t i = 0; i < n; ++i) {
    const std::string& name = posterior.names[i];
    const auto at = std::ranges::find(known, name, &Parameter::path);
    if (at == known.end())
      table.fail("names", "no parameter \"" + name + "\"", "paths of this file" + io::did_you_mean(name, paths));
    if (std::ranges::count(posterior.names, name) > 1)
      table.fail("names", name + " is given twice", "each parameter once");
    if (name == "driver.hold_s")
      table.fail("names", name + " is the same for a whole batch", "what may differ from flapper to flapper");
    if (posterior.means[i] < at->low || posterior.means[i] > at->high)
      table.fail("means", name + ": " + io::toml_number(posterior.means[i]) + " is out of range",
                 "a number from " + io::toml_number(at->low) + " to " + io::toml_number(at->high));
  }
  posterior.covariance = table.rows("covariance", n);
  if (posterior.covariance.size() != n)
    table.fail("covariance", "has " + std::to_string(posterior.covariance.size()) + " rows",
               std::to_string(n) + " rows of " + std::to_string(n) + " numbers, as many as names");
  check_covariance(table, posterior);
  return posterior;
}

std::string posterior_text(const Posterior& posterior) {
  std::string names, rows;
  for (const std::string& name : posterior.names) names += (names.empty() ? "" : ", ") + io::toml_string(name);
  for (const std::vector<double>& row : posterior.covariance) rows += (rows.empty() ? "" : ",\n  ") + numbers(row);
  return "posterior.names = [" + names + "]\nposterior.means = " + numbers(posterior.means) +
         "\nposterior.covariance = [\n  " + rows + "]\n";
}

std::optional<Rows> lower_factor(const Posterior& posterior) {
  const Rows& c = posterior.covariance;
  const std::size_t n = c.size();
  std::vector<double> sd(n);
  for (std::size_t i = 0; i < n; ++i) {
    if (!(c[i][i] >= 0)) return std::nullopt;
    sd[i] = std::sqrt(c[i][i]);
  }
  // Cholesky's factorisation of the correlations, so that units do not matter
  Rows lower(n, std::vector<double>(n, 0));
  for (std::size_t i = 0; i < n; ++i)
    for (std::size_t j = 0; j <= i; ++j) {
      const double scale = sd[i] * sd[j];
      if (!(scale > 0) && c[i][j] != 0) return std::nullopt;
      double left = scale > 0 ? c[i][j] / scale : 0;
      for (std::size_t k = 0; k < j; ++k) left -= lower[i][k] * lower[j][k];
      if (i == j) {
        if (left < -kRounding) return std::nullopt;
        lower[i][i] = left > kRounding ? std::sqrt(left) : 0;
      } else if (lower[j][j] > 0) {
        lower[i][j] = left / lower[j][j];
      } else if (std::abs(left) > std::sqrt(kRounding)) {
        return std::nullopt;  // its variance is fully explained, so it cannot correlate with another
      }
    }
  for (std::size_t i = 0; i < n; ++i)
    for (std::size_t j = 0; j <= i; ++j) lower[i][j] *= sd[i];
  return lower;
}

Posterior posterior_of(const std::function<Vehicle(const std::vector<double>&)>& vehicle_of,
                       const std::vector<double>& mean, const Rows& covariance) {
  const std::size_t coordinates = mean.size();
  const auto values = [&](const std::vector<double>& at) {
    Vehicle v = vehicle_of(at);
    std::vector<double> list;
    for (const Parameter& p : parameters(v)) list.push_back(*p.value);
    return list;
  };
  const std::vector<double> best = values(mean);
  Rows slopes(best.size(), std::vector<double>(coordinates, 0));
  for (std::size_t k = 0; k < coordinates; ++k) {
    const double step = std::sqrt(covariance[k][k]);
    if (!(step > 0)) continue;
    std::vector<double> up = mean, down = mean;
    up[k] += step, down[k] -= step;
    const std::vector<double> above = values(up), below = values(down);
    // a value at the end of its range moves to one side only
    for (std::size_t i = 0; i < best.size(); ++i) {
      const double rise = above[i] - best[i], fall = best[i] - below[i];
      slopes[i][k] = (std::abs(rise) >= std::abs(fall) ? rise : fall) / step;
    }
  }
  Posterior posterior;
  std::vector<std::size_t> moving;
  Vehicle v = vehicle_of(mean);
  const std::vector<Parameter> all = parameters(v);
  for (std::size_t i = 0; i < best.size(); ++i) {
    if (std::ranges::all_of(slopes[i], [](double s) { return s == 0; })) continue;
    moving.push_back(i);
    posterior.names.push_back(all[i].path);
    posterior.means.push_back(best[i]);
  }
  posterior.covariance.assign(moving.size(), std::vector<double>(moving.size(), 0));
  for (std::size_t i = 0; i < moving.size(); ++i)
    for (std::size_t j = 0; j <= i; ++j) {
      double sum = 0;
      for (std::size_t k = 0; k < coordinates; ++k)
        for (std::size_t l = 0; l < coordinates; ++l)
          sum += slopes[moving[i]][k] * covariance[k][l] * slopes[moving[j]][l];
      posterior.covariance[i][j] = posterior.covariance[j][i] = sum;
    }
  return posterior;
}

}  // namespace flappy::model
