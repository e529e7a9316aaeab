#include "lab/blind/b/b_bench.hpp"

#include <algorithm>
#include <cmath>

#include "lab/blind/b/b_session.hpp"

namespace flappy::blind::b {
namespace {

constexpr std::uint64_t kBenchNumber = 2000;  ///< runs draw apart from flights and escapes
constexpr double kShift = 0.03;
// The safe part, in shares of the declared limits: about hover, which nominal robots do at 0.55 of the amplitude's.
constexpr std::array<double, 4> kMiddle = {0.55, 0, 0, 0}, kReach = {0.15, 0.5, 0.55, 0.5};
constexpr double kShortestStep_s = 0.06, kLongestStep_s = 0.14;  ///< two to five beats

}  // namespace

std::vector<std::array<double, 4>> bench_points(std::size_t run) {
  if (run == 0)
    return {{-0.8, 0, 0, 0}, {-0.4, 0, 0, 0},    {0, 0, 0, 0},        {0.4, 0, 0, 0},  {0.8, 0, 0, 0},
            {0, 0.5, 0, 0},  {0, -0.5, 0, 0},    {0, 0, 0.5, 0},      {0, 0, -0.5, 0}, {0, 0, 0, 0.5},
            {0, 0, 0, -0.5}, {0.4, 0.5, 0.5, 0}, {-0.4, -0.5, 0.5, 0}};
  if (run == 1)
    return {{-0.6, 0, 0, 0}, {-0.2, 0, 0, 0},     {0.2, 0, 0, 0},      {0, 1, 0, 0},
            {0, -1, 0, 0},   {0, 0, 1, 0},        {0, 0, -1, 0},       {0, 0, 0, 1},
            {0, 0, 0, -1},   {0.4, 0, -0.5, 0.5}, {0.4, 0.5, 0, -0.5}, {-0.4, 0, 0.5, -0.5}};
  return {{-1, 0, 0, 0},       {-0.5, 0, 0, 0},    {0, 0, 0, 0},        {0.6, 0, 0, 0},
          {1, 0, 0, 0},        {0, 0.75, 0.75, 0}, {0, -0.75, 0.75, 0}, {0, 0.75, 0, 0.75},
          {0, -0.75, 0, 0.75}, {0, 0, 0.75, 0.75}, {0, 0, -0.75, 0.75}, {0.5, -0.5, -0.5, -0.5}};
}

BenchProgramme::BenchProgramme(const Assignment& a, std::size_t run, const RobotParameters& f)
    : run_(run), points_(bench_points(run)) {
  const Shares limit = {f.amplitude_limit_V, f.difference_limit_V, f.bias_limit_V, f.split_cycle_limit};
  for (std::size_t i = 0; i < 4; ++i) middle_[i] = kMiddle[i] * limit[i], reach_[i] = kReach[i] * limit[i];
  Random random(a.seed, draw_number(kBenchNumber + run, programme_session(a)), Stream::kProgramme);
  for (Shares& point : points_)
    for (double& share : point) share += random.uniform(-kShift, kShift);
  for (double t = 0; t < kSweep_s; t += random.uniform(kShortestStep_s, kLongestStep_s))
    steps_.emplace_back(t, random.uniform(-1, 1));
}

Beat BenchProgramme::beat_of(const Shares& s) const {
  Shares u{};
  for (std::size_t i = 0; i < 4; ++i) u[i] = middle_[i] + reach_[i] * s[i];
  return {u[0], u[1], u[2], u[3]};
}

double BenchProgramme::point_begins_s(std::size_t point) const {
  return kAtRest_s + kRamp_s + kPoint_s * static_cast<double>(point);
}

double BenchProgramme::lasts_s() const { return point_begins_s(points_.size()) + kSweep_s; }

std::size_t BenchProgramme::filmed() const {
  // the ramp's end and the first points off its axis; then the combinations
  return run_ == 0 ? 3 : run_ == 2 ? 4 : points_.size();
}

BenchProgramme::Shares BenchProgramme::sweep(double time) const {
  const double done = time / kSweep_s;
  if (run_ == 0) return {-1 + 2 * done, 0, 0, 0};
  if (run_ == 1) {
    const double wave = std::sin(4 * kPi * done);  // once each
    return done < 0.5 ? Shares{0, 0, wave, 0} : Shares{0, wave, 0, 0};
  }
  double share = 0;
  for (const auto& [begins, to] : steps_)
    if (time >= begins) share = to;
  return {share, 0, 0, 0};
}

Beat BenchProgramme::inputs(double time) const {
  if (time < kAtRest_s) return {};
  const double since = time - kAtRest_s - kRamp_s + 1e-9;  // against rounding of the ticks' times
  if (since < 0) {
    const Beat b = beat_of(points_.front());
    const double k = (time - kAtRest_s) / kRamp_s;
    return {k * b.amplitude_V, k * b.difference_V, k * b.bias_V, k * b.split_cycle};
  }
  const auto point = static_cast<std::size_t>(since / kPoint_s);
  if (point < points_.size()) return beat_of(points_[point]);
  return beat_of(sweep(time - point_begins_s(points_.size())));
}

FamilyFlight run_on_bench(const Assignment& a, std::size_t run, double lasts_s) {
  Case c = make_case(a);
  c.room = {-kPlate_m, kBenchCeiling_m, kBenchWall_m};
  flightlog::FlightHeader& header = c.header;
  header.ambient.ground_z_m = c.room.ground_z_m;
  header.ambient.ceiling_z_m = c.room.ceiling_z_m;
  header.ambient.walls = {{0, c.room.wall_y_m, 0, -1}};
  header.mocap = {};
  header.imu = {};
  header.wings.reset();
  RigTruth rig = draw_rig(a, header.rig.emplace());
  if (a.session > 0) {
    const SessionChange by = draw_session(a.seed, a.session);
    rig.turn = turned(by.clamp_turn_rad) * rig.turn;
    rig.place_m += by.clamp_m;
  }
  const RobotParameters& f = c.parameters;
  const BenchProgramme programme(a, run, f);
  const std::uint64_t number = draw_number(kBenchNumber + run, a.session);
  Robot robot(f, c.effect_magnitudes, c.room, a.seed, number);
  robot.put(Vector3d::Zero(), 0);
  Sensors sensors(a, c.sensors, robot, number, kBenchRest_s, a.power, false);
  Radio radio(a.seed, number, c.effect_magnitudes[kCommandDropout], -kBenchRest_s);
  ForceSensor forces(rig, a.seed, number, -kBenchRest_s);
  const bool films = programme.filmed() < programme.points();
  const double film_from = programme.point_begins_s(programme.filmed());
  Film film(rig, a.seed, number, f.flapping_Hz, film_from, film_from + static_cast<double>(kFilmedPoints) * kPoint_s);
  if (films) header.wings = flightlog::WingsHeader{kFilm_hz, kFilmNoise_rad};

  const Twist rest{Vector3d::Zero(), Vector3d(0, 0, c.room.gravity_m_s2)};
  const Path clamped{{2, {0, 0, 0, 1}}, {2, rest}};
  FamilyFlight out;
  flightlog::CommandStream& command = out.log.command;
  command.inputs.emplace();
  command.phase_rad.emplace();
  const double end = std::min(lasts_s, programme.lasts_s());
  const long before = std::lround(kBenchRest_s / kTick_s), ticks = std::lround(end / kTick_s);
  // The first half of the rest lets the wings hang.
  for (long tick = -before; tick < ticks; ++tick) {
    if (tick == -before / 2 || tick == 0) forces.zero();
    const double now = static_cast<double>(tick) * kTick_s;
    const Beat sent = programme.inputs(now);
    if (tick >= 0) add_command(f, sent, now, kBenchRest_s, command);
    if (a.power) sensors.before_tick(robot, now);
    robot.drive(radio.arrived(sent, now), now + kBenchRest_s);
    for (int step = 1; step <= kStepsPerTick; ++step) {
      robot.led_step(clamped, 0);
      const double ends = now + step * kStep_s;
      forces.take(robot.felt().support * -1, ends - kStep_s);
      if (a.power) sensors.after_step(robot, ends, step);
      if (films && tick >= 0) film.take(robot.state(), tick * kStepsPerTick + step);
    }
  }
  out.log.header = header;
  if (a.power) sensors.write(end, out.log);
  out.log.imu = {};  // there is no IMU; the sensors wrote what it would have felt
  out.log.mocap = {};
  out.log.forces = forces.stream(end);
  if (films) out.log.wings = film.stream(end);
  return out;
}

}  // namespace flappy::blind::b
