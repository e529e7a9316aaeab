#include "identify/gait_fit.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>

#include "io/csv.hpp"
#include "io/text.hpp"
#include "io/toml_writer.hpp"
#include "model/jointed.hpp"
#include "model/math.hpp"

namespace flappy::identify {
namespace {

constexpr double kTurn = 2 * std::numbers::pi;

std::string digits(double x) { return io::format("%.3g", x); }

[[noreturn]] void fail(const io::CsvTable& table, const std::string& column, const std::string& what,
                       const std::string& accepted) {
  throw io::InputError(table.name + ": " + column + ": " + what + "; accepted: " + accepted);
}

std::vector<double> beats_of(const io::CsvTable& table, const GaitOptions& options) {
  const bool by_time = std::ranges::count(table.names, "t_s") > 0;
  if (!by_time && std::ranges::count(table.names, "beat") == 0)
    throw io::InputError(table.name + ": no column of time; accepted: t_s, with --frequency-Hz, or beat");
  if (by_time && !options.frequency_Hz)
    fail(table, "t_s", "does not tell the beat's phase", "--frequency-Hz, too, or a column beat");
  const char* const name = by_time ? "t_s" : "beat";
  std::vector<double> beats = table.column(name);
  for (std::size_t i = 1; i < beats.size(); ++i)
    if (!(beats[i] > beats[i - 1]))
      throw io::InputError(table.name + ":" + std::to_string(i + 2) + ": " + name +
                           ": does not increase; accepted: times in their order");
  if (by_time)
    for (double& x : beats) x *= *options.frequency_Hz;
  return beats;
}

/// InputError where the samples leave a gap in the phase that is too wide for the harmonics asked for.
void check_phases(const io::CsvTable& table, const std::vector<double>& beats, const GaitOptions& options) {
  std::vector<double> phases;
  for (const double x : beats) phases.push_back(x - std::floor(x));
  std::ranges::sort(phases);
  double widest = 0, from = 0;
  for (std::size_t i = 0; i < phases.size(); ++i) {
    const double next = i + 1 < phases.size() ? phases[i + 1] : phases.front() + 1;
    if (next - phases[i] > widest) widest = next - phases[i], from = phases[i];
  }
  const double wanted = 0.5 / static_cast<double>(options.harmonics);
  if (phases.empty() || widest > wanted)
    throw io::InputError(table.name + ": a gap of " + digits(phases.empty() ? 1 : widest) + " beats from " +
                         digits(from) + " of the beat on; accepted: at most " + digits(wanted) + " beats for " +
                         std::to_string(options.harmonics) + " harmonics, or fewer of them");
}

std::vector<double> radians(const io::CsvTable& table, const std::string& column, bool degrees) {
  std::vector<double> list = table.column(column);
  if (degrees)
    for (double& x : list) x *= std::numbers::pi / 180;
  const auto most = std::ranges::max_element(list, {}, [](double x) { return std::abs(x); });
  if (most == list.end() || std::abs(*most) <= model::kLargestAngle_rad) return list;
  const auto in_both = [](double x) { return digits(x) + " rad (" + digits(x * 180 / std::numbers::pi) + " degrees)"; };
  const bool odd = !degrees && std::abs(*most) > kTurn;
  throw io::InputError(table.name + ":" + std::to_string(most - list.begin() + 2) + ": " + column + ": " +
                       in_both(*most) + ", the largest of the column, is beyond what a wing's angle may be" +
                       (odd ? "; are these degrees?" : "") + "; accepted: at most " +
                       in_both(model::kLargestAngle_rad) + " either way" + (odd ? ", or a column ..._deg" : ""));
}

}  // namespace

std::vector<FittedAngle> fit_gait(const std::filesystem::path& path, const GaitOptions& options) {
  if (options.harmonics < 1 || options.harmonics > model::kMaxHarmonics)
    throw io::InputError("--harmonics: " + std::to_string(options.harmonics) + " of them; accepted: 1 to " +
                         std::to_string(model::kMaxHarmonics));
  const io::CsvTable table = io::read_csv(path);
  const std::vector<double> beats = beats_of(table, options);
  check_phases(table, beats, options);
  const auto samples = static_cast<Eigen::Index>(beats.size()),
             columns = static_cast<Eigen::Index>(2 * options.harmonics + 1);
  if (samples < columns)
    throw io::InputError(table.name + ": " + std::to_string(beats.size()) + " samples for " + std::to_string(columns) +
                         " coefficients; accepted: as many samples, or fewer --harmonics");
  Eigen::MatrixXd m(samples, columns);
  for (Eigen::Index i = 0; i < samples; ++i) {
    m(i, 0) = 1;
    for (Eigen::Index k = 1; 2 * k < columns; ++k) {
      const double x = kTurn * static_cast<double>(k) * beats[static_cast<std::size_t>(i)];
      m(i, 2 * k - 1) = std::cos(x), m(i, 2 * k) = std::sin(x);
    }
  }
  const Eigen::ColPivHouseholderQR<Eigen::MatrixXd> solver(m);
  std::vector<FittedAngle> list;
  std::vector<std::string> known = {"t_s", "beat"};
  for (const char* side : {"left_", "right_", ""})
    for (const char* angle : model::kAngles)
      for (const char* unit : {"_rad", "_deg"}) {
        const std::string column = std::string(side) + angle + unit;
        if (std::ranges::count(table.names, column) == 0) continue;
        known.push_back(column);
        if (std::ranges::any_of(
                list, [&](const FittedAngle& f) { return f.angle == angle && (f.side == "right") == (*side == 'r'); }))
          fail(table, column, "is of an angle that another column has",
               "one column of an angle; without left_ or right_ it is left");
        const std::vector<double> values = radians(table, column, std::string_view(unit) == "_deg");
        const Eigen::VectorXd y = Eigen::Map<const Eigen::VectorXd>(values.data(), samples), x = solver.solve(y);
        const auto n = static_cast<double>(samples);
        FittedAngle f{*side == 'r' ? "right" : "left", angle, x[0], {}, {}, std::sqrt((y - m * x).squaredNorm() / n)};
        const double size = std::sqrt((y.array() - y.mean()).square().sum() / n);
        if (f.rms_rad > options.residual * size && f.rms_rad > 1e-6)
          fail(table, column,
               "does not repeat with the beat: " + digits(f.rms_rad) + " rad rms are left of " + digits(size) + " rad",
               "at most " + digits(options.residual * size) +
                   " rad left; more --harmonics, another --frequency-Hz, or whole beats");
        for (Eigen::Index k = 1; 2 * k < columns; ++k) {
          f.cos_rad.push_back(x[2 * k - 1]);
          f.sin_rad.push_back(x[2 * k]);
        }
        list.push_back(std::move(f));
      }
  if (list.empty())
    throw io::InputError(table.name +
                         ": no column of an angle; accepted: stroke_plane, stroke, deviation or rotation, "
                         "with left_ or right_ before, and _rad or _deg behind");
  for (const std::string& name : table.names)
    if (std::ranges::count(known, name) == 0)
      fail(table, name, "is no column of a gait",
           "t_s, beat, and angles in _rad or _deg" + io::did_you_mean(name, {"left_stroke_rad", "right_stroke_rad"}));
  return list;
}

std::string gait_text(const std::vector<FittedAngle>& angles) {
  std::string text;
  const auto list = [](const std::vector<double>& numbers) {
    std::string all = "[";
    for (const double x : numbers)
      all += (all.size() > 1 ? ", " : "") + io::toml_number(std::round(x * 1e7) / 1e7 + 0.0);
    return all + "]\n";
  };
  for (const FittedAngle& f : angles)
    text += "[" + f.side + "." + f.angle +
            "]\nmode = \"driven\"\nmean_rad = " + io::toml_number(std::round(f.mean_rad * 1e7) / 1e7 + 0.0) +
            "\ncos_rad = " + list(f.cos_rad) + "sin_rad = " + list(f.sin_rad) + "\n";
  return text;
}

}  // namespace flappy::identify
