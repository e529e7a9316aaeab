#include "gap/evidence/model_error.hpp"

namespace flappy::gap {
namespace {

/// By harmonic: of the constant, of what changes with an input, and of velocities, plain and times their size, along x, y, z.
struct Shares {
  double steady[kHarmonics + 1], changing[kHarmonics + 1], velocity[3][kHarmonics + 1], square[3][kHarmonics + 1];
};
/// Of the torso's torques and forces, in the order of the channels.
constexpr Shares kShares[] = {
    // torque_x
    {{0.0013, 0.0060, 0.0038, 0.0021, 0.0106},
     {0.0007, 0.0009, 0.0011, 0.0017, 0.0017},
     {{0.0009, 0.0061, 0.0011, 0.0061, 0.0011},
      {0.0044, 0.0008, 0.0119, 0.0025, 0.0151},
      {0.0010, 0.0011, 0.0047, 0.0026, 0.0134}},
     {{0.0008, 0.0014, 0.0011, 0.0017, 0.0012},
      {0.0109, 0.0011, 0.0076, 0.0015, 0.0231},
      {0.0015, 0.0009, 0.0023, 0.0018, 0.0032}}},
    // torque_y
    {{0.0013, 0.0216, 0.0022, 0.0100, 0.0014},
     {0.0005, 0.0007, 0.0008, 0.0009, 0.0013},
     {{0.0082, 0.0006, 0.0147, 0.0009, 0.0038},
      {0.0019, 0.0036, 0.0014, 0.0012, 0.0010},
      {0.0006, 0.0046, 0.0009, 0.0171, 0.0030}},
     {{0.0008, 0.0007, 0.0020, 0.0008, 0.0018},
      {0.0006, 0.0045, 0.0010, 0.0036, 0.0014},
      {0.0005, 0.0021, 0.0009, 0.0032, 0.0015}}},
    // torque_z
    {{0.0014, 0.0026, 0.0017, 0.0011, 0.0009},
     {0.0005, 0.0006, 0.0005, 0.0006, 0.0007},
     {{0.0007, 0.0007, 0.0012, 0.0007, 0.0008},
      {0.0006, 0.0183, 0.0006, 0.0094, 0.0008},
      {0.0005, 0.0008, 0.0006, 0.0013, 0.0007}},
     {{0.0006, 0.0009, 0.0008, 0.0007, 0.0007},
      {0.0007, 0.0018, 0.0007, 0.0017, 0.0008},
      {0.0005, 0.0008, 0.0006, 0.0008, 0.0008}}},
    // force_x
    {{0.0009, 0.0116, 0.0016, 0.0063, 0.0030},
     {0.0006, 0.0005, 0.0006, 0.0006, 0.0006},
     {{0.0007, 0.0006, 0.0022, 0.0007, 0.0009},
      {0.0007, 0.0009, 0.0008, 0.0037, 0.0006},
      {0.0007, 0.0032, 0.0006, 0.0042, 0.0009}},
     {{0.0007, 0.0005, 0.0009, 0.0006, 0.0009},
      {0.0008, 0.0008, 0.0007, 0.0043, 0.0007},
      {0.0007, 0.0024, 0.0007, 0.0015, 0.0008}}},
    // force_y
    {{0.0010, 0.0079, 0.0022, 0.0068, 0.0085},
     {0.0008, 0.0011, 0.0006, 0.0012, 0.0013},
     {{0.0009, 0.0009, 0.0008, 0.0012, 0.0009},
      {0.0009, 0.0070, 0.0104, 0.0012, 0.0111},
      {0.0011, 0.0010, 0.0034, 0.0010, 0.0017}},
     {{0.0009, 0.0009, 0.0008, 0.0010, 0.0010},
      {0.0010, 0.0017, 0.0028, 0.0015, 0.0021},
      {0.0009, 0.0011, 0.0012, 0.0009, 0.0013}}},
    // force_z
    {{0.0097, 0.0054, 0.0241, 0.0082, 0.0077},
     {0.0006, 0.0010, 0.0009, 0.0011, 0.0011},
     {{0.0007, 0.0010, 0.0011, 0.0013, 0.0009},
      {0.0008, 0.0009, 0.0020, 0.0010, 0.0016},
      {0.0047, 0.0012, 0.0069, 0.0015, 0.0097}},
     {{0.0007, 0.0010, 0.0010, 0.0011, 0.0009},
      {0.0008, 0.0009, 0.0013, 0.0010, 0.0047},
      {0.0019, 0.0012, 0.0014, 0.0015, 0.0036}}},
};
/// Of other channels, whatever the harmonic; of strokes and motors no development robot told yet: a guess on the safe side.
struct Share {
  double steady, changing, velocity;
};
constexpr Share kDrive = {0.03, 0.004, 0.008}, kPath = {0.0019, 0.001, 0.002}, kTurn = {0.0006, 0.0006, 0.0006};
/// Against what changes with an input.
constexpr double kRate = 0.88, kProduct = 0.74, kPlace = 0.77;

double of_kind(Function f, double steady, double changing, auto&& velocity, auto&& square) {
  switch (f) {
    case Function::constant:
      return steady;
    case Function::input:
      return changing;
    case Function::rate:
      return kRate * changing;
    case Function::product:
      return kProduct * changing;
    case Function::place:
      return kPlace * changing;
    case Function::velocity_x:
    case Function::velocity_y:
    case Function::velocity_z:
      return velocity(static_cast<int>(f) - static_cast<int>(Function::velocity_x));
    case Function::square_x:
    case Function::square_y:
    case Function::square_z:
      return square(static_cast<int>(f) - static_cast<int>(Function::square_x));
  }
  return 0;
}

struct Background {
  const char* effect;
  double sd;
};
constexpr Background kBackground[] = {{"body_drag", 0.19},       {"wing_inertia", 0.18},    {"wake_capture", 0.1},
                                      {"coulomb_friction", 0.1}, {"stop_compliance", 0.06}, {"wing_flexibility", 0.05},
                                      {"tether", 0.04},          {"gear_backlash", 0.03},   {"driver_bandwidth", 0.025},
                                      {"added_mass", 0.025},     {"wing_damage", 0.02},     {"ceiling_effect", 0.02},
                                      {"battery_sag", 0.015}};
constexpr double kLeastBackground = 0.005;

}  // namespace

double mistaken_share(int channel, int h, Function f) {
  if (channel <= kForceZ) {
    const Shares& s = kShares[channel];
    return of_kind(
        f, s.steady[h], s.changing[h], [&](int axis) { return s.velocity[axis][h]; },
        [&](int axis) { return s.square[axis][h]; });
  }
  const Share& s = channel < kPathX ? kDrive : channel < kTurnX ? kPath : kTurn;
  const auto velocity = [&](int) { return s.velocity; };
  return of_kind(f, s.steady, s.changing, velocity, velocity);
}

double background_sd(const std::string& effect) {
  for (const Background& b : kBackground)
    if (b.effect == effect) return b.sd;
  return kLeastBackground;
}

}  // namespace flappy::gap
