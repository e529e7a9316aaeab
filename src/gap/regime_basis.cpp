#include <cmath>

#include "gap/evidence.hpp"

namespace flappy::gap {
namespace {

/// How far what is near a surface reaches: a wing's length.
constexpr double kReach_m = 0.07;
/// What two good models of one vehicle differ by, as a share of the signal: found between this simulator and the blind robot
/// on development vehicles, after a fit (docs/gap.md). Its steady part is the largest.
constexpr double kConstant = 0.025, kInput = 0.004, kVelocity = 0.012, kProduct = 0.003, kSquare = 0.006,
                 kPlace = 0.002;
/// Where some of the plain functions stand, when a set of flights has them all.
constexpr int kAmplitude = 1, kDifference = 2, kBias = 3, kSplitCycle = 4, kVelocityX = 5, kVelocityZ = 7, kPlain = 11;

}  // namespace

RegimeBasis::RegimeBasis(const std::vector<CarriedFlight>& flights) {
  const auto add = [&](const char* name, double floor, auto&& value) {
    double sum = 0, squares = 0, n = 0;
    std::vector<Eigen::VectorXd> column;
    for (const CarriedFlight& f : flights) {
      Eigen::VectorXd v(static_cast<Eigen::Index>(f.beats()));
      for (std::size_t j = 0; j < f.beats(); ++j) {
        const double x = v[static_cast<Eigen::Index>(j)] = value(f.recording(), f.recording().regimes[j]);
        sum += x, squares += x * x, n += 1;
      }
      column.push_back(std::move(v));
    }
    const double mean = sum / n, sd = std::sqrt(std::max(0.0, squares / n - mean * mean));
    if (names_.empty()) {
      values_.resize(flights.size());
    } else if (!(sd > 1e-9 * (std::abs(mean) + 1e-3))) {
      return;  // what never changes is the constant
    }
    for (std::size_t f = 0; f < flights.size(); ++f) {
      const Eigen::Index k = static_cast<Eigen::Index>(names_.size());
      values_[f].conservativeResize(column[f].size(), k + 1);
      values_[f].col(k) = names_.empty() ? column[f] : Eigen::VectorXd((column[f].array() - mean) / sd);
    }
    names_.emplace_back(name);
    floors_.push_back(floor);
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
  add("rate_x", kInput, [](R, S s) { return s.rate_rad_s.x(); });
  add("rate_y", kInput, [](R, S s) { return s.rate_rad_s.y(); });
  add("rate_z", kInput, [](R, S s) { return s.rate_rad_s.z(); });
  // of what is already centred, so that a product says what its factors do not
  const auto multiply = [&](int a, int b) {
    double sum = 0, squares = 0, n = 0;
    std::vector<Eigen::VectorXd> column;
    for (const Eigen::MatrixXd& v : values_) {
      column.push_back(v.col(a).cwiseProduct(v.col(b)));
      sum += column.back().sum(), squares += column.back().squaredNorm(), n += static_cast<double>(v.rows());
    }
    const double mean = sum / n, sd = std::sqrt(std::max(1e-12, squares / n - mean * mean));
    for (std::size_t f = 0; f < values_.size(); ++f) {
      values_[f].conservativeResize(Eigen::NoChange, values_[f].cols() + 1);
      values_[f].rightCols(1) = (column[f].array() - mean) / sd;
    }
    names_.push_back(names_[static_cast<std::size_t>(a)] + " " + names_[static_cast<std::size_t>(b)]);
    floors_.push_back(kProduct);
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
