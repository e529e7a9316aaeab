#include "gap/replay/reset_kernel.hpp"

#include "flight/sensors.hpp"
#include "sim/rows.hpp"

namespace flappy::gap {
inline namespace FLAPPY_ISA {
namespace {

using namespace model;
using sim::kWidth;
using V = Lanes<Flown, kWidth<Flown>>;

FLAPPY_INLINE V all(double x) { return V(static_cast<Flown>(x)); }

FLAPPY_INLINE Vec3<V> load(const Flown (*rows)[sim::kLanes<Flown>], int first) {
  return {V::load(rows[0] + first), V::load(rows[1] + first), V::load(rows[2] + first)};
}
FLAPPY_INLINE Quaternion<V> load_quaternion(const Flown (*rows)[sim::kLanes<Flown>], int first) {
  return {V::load(rows[0] + first), V::load(rows[1] + first), V::load(rows[2] + first), V::load(rows[3] + first)};
}
FLAPPY_INLINE void store(const Vec3<V>& v, Flown (*rows)[sim::kLanes<Flown>], int first) {
  v.x.store(rows[0] + first);
  v.y.store(rows[1] + first);
  v.z.store(rows[2] + first);
}

void reset_block(sim::Block<Flown>& block, const TorsoRows* from, const TorsoRows& to, double interval_s,
                 const Flown (*imu_position_m)[kVehicles], double gravity_m_s2, ResetBlockState& kept) {
  const V per_interval(1 / interval_s);
  for (int first = 0; first < sim::kLanes<Flown>; first += kWidth<Flown>) {
    const Vec3<V> imu = load(imu_position_m, first);
    const Quaternion<V> attitude = load_quaternion(to.attitude, first);
    const auto p = sim::load_rows<Parameters<V>>(block.parameters, first);
    auto x = sim::load_rows<State<V>>(block.state, first);
    if (from != nullptr) {
      const flight::Truth<V> flown = flight::truth_of(p, x);
      const Quaternion<V> begin = load_quaternion(from->attitude, first);
      const Vec3<V> turn = flight::rotation_vector(flight::from_to(begin, flown.attitude));
      Vec3<V> force = per_interval * (flight::point_velocity(flown, imu) - load(kept.imu_velocity_m_s, first));
      force.z += all(gravity_m_s2);
      const Matrix3<V> halfway = rotation_matrix(rotated(begin, all(0.25) * turn));
      const Vec3<V> missed = per_interval * flight::rotation_vector(flight::from_to(flown.attitude, attitude));
      store(all(-1) * per_interval * missed, kept.rows + kAngularAcceleration, first);
      store(transpose_times(halfway, force), kept.rows + kSpecificForce, first);
      x.left.stroke_rad.store(kept.rows[kStroke] + first);
      x.right.stroke_rad.store(kept.rows[kStroke + 1] + first);
      x.left.rotation_rad.store(kept.rows[kRotation] + first);
      x.right.rotation_rad.store(kept.rows[kRotation + 1] + first);
      x.body_rate_rad_s = x.body_rate_rad_s + missed;
    } else {
      x.body_rate_rad_s = load(to.body_rate_rad_s, first);
    }
    x.position_m = load(to.position_m, first);
    x.attitude = attitude;
    const Matrix3<V> R = rotation_matrix(x.attitude);
    const auto whole = whole_vehicle<V>(
        p, {place_wing<+1>(p.left, x.left, x.body_rate_rad_s), place_wing<-1>(p.right, x.right, x.body_rate_rad_s)});
    const Vec3<V> velocity = load(to.velocity_m_s, first);
    x.com_velocity_m_s = velocity + R * (cross(x.body_rate_rad_s, whole.com) + whole.com_rate);
    store(velocity + R * cross(x.body_rate_rad_s, imu), kept.imu_velocity_m_s, first);
    sim::store_rows(x, block.state, first);
  }
}

void clamped_block(sim::Block<Flown>& block, double interval_s, ClampedBlockState& kept, ResetBlockState& rows) {
  const Vec3<V> none{all(0), all(0), all(0)};
  for (int first = 0; first < sim::kLanes<Flown>; first += kWidth<Flown>) {
    const auto p = sim::load_rows<Parameters<V>>(block.parameters, first);
    auto x = sim::load_rows<State<V>>(block.state, first);
    const WingPose<V> left = place_wing<+1>(p.left, x.left, none), right = place_wing<-1>(p.right, x.right, none);
    const Vec3<V> momentum = left.momentum + right.momentum,
                  spin = angular_momentum(left, wing_inertia(p.left, left), p.left.shoulder_m) +
                         angular_momentum(right, wing_inertia(p.right, right), p.right.shoulder_m);
    if (interval_s > 0) {
      const V per_interval(1 / interval_s);
      store(per_interval * (x.impulse_N_s - (momentum - load(kept.momentum_kg_m_s, first))), rows.rows + kSpecificForce,
            first);
      store(per_interval * (x.angular_impulse_Nm_s - (spin - load(kept.angular_momentum_kg_m2_s, first))),
            rows.rows + kAngularAcceleration, first);
      x.left.stroke_rad.store(rows.rows[kStroke] + first);
      x.right.stroke_rad.store(rows.rows[kStroke + 1] + first);
      x.left.rotation_rad.store(rows.rows[kRotation] + first);
      x.right.rotation_rad.store(rows.rows[kRotation + 1] + first);
    }
    store(momentum, kept.momentum_kg_m_s, first);
    store(spin, kept.angular_momentum_kg_m2_s, first);
    x.impulse_N_s = none, x.angular_impulse_Nm_s = none;
    sim::store_rows(x, block.state, first);
  }
}

template <class Real>
void project_block(const Real* sample, const double* weights, int count, std::size_t width, Real* rows) {
  using Wide = Lanes<Real, kWidth<Real>>;
  const std::size_t n = width * kVehicles;
  for (int c = 0; c < count; ++c, rows += n) {
    const Wide weight(static_cast<Real>(weights[c]));
    for (std::size_t i = 0; i < n; i += kWidth<Real>) {
      const Wide sum = Wide::load(rows + i), value = Wide::load(sample + i);
      if constexpr (std::is_same_v<Real, Flown>) (sum + weight * value).store(rows + i);
      else (sum + Wide(weight * value)).store(rows + i);  // rounded before the sum, as BeatProjection::project does
    }
  }
}

}  // namespace

extern const ResetBlock reset_block_kernel;
const ResetBlock reset_block_kernel = reset_block;
extern const ClampedBlock clamped_block_kernel;
const ClampedBlock clamped_block_kernel = clamped_block;
extern const ProjectBlock<Flown> project_block_kernel;
const ProjectBlock<Flown> project_block_kernel = project_block<Flown>;
extern const ProjectBlock<double> project_meter_kernel;
const ProjectBlock<double> project_meter_kernel = project_block<double>;

}  // namespace FLAPPY_ISA
}  // namespace flappy::gap
