#include <cmath>

#include "gap/evidence/evidence.hpp"

namespace flappy::gap {
namespace {

/// How far what is near a surface reaches: a wing's length.
constexpr double kReach_m = 0.07;
/// Where some of the plain functions stand, when a set of flights has them all.
constexpr int kAmplitude = 1, kDifference = 2, kBias = 3, kSplitCycle = 4, kVelocityX = 5, kVelocityZ = 7, kPlain = 11;

}  // namespace

RegimeBasis::RegimeBasis(const std::vector<PredictedFlight>& flights) {
  values_.resize(flights.size());
  // centred and of rms 1, but for the constant; what never changes is the constant
  const auto append = [&](const std::string& name, BasisFunction kind, std::vector<Eigen::VectorXd> column) {
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
  const auto add = [&](const char* name, BasisFunction kind, auto&& value) {
    std::vector<Eigen::VectorXd> column;
    for (const PredictedFlight& f : flights) {
      column.emplace_back(static_cast<Eigen::Index>(f.beats()));
      for (std::size_t j = 0; j < f.beats(); ++j)
        column.back()[static_cast<Eigen::Index>(j)] = value(f.recording(), f.recording().regimes[j]);
    }
    append(name, kind, std::move(column));
  };
  using R = const Recording&;
  using S = const Regime&;
  add("1", BasisFunction::constant, [](R, S) { return 1.0; });
  add("amplitude", BasisFunction::input, [](R, S s) { return s.amplitude_V; });
  add("difference", BasisFunction::input, [](R, S s) { return s.difference_V; });
  add("bias", BasisFunction::input, [](R, S s) { return s.bias_V; });
  add("split_cycle", BasisFunction::input, [](R, S s) { return s.split_cycle; });
  add("velocity_x", BasisFunction::velocity_x, [](R, S s) { return s.velocity_B_m_s.x(); });
  add("velocity_y", BasisFunction::velocity_y, [](R, S s) { return s.velocity_B_m_s.y(); });
  add("velocity_z", BasisFunction::velocity_z, [](R, S s) { return s.velocity_B_m_s.z(); });
  add("rate_x", BasisFunction::rate, [](R, S s) { return s.rate_rad_s.x(); });
  add("rate_y", BasisFunction::rate, [](R, S s) { return s.rate_rad_s.y(); });
  add("rate_z", BasisFunction::rate, [](R, S s) { return s.rate_rad_s.z(); });
  // of what is already centred, so that a product says what its factors do not
  const auto multiply = [&](int a, int b) {
    std::vector<Eigen::VectorXd> column;
    for (const Eigen::MatrixXd& v : values_) column.emplace_back(v.col(a).cwiseProduct(v.col(b)));
    append(name(a) + " " + name(b), BasisFunction::product, std::move(column));
  };
  if (size() == kPlain)
    for (const int b : {kAmplitude, kDifference, kBias, kSplitCycle, kVelocityX, kVelocityZ}) multiply(kAmplitude, b);
  add("|velocity| velocity_x", BasisFunction::drag_x,
      [](R, S s) { return s.velocity_B_m_s.norm() * s.velocity_B_m_s.x(); });
  add("|velocity| velocity_y", BasisFunction::drag_y,
      [](R, S s) { return s.velocity_B_m_s.norm() * s.velocity_B_m_s.y(); });
  add("|velocity| velocity_z", BasisFunction::drag_z,
      [](R, S s) { return s.velocity_B_m_s.norm() * s.velocity_B_m_s.z(); });
  add("near ground", BasisFunction::place,
      [](R r, S s) { return std::exp(-std::max(0.0, s.position_m.z() - r.world.ground_z_m) / kReach_m); });
  add("near ceiling", BasisFunction::place,
      [](R r, S s) { return std::exp(-std::max(0.0, r.world.ceiling_z_m - s.position_m.z()) / kReach_m); });
  add("near wall", BasisFunction::place, [](R r, S s) {
    double near = 0;
    for (const sim::Wall& w : r.world.walls)
      near += std::exp(
          -std::max(0.0, w.normal_x * (s.position_m.x() - w.x_m) + w.normal_y * (s.position_m.y() - w.y_m)) / kReach_m);
    return near;
  });
  add("height", BasisFunction::place, [](R, S s) { return s.position_m.z(); });
  add("cos heading", BasisFunction::place, [](R, S s) { return std::cos(s.heading_rad); });
  add("sin heading", BasisFunction::place, [](R, S s) { return std::sin(s.heading_rad); });
  add("time", BasisFunction::place, [](R r, S s) { return s.t_s - r.begin_s; });
}

}  // namespace flappy::gap
