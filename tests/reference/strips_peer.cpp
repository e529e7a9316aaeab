// Air on the wings of a vehicle of model = "jointed" at instants of its gait, for strips_peer_test.py to hold against a reference that shares no
// code. Arguments: a vehicle file. Each line of input: beat, velocity of the origin and body rate relative to the air, in B. Each line of output:
// force and moment about the shoulder in B, of the left and of the right wing. After the lines, the added masses of both sides.
#include <cstdio>
#include <iostream>

#include "flappy/vehicle_file.hpp"
#include "model/derive_jointed.hpp"
#include "model/jointed_dynamics.hpp"
#include "model/strip_aerodynamics.hpp"

namespace {

using namespace flappy::model;

template <int side>
void print_load(const Vehicle& vehicle, const JointedSide<double>& own, const Jointed::Wing& wing, double beat,
                const Vec3<double>& velocity, const Vec3<double>& rate) {
  const Moving<double> frequency{vehicle.jointed->frequency_Hz, 0, 0}, one{1, 0, 0};
  const BeatPhase<double> phase = untimed_phase(turn_of(beat), frequency);
  Moving<double> q[kJoints];
  for (int j = 0; j < kJoints; ++j) {
    const Jointed::Angle& a = wing.angles[static_cast<std::size_t>(j)];
    const auto at = [](const std::vector<double>& list, std::size_t k) { return k < list.size() ? list[k] : 0.0; };
    const Moving<double> g = harmonics(
        phase, std::max(a.cos_rad.size(), a.sin_rad.size()), [&](std::size_t k) { return at(a.cos_rad, k); },
        [&](std::size_t k) { return at(a.sin_rad, k); });
    q[j] = modulated(g, one, Moving<double>{a.mean_rad, 0, 0});
  }
  const JointedPose<double> pose = place_side<side>(own, q, rate);
  const Vec3<double> v = pose.to_wing(pose.to_E(velocity + cross(rate, own.shoulder_m)));
  const Vec3<double> w = pose.to_wing(pose.wing_rate);
  WingLoad<double> air = no_load<double>();
  const SeriesOfForce<double> series = derive_series(wing);
  for (const Strip<double>& strip : derive_strips(wing, vehicle.air_density_kg_m3, side))
    add_strip(strip, series, !wing.tangential_cos.empty(), v, w, air);
  add_pitching_drag(own, w.y, air);
  const Vec3<double> force = pose.to_B(pose.from_wing(air.force_N)), moment = pose.to_B(pose.from_wing(air.moment_Nm));
  std::printf("%.17g %.17g %.17g %.17g %.17g %.17g ", force.x, force.y, force.z, moment.x, moment.y, moment.z);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) return 2;
  const Vehicle vehicle = read_any_vehicle(argv[1]);
  const JointedParameters<double> p = derive_jointed(vehicle);
  for (double beat = 0; std::cin >> beat;) {
    Vec3<double> v{}, w{};
    std::cin >> v.x >> v.y >> v.z >> w.x >> w.y >> w.z;
    print_load<+1>(vehicle, p.left, vehicle.jointed->left, beat, v, w);
    print_load<-1>(vehicle, p.right, vehicle.jointed->right, beat, v, w);
    std::printf("\n");
  }
  for (const Sym3<double>& k : {p.left.added, p.right.added})
    std::printf("%.17g %.17g %.17g %.17g %.17g %.17g ", k.xx, k.yy, k.zz, k.xy, k.yz, k.xz);
  std::printf("\n");
}
