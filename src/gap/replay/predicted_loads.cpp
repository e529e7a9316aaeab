#include "gap/replay/predicted_loads.hpp"

#include <algorithm>
#include <cmath>

#include "io/csv.hpp"
#include "model/beat_averaged.hpp"

namespace flappy::gap {
namespace {

std::string seconds(double t_s) { return io::shortest_digits(std::round(1e6 * t_s) / 1e6); }

/// None: the name in the header is unknown.
std::optional<PredictedColumn> column_of(const std::string& name, const model::BeatAveraged& vehicle) {
  for (std::size_t k = 0; k < model::kLoadNames.size(); ++k) {
    if (name == model::kLoadNames[k]) return PredictedColumn{k, {}, {}};
    for (std::size_t c = 0; c < vehicle.coefficients.size(); ++c)
      if (name == "d_" + vehicle.coefficients[c].name + "_" + model::kLoadNames[k]) return PredictedColumn{k, c, {}};
  }
  return std::nullopt;
}

/// Linear interpolation onto the motion's grid. Where samples are closer than half a step, the mean over a step,
/// against aliasing.
std::vector<double> on_grid(const std::vector<double>& t_s, const std::vector<double>& x,
                            const flightlog::BeatAveragedMotion& m) {
  std::vector<double> integral(x.size(), 0);
  for (std::size_t k = 1; k < x.size(); ++k)
    integral[k] = integral[k - 1] + (t_s[k] - t_s[k - 1]) * (x[k] + x[k - 1]) / 2;
  struct At {
    double value, integral;
  };
  const auto at = [&](double t) {
    t = std::clamp(t, t_s.front(), t_s.back());
    const auto after = std::ranges::upper_bound(t_s, t) - t_s.begin();
    const std::size_t k = std::min(static_cast<std::size_t>(after - 1), t_s.size() - 2);
    const double since = t - t_s[k], value = x[k] + since / (t_s[k + 1] - t_s[k]) * (x[k + 1] - x[k]);
    return At{value, integral[k] + since * (x[k] + value) / 2};
  };
  const bool closer = t_s.back() - t_s.front() < 0.5 * m.step_s * static_cast<double>(t_s.size() - 1);
  std::vector<double> y;
  for (std::size_t i = 0; i < m.size(); ++i) {
    const double begin = std::max(m.t_s(i) - m.step_s / 2, t_s.front()),
                 end = std::min(m.t_s(i) + m.step_s / 2, t_s.back());
    y.push_back(closer && end > begin ? (at(end).integral - at(begin).integral) / (end - begin) : at(m.t_s(i)).value);
  }
  return y;
}

}  // namespace

std::vector<PredictedColumn> read_predicted_loads(const std::filesystem::path& file, const model::BeatAveraged& vehicle,
                                                  const flightlog::BeatAveragedMotion& motion, double from_s,
                                                  double to_s) {
  const auto fail = [&](std::size_t line, const std::string& what, const std::string& accepted) {
    throw io::InputError(file.string() + (line > 0 ? ":" + std::to_string(line) : "") + ": " + what +
                         "; accepted: " + accepted);
  };
  const std::string loads = io::joined({model::kLoadNames.begin(), model::kLoadNames.end()});
  if (!std::filesystem::exists(file))
    fail(0, "is missing, but the vehicle's model is \"predicted\"", "a file with t_s, and any of " + loads);
  const io::CsvTable table = io::read_csv(file);
  const std::vector<double>& t_s = table.column("t_s");

  std::vector<std::string> known = {"t_s"};
  for (const char* name : model::kLoadNames) known.emplace_back(name);
  for (const model::BeatAveraged::Coefficient& c : vehicle.coefficients)
    for (const char* name : model::kLoadNames) known.push_back("d_" + c.name + "_" + name);
  std::vector<PredictedColumn> columns;
  for (const std::string& name : table.names) {
    if (name == "t_s") continue;
    const std::optional<PredictedColumn> column = column_of(name, vehicle);
    if (column) columns.push_back(*column);
    else
      fail(1, name + ": is neither a load nor its derivative by a coefficient of the vehicle's file",
           "t_s, " + loads + ", or d_COEFFICIENT_ before one of these" + io::did_you_mean(name, known));
  }
  const auto has = [&](const auto& wanted) { return std::ranges::any_of(columns, wanted); };
  if (!has([](const PredictedColumn& c) { return !c.coefficient; })) fail(1, "has no load", "any of " + loads);
  if (vehicle.compares_moments && !has([](const PredictedColumn& c) { return c.component >= 3; }))
    fail(1, "has no moment, but the vehicle's file compares moments",
         "any of moment_x_Nm, moment_y_Nm, moment_z_Nm, or beat.compares_moments = false in the vehicle's file");
  for (std::size_t k = 0; k < vehicle.coefficients.size(); ++k)
    if (const std::string& name = vehicle.coefficients[k].name;
        !has([&](const PredictedColumn& c) { return c.coefficient == k; }))
      fail(1, name + ": has no derivative by this coefficient of the vehicle's file, which cannot be fitted so",
           "any of d_" + name + "_" + model::kLoadNames.front() + " to d_" + name + "_" + model::kLoadNames.back() +
               ", or a vehicle's file without it");

  if (t_s.size() < 2) fail(0, "has " + std::to_string(t_s.size()) + " rows", "2 or more");
  const double apart_s = 0.5 / vehicle.bandwidth_Hz;
  for (std::size_t k = 1; k < t_s.size(); ++k) {
    const double step_s = t_s[k] - t_s[k - 1];
    if (step_s <= 0) fail(k + 2, "t_s: does not increase", "more than " + io::shortest_digits(t_s[k - 1]));
    if (step_s > apart_s)
      fail(k + 2, "t_s: is " + seconds(step_s) + " s after the row before",
           "rows at most " + seconds(apart_s) + " s apart, for motion is compared up to " +
               io::shortest_digits(vehicle.bandwidth_Hz) + " Hz");
  }
  // the clocks of the streams may differ by up to a step of the motion's grid
  if (t_s.front() > from_s + motion.step_s || t_s.back() < to_s - motion.step_s)
    fail(t_s.front() > from_s + motion.step_s ? 2 : t_s.size() + 1,
         "t_s: is from " + seconds(t_s.front()) + " to " + seconds(t_s.back()) + " s, less than the flight",
         "from " + seconds(from_s) + " to " + seconds(to_s) + " s");

  std::size_t next = 0;
  for (std::size_t i = 0; i < table.names.size(); ++i)
    if (table.names[i] != "t_s") columns[next++].values = on_grid(t_s, table.columns[i], motion);
  return columns;
}

}  // namespace flappy::gap
