#include "identify/kinematics.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <complex>
#include <cstdio>
#include <numbers>

#include "identify/measured_map.hpp"
#include "io/csv.hpp"
#include "io/gnuplot.hpp"
#include "io/text.hpp"

namespace flappy::identify {
namespace {

using Eigen::VectorXd;

constexpr double kTurn = 2 * std::numbers::pi;
constexpr Eigen::Index kMaxHarmonics = 20;

/// Design matrix: columns 1, cos, sin, cos 2, sin 2, ... of the phases.
Eigen::MatrixXd harmonics_at(const std::vector<double>& phases, Eigen::Index harmonics) {
  Eigen::MatrixXd m(static_cast<Eigen::Index>(phases.size()), 2 * harmonics + 1);
  for (Eigen::Index i = 0; i < m.rows(); ++i) {
    m(i, 0) = 1;
    for (Eigen::Index h = 1; h <= harmonics; ++h) {
      m(i, 2 * h - 1) = std::cos(static_cast<double>(h) * phases[static_cast<std::size_t>(i)]);
      m(i, 2 * h) = std::sin(static_cast<double>(h) * phases[static_cast<std::size_t>(i)]);
    }
  }
  return m;
}

VectorXd as_vector(const std::vector<double>& values) {
  return Eigen::Map<const VectorXd>(values.data(), static_cast<Eigen::Index>(values.size()));
}

/// The four angles as Fourier series, coefficients as the columns of harmonics_at().
struct Beat {
  Eigen::Index harmonics = 0;
  std::array<VectorXd, 4> coefficients;

