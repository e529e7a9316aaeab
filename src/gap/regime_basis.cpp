#include <cmath>

#include "gap/evidence.hpp"

namespace flappy::gap {
namespace {

/// How far what is near a surface reaches: a wing's length.
constexpr double kReach_m = 0.07;
/// What two good models of one vehicle differ by, as a share of the signal: of the constant, of what changes with an
/// input, and with the velocity, by channel and harmonic. Found between this simulator and the blind robot on development vehicles, after the fit of
/// parameters, as the variance that makes their residuals most probable; a quarter larger here (docs/gap.md).
struct Shares {
  double steady[kHarmonics + 1], changing[kHarmonics + 1], velocity[kHarmonics + 1];
};
constexpr Shares kTorque[3] = {{{0.0013, 0.0059, 0.0047, 0.0020, 0.0109},
                                {0.0010, 0.0009, 0.0012, 0.0014, 0.0023},
                                {0.0018, 0.0036, 0.0055, 0.0043, 0.0156}},
                               {{0.0012, 0.0220, 0.0023, 0.0093, 0.0014},
                                {0.0004, 0.0008, 0.0009, 0.0011, 0.0012},
                                {0.0050, 0.0033, 0.0085, 0.0097, 0.0026}},
                               {{0.0015, 0.0026, 0.0017, 0.0010, 0.0009},
                                {0.0005, 0.0007, 0.0005, 0.0006, 0.0006},
                                {0.0005, 0.0105, 0.0007, 0.0055, 0.0006}}};
constexpr Shares kForce[3] = {{{0.0009, 0.0112, 0.0015, 0.0057, 0.0030},
                               {0.0005, 0.0005, 0.0005, 0.0007, 0.0006},
                               {0.0005, 0.0021, 0.0012, 0.0029, 0.0007}},
                              {{0.0010, 0.0077, 0.0025, 0.0066, 0.0086},
                               {0.0007, 0.0011, 0.0007, 0.0009, 0.0013},
                               {0.0008, 0.0035, 0.0062, 0.0011, 0.0061}},
                              {{0.0091, 0.0054, 0.0236, 0.0078, 0.0091},
                               {0.0007, 0.0008, 0.0009, 0.0009, 0.0013},
                               {0.0027, 0.0010, 0.0042, 0.0013, 0.0056}}};
constexpr Shares kDrive = {
    {0.01, 0.01, 0.01, 0.01, 0.01}, {0.001, 0.001, 0.001, 0.001, 0.001}, {0.002, 0.002, 0.002, 0.002, 0.002}};
constexpr Shares kPath = {{0.0021}, {0.0010}, {0.0024}};
constexpr Shares kTurn = {{0.0006}, {0.0006}, {0.0006}};
/// Against what changes with an input.
constexpr double kConstant = 0, kVelocity = -1, kInput = 1, kRate = 0.85, kProduct = 0.7, kSquare = 1.9, kPlace = 0.75;

const Shares& shares_of(int channel) {
  if (channel <= kTorqueZ) return kTorque[channel - kTorqueX];
  if (channel <= kForceZ) return kForce[channel - kForceX];
  if (channel < kPathX) return kDrive;
  return channel < kTurnX ? kPath : kTurn;
}

/// Where some of the plain functions stand, when a set of flights has them all.
constexpr int kAmplitude = 1, kDifference = 2, kBias = 3, kSplitCycle = 4, kVelocityX = 5, kVelocityZ = 7, kPlain = 11;

}  // namespace

double RegimeBasis::floor(int group, int i) const {
  const Shares& s = shares_of(group / kCoefficients);
  const int harmonic = (group % kCoefficients + 1) / 2;
  const double kind = kinds_[static_cast<std::size_t>(i)];
  if (kind == kConstant) return s.steady[harmonic];
  return kind == kVelocity ? s.velocity[harmonic] : kind * s.changing[harmonic];
}

RegimeBasis::RegimeBasis(const std::vector<CarriedFlight>& flights) {
  values_.resize(flights.size());
  // centred and of rms 1, but for the constant; what never changes is the constant
  const auto append = [&](const std::string& name, double kind, std::vector<Eigen::VectorXd> column) {
    double sum = 0, squares = 0, n = 0;
    for (const Eigen::VectorXd& v : column)
      sum += v.sum(), squares += v.squaredNorm(), n += static_cast<double>(v.size());
    const bool constant = names_.empty();
    const double mean = constant ? 0 : sum / n;
    const double sd = constant ? 1 : std::sqrt(std::max(0.0, squares / n - mean * mean));
    if (!(sd > 1e-9 * (std::abs(mean) + 1e-3))) return;
    for (std::size_t f = 0; f < flights.size(); ++f) {
      values_[f].conservativeResize(column[f].size(), values_[f].cols() + 1);
      values_[f].rightCols(1) = (column[f].array() - mean) / sd;
    }
    names_.push_back(name);
    kinds_.push_back(kind);
  };
  const auto add = [&](const char* name, double kind, auto&& value) {
    std::vector<Eigen::VectorXd> column;
    for (const CarriedFlight& f : flights) {
      column.emplace_back(static_cast<Eigen::Index>(f.beats()));
      for (std::size_t j = 0; j < f.beats(); ++j)
        column.back()[static_cast<Eigen::Index>(j)] = value(f.recording(), f.recording().regimes[j]);
    }
    append(name, kind, std::move(column));
  };
  using R = const Recording&;
  using S = const Regime&;
  add("1", kConstant, [](R, S) { return 1.0; });
  add("amplitude", kInput, [](R, S s) { return s.amplitude_V; });
  add("difference", kInput, [](R, S s) { return s.difference_V; });
  add("bias", kInput, [](R, S s) { return s.bias_V; });
  add("split_cycle", kInput, [](R, S s) { return s.split_cycle; });
  add("velocity_x", kVelocity, [](R, S s) { return s.velocity_B_m_s.x(); });
  add("velocity_y", kVelocity, [](R, S s) { return s.velocity_B_m_s.y(); });
  add("velocity_z", kVelocity, [](R, S s) { return s.velocity_B_m_s.z(); });
  add("rate_x", kRate, [](R, S s) { return s.rate_rad_s.x(); });
  add("rate_y", kRate, [](R, S s) { return s.rate_rad_s.y(); });
  add("rate_z", kRate, [](R, S s) { return s.rate_rad_s.z(); });
  // of what is already centred, so that a product says what its factors do not
  const auto multiply = [&](int a, int b) {
    std::vector<Eigen::VectorXd> column;
    for (const Eigen::MatrixXd& v : values_) column.emplace_back(v.col(a).cwiseProduct(v.col(b)));
    append(name(a) + " " + name(b), kProduct, std::move(column));
  };
  if (size() == kPlain)
    for (const int b : {kAmplitude, kDifference, kBias, kSplitCycle, kVelocityX, kVelocityZ}) multiply(kAmplitude, b);
  add("|velocity| velocity_x", kSquare, [](R, S s) { return s.velocity_B_m_s.norm() * s.velocity_B_m_s.x(); });
  add("|velocity| velocity_y", kSquare, [](R, S s) { return s.velocity_B_m_s.norm() * s.velocity_B_m_s.y(); });
  add("|velocity| velocity_z", kSquare, [](R, S s) { return s.velocity_B_m_s.norm() * s.velocity_B_m_s.z(); });
  add("near ground", kPlace,
      [](R r, S s) { return std::exp(-std::max(0.0, s.position_m.z() - r.world.ground_z_m) / kReach_m); });
  add("near ceiling", kPlace,
      [](R r, S s) { return std::exp(-std::max(0.0, r.world.ceiling_z_m - s.position_m.z()) / kReach_m); });
  add("near wall", kPlace, [](R r, S s) {
    double near = 0;
    for (const sim::Wall& w : r.world.walls)
      near += std::exp(
          -std::max(0.0, w.normal_x * (s.position_m.x() - w.x_m) + w.normal_y * (s.position_m.y() - w.y_m)) / kReach_m);
    return near;
  });
  add("height", kPlace, [](R, S s) { return s.position_m.z(); });
  add("cos heading", kPlace, [](R, S s) { return std::cos(s.heading_rad); });
  add("sin heading", kPlace, [](R, S s) { return std::sin(s.heading_rad); });
  add("time", kPlace, [](R r, S s) { return s.t_s - r.begin_s; });
}

}  // namespace flappy::gap