  std::vector<double> on(const std::vector<double>& phases, std::size_t angle) const {
    const VectorXd y = harmonics_at(phases, harmonics) * coefficients[angle];
    return {y.begin(), y.end()};
  }
  /// First harmonic as a complex number: amplitude and phase of a cosine.
  std::complex<double> first(std::size_t angle) const { return {coefficients[angle][1], -coefficients[angle][2]}; }
};

std::optional<Beat> beat_of(const std::vector<double>& phases, const std::array<std::vector<double>, 4>& angles) {
  Beat beat;
  beat.harmonics = std::min(kMaxHarmonics, (static_cast<Eigen::Index>(phases.size()) / 4 - 1) / 2);
  if (beat.harmonics < 1) return std::nullopt;
  const Eigen::MatrixXd m = harmonics_at(phases, beat.harmonics);
  Eigen::ColPivHouseholderQR<Eigen::MatrixXd> solver(m);
  // Where the samples leave a gap, the coefficients of some wave that is large in the gap are undetermined.
  const VectorXd diagonal = solver.matrixR().diagonal().cwiseAbs();
  if (diagonal.minCoeff() < 0.05 * diagonal.maxCoeff()) return std::nullopt;
  for (std::size_t a = 0; a < 4; ++a) beat.coefficients[a] = solver.solve(as_vector(angles[a]));
  return beat;
}

Beat simulated_beat(const model::Vehicle& vehicle, const sim::Input& input, const MapOptions& options) {
  MapOptions alone = options;
  alone.threads = 1;
  auto batch = welded_batch<double>(std::span(&vehicle, 1), std::span(&input, 1), alone);
  const int settled = settle_steps(vehicle.driver, options.settle_s), steps = whole_beats(vehicle.driver).steps;
  batch.step(settled);
  std::vector<double> phases;
  std::array<std::vector<double>, 4> angles;
  for (int i = 1; i <= steps; ++i) {
    batch.step(1);
    const sim::FlapperState s = batch.state(0);
    phases.push_back(kTurn * std::fmod((settled + i) * kStep_s * vehicle.driver.flapping_Hz, 1.0));
    const std::array<double, 4> now = {s.stroke_rad[0], s.rotation_rad[0], s.stroke_rad[1], s.rotation_rad[1]};
    for (std::size_t a = 0; a < 4; ++a) angles[a].push_back(now[a]);
  }
  if (batch.status(0) & sim::kFrozen) refuse_apart(vehicle.name, input);
  const std::optional<Beat> beat = beat_of(phases, angles);
  if (!beat)
    throw io::InputError(vehicle.name + ": its beat has too few steps of " + io::shortest_digits(kStep_s) +
                         " s for its harmonics; accepted: a lower flapping_Hz");
  return *beat;
}

BeatParameters parameters_of(const std::vector<double>& curve, std::complex<double> first) {
  const auto [low, high] = std::ranges::minmax(curve);
  return {(high - low) / 2, (high + low) / 2, std::arg(first)};
}

double rms(const std::vector<double>& a, const std::vector<double>& b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += (a[i] - b[i]) * (a[i] - b[i]);
  return std::sqrt(sum / static_cast<double>(a.size()));
}

std::string milliseconds(double seconds) { return io::format("%.1f ms", 1e3 * seconds); }

std::vector<double> beat_phases() {
  std::vector<double> phases(kBeatPoints);
  for (std::size_t i = 0; i < kBeatPoints; ++i) phases[i] = kTurn * static_cast<double>(i) / kBeatPoints;
  return phases;
}

}  // namespace

WingSamples read_wing_samples(const std::filesystem::path& path) {
  const io::CsvTable table = io::read_csv(path);
  std::vector<std::string> required = {"t_s"};
  required.insert(required.end(), kAngleNames.begin(), kAngleNames.end());
  check_columns(table, required, {kInputNames.begin(), kInputNames.end()});
  WingSamples s{table.name, table.column("t_s"), {}, {}};
  for (std::size_t a = 0; a < 4; ++a) s.angles_rad[a] = table.column(kAngleNames[a]);
  for (std::size_t i = 1; i < s.t_s.size(); ++i)
    if (!(s.t_s[i] > s.t_s[i - 1]))
      throw io::InputError(table.name + ":" + std::to_string(i + 2) + ": t_s: " + io::shortest_digits(s.t_s[i]) +
                           " does not increase; accepted: a number above " + io::shortest_digits(s.t_s[i - 1]));
  std::array<double, 4> input{};
  for (std::size_t k = 0; k < 4; ++k) {
    if (std::ranges::count(table.names, kInputNames[k]) == 0) continue;
    const std::vector<double>& values = table.column(kInputNames[k]);
    const auto other = std::ranges::find_if(values, [&](double v) { return v != values.front(); });
    if (other != values.end())
      throw io::InputError(table.name + ":" + std::to_string(other - values.begin() + 2) + ": " + kInputNames[k] +
                           ": changes; accepted: one input throughout");
    if (!values.empty()) input[k] = values.front(), s.input.emplace();
  }
  if (s.input) s.input = sim::Input{input[0], input[1], input[2], input[3]};
  return s;
}

void cut(WingSamples& samples, double from_s, double to_s) {
  WingSamples kept{samples.name, {}, {}, samples.input};
  for (std::size_t i = 0; i < samples.t_s.size(); ++i) {
    if (samples.t_s[i] < from_s || samples.t_s[i] > to_s) continue;
    kept.t_s.push_back(samples.t_s[i]);
    for (std::size_t a = 0; a < 4; ++a) kept.angles_rad[a].push_back(samples.angles_rad[a][i]);
  }
  samples = std::move(kept);
}

WingComparison compare_wings(const model::Vehicle& vehicle, const sim::Input& input, const WingSamples& samples,
                             const MapOptions& options) {
  const double beat_s = 1 / vehicle.driver.flapping_Hz;
  const double lasts_s = samples.t_s.empty() ? 0 : samples.t_s.back() - samples.t_s.front();
  if (lasts_s < 0.95 * beat_s)
    throw io::InputError(samples.name + ": lasts " + milliseconds(lasts_s) + "; accepted: at least one beat, " +
                         milliseconds(beat_s));
  std::vector<double> phases;
  for (const double t : samples.t_s) phases.push_back(kTurn * (t / beat_s - std::floor(t / beat_s)));
  std::optional<Beat> measured = beat_of(phases, samples.angles_rad);
  if (!measured)
    throw io::InputError(samples.name +
                         ": leaves parts of the beat without samples; accepted: at least 12 samples all over the beat");
  const Beat simulated = simulated_beat(vehicle, input, options);

  WingComparison c;
  std::complex<double> agreement = 0;
  for (const std::size_t stroke : {0UL, 2UL}) agreement += measured->first(stroke) * std::conj(simulated.first(stroke));
  c.shift_rad = std::arg(agreement);
  for (double& phase : phases) phase += c.shift_rad;
  measured = beat_of(phases, samples.angles_rad);
  const std::vector<double> points = beat_phases();
  for (std::size_t a = 0; a < 4; ++a) {
    c.measured_rad[a] = measured->on(points, a);
    c.simulated_rad[a] = simulated.on(points, a);
    AngleComparison& angle = c.angles[a];
    angle.measured = parameters_of(c.measured_rad[a], measured->first(a));
    angle.simulated = parameters_of(c.simulated_rad[a], simulated.first(a));
    angle.phase_rad = std::arg(measured->first(a) * std::conj(simulated.first(a)));
    angle.rms_rad = rms(samples.angles_rad[a], simulated.on(phases, a));
    angle.scatter_rad = rms(samples.angles_rad[a], measured->on(phases, a));
  }
  return c;
}

void write_beat_csv(const std::filesystem::path& path, const WingComparison& c) {
  std::vector<std::string> names = {"phase_rad"};
  std::vector<std::vector<double>> columns = {beat_phases()};
  for (const char* what : {"measured_", "simulated_"})
    for (std::size_t a = 0; a < 4; ++a) {
      names.push_back(what + std::string(kAngleNames[a]));
      columns.push_back(what[0] == 'm' ? c.measured_rad[a] : c.simulated_rad[a]);
    }
  io::write_atomically(path, io::csv_text(names, columns));
}

void write_beat_svg(const std::filesystem::path& path, const WingComparison& c) {
  std::string script =
      "set grid ytics lc '#dddddd' lt 1\n"
      "set key outside right\nset xrange [0:1]\n$rows << end_of_rows\n";
  const std::vector<double> phases = beat_phases();
  for (std::size_t i = 0; i < kBeatPoints; ++i) {
    script += io::shortest_digits(phases[i] / kTurn);
    for (const auto* curves : {&c.measured_rad, &c.simulated_rad})
      for (const std::vector<double>& curve : *curves) script += " " + io::shortest_digits(curve[i] * 360 / kTurn);
    script += "\n";
  }
  script += "end_of_rows\nset multiplot layout 2,1\n";
  for (const int angle : {0, 1}) {
    script += "set ylabel '" + std::string(angle == 0 ? "stroke" : "rotation") + " in degrees'\nset xlabel '" +
              (angle == 0 ? "" : "fraction of the beat") + "'\nplot ";
    for (const int side : {0, 1}) {
      const std::string colour = side == 0 ? "#08519c" : "#a63603", name = side == 0 ? "left" : "right";
      const int column = 2 + 2 * side + angle;
      script += "$rows using 1:" + std::to_string(column) + " with lines lw 2 lc '" + colour + "' title '" + name +
                ", measured', $rows using 1:" + std::to_string(column + 4) + " with lines lw 2 dt 2 lc '" + colour +
                "' title '" + name + ", simulated'" + (side == 0 ? ", " : "\n");
    }
  }
  script += "unset multiplot\n";
  io::draw_svg(path, "kinematics", 720, 600, script);
}

}  // namespace flappy::identify
