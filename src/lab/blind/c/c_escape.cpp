// The goal is the task world's origin, heading 0, in mid-room, so the ground is at z = -1 there. The robot trims in
// hover, is moved to the episode's start, and holds this trim while the policy adds to it. Names of what the policy
// observes, in the pilot's view:
//   goal_rotation      body to the goal's heading frame; equals rotation_matrix, as the goal's heading is 0
//   rotation_matrix    body to world, row by row         position_error   position minus goal, W
//   velocity           W                                 body_rate        B
//   heading_error      heading minus the goal's: sine and cosine, as for beat_phase
//   time               since the start of the episode
//   trim               V, V, V, split cycle              previous_action  in these units too
#include "lab/blind/c/c_escape.hpp"

#include "lab/blind/c/c_session.hpp"

namespace flappy::blind::c {
namespace {

const Eigen::Vector3d kGoal_W(0, 0, 1);

bool within(const EscapeAssignment::Bounds& bounds, const Eigen::Vector3d& from_goal, const Eigen::Vector3d& velocity,
            const Eigen::Vector3d& rate, const Eigen::Matrix3d& R) {
  // a bound that is not positive does not apply
  const auto holds = [](double value, double bound) { return !(bound > 0) || value < bound; };
  return holds(from_goal.norm(), bounds.distance_m) && holds(velocity.norm(), bounds.speed_m_s) &&
         holds(rate.norm(), bounds.body_rate_rad_s) &&
         holds(std::acos(std::clamp(R(2, 2), -1.0, 1.0)), bounds.tilt_rad) &&
         holds(std::abs(heading_of(R)), bounds.heading_rad);
}

std::vector<double> observed(const std::vector<std::string>& names, const View& view, double phase, double t_s,
                             const Inputs& trim, const std::array<double, 4>& previous) {
  std::vector<double> all;
  const auto add = [&](std::initializer_list<double> values) { all.insert(all.end(), values); };
  const auto add3 = [&](const Eigen::Vector3d& v) { add({v.x(), v.y(), v.z()}); };
  static const std::vector<std::string> known = {"goal_rotation", "rotation_matrix", "position_error", "velocity",
                                                 "body_rate",     "heading_error",   "beat_phase",     "time",
                                                 "trim",          "previous_action"};
  for (const std::string& name : names) {
    if (name == "goal_rotation" || name == "rotation_matrix")
      for (int i = 0; i < 3; ++i) add({view.R_WB(i, 0), view.R_WB(i, 1), view.R_WB(i, 2)});
    else if (name == "position_error") add3(view.position_W - kGoal_W);
    else if (name == "velocity") add3(view.velocity_W);
    else if (name == "body_rate") add3(view.rate_B);
    else if (name == "heading_error") add({std::sin(heading_of(view.R_WB)), std::cos(heading_of(view.R_WB))});
    else if (name == "beat_phase") add({std::sin(2 * M_PI * phase), std::cos(2 * M_PI * phase)});
    else if (name == "time") add({t_s});
    else if (name == "trim") add({trim.amplitude_V, trim.difference_V, trim.bias_V, trim.split_cycle});
    else if (name == "previous_action") add({previous[0], previous[1], previous[2], previous[3]});
    else throw io::InputError("observation " + name + ": family C has no such part" + io::did_you_mean(name, known));
  }
  return all;
}

}  // namespace

FamilyEscape escape_of(const Assignment& a, std::size_t number, const EscapeAssignment& rules, double trim_s) {
  observed(rules.observation, {}, 0, 0, {}, {});  // throws for an unknown part before anything is flown
  const std::size_t stream = 1000 + number;
  Robot robot(a, stream);
  const RobotParameters& f = robot.parameters();
  const double tick_s = f.hold_s;
  Pilot pilot(f, a, stream);
  Sensors sensors(a, stream, robot, sensor_parameters(a, robot));
  Random random(a.seed, "escape", programme_stream_of(a, number));
  Eigen::Vector3d start;
  for (std::size_t i = 0; i < 3; ++i)
    start[static_cast<int>(i)] = rules.start_m[i] + rules.start_half_m[i] * random.uniform(-1, 1);
  start.x() = std::clamp(start.x(), rules.x_low_m, rules.x_high_m);
  const double heading = rules.heading_rad + rules.heading_half_rad * random.uniform(-1, 1);

  FamilyEscape escape;
  Target target;
  target.position_W = kGoal_W + start;
  target.heading_rad = heading;
  robot.mechanism().place(target.position_W, Eigen::Quaterniond(Eigen::AngleAxisd(heading, Eigen::Vector3d::UnitZ())));
  const double until_s = rules.keep_until_s > 0 ? rules.keep_until_s : 3;
  const long before = std::lround(trim_s / tick_s), after = std::lround(until_s / tick_s),
             period = std::max(1L, std::lround(rules.action_period_s / tick_s));
  Inputs trim, mean_trim;
  std::array<double, 4> action{};
  bool policy_flies = true, kept = true;
  double end_s = 0;
  for (long tick = -before; tick < after; ++tick) {
    const double t_s = static_cast<double>(tick) * tick_s, phase = beat_phase(t_s, f.flapping_Hz);
    if (tick == 0) {  // removes the drift of the hover: the episode starts exactly at the drawn pose
      const Motion now = robot.mechanism().motion();
      const Eigen::Vector3d shift = target.position_W - now.position_W;
      const double turn = wrapped(heading - heading_of(now.R_WB));
      Motion moved = now;
      const Eigen::Matrix3d about = Eigen::AngleAxisd(turn, Eigen::Vector3d::UnitZ()).toRotationMatrix();
      moved.position_W = target.position_W;
      moved.velocity_W = about * now.velocity_W;
      moved.q_WB = Eigen::Quaterniond(Eigen::AngleAxisd(turn, Eigen::Vector3d::UnitZ())) * now.q_WB;
      robot.mechanism().move_torso(moved);
      pilot.carry(now.position_W, turn, shift);
      trim = mean_trim;
      target = {};
      target.position_W = kGoal_W;
    }
    pilot.look(robot.mechanism().motion(), tick_s);
    const View& view = pilot.view();
    Inputs inputs;
    if (tick >= 0 && policy_flies &&
        (t_s >= rules.hand_back_at_s ||
         (tick > 0 && within(rules.hand_back, view.position_W - kGoal_W, view.velocity_W, view.rate_B, view.R_WB))))
      policy_flies = false;
    if (tick >= 0 && policy_flies) {
      if (tick % period == 0) action = rules.policy(observed(rules.observation, view, phase, t_s, trim, action));
      inputs = clipped({trim.amplitude_V + action[0], trim.difference_V + action[1], trim.bias_V + action[2],
                        trim.split_cycle + action[3]},
                       f);
    } else {
      inputs = pilot.fly(target, tick_s);
      const Inputs now = pilot.trim();  // averaged over about the last second
      const double share = tick_s / 1.0;
      if (tick == -before) mean_trim = now;
      mean_trim.amplitude_V += share * (now.amplitude_V - mean_trim.amplitude_V);
      mean_trim.difference_V += share * (now.difference_V - mean_trim.difference_V);
      mean_trim.bias_V += share * (now.bias_V - mean_trim.bias_V);
      mean_trim.split_cycle += share * (now.split_cycle - mean_trim.split_cycle);
    }
    const std::array<double, 2> voltages = beat_voltages(inputs, phase, f);
    if (tick >= 0) add_command(escape.log.command, t_s, voltages, inputs, phase);
    std::size_t step = 0;
    robot.tick(voltages, [&] { sensors.after_step(robot, t_s + static_cast<double>(++step) * robot.step_s()); });
    end_s = t_s + tick_s;
    if (!trouble(robot, true).empty()) {
      escape.crashed = true;
      break;
    }
    if (tick < 0) continue;
    const Motion now = robot.mechanism().motion();
    const Eigen::Vector3d from_goal = now.position_W - kGoal_W;
    if (escape.captured_s == 0 && end_s <= rules.capture_by_s + 1e-9 &&
        within(rules.capture, from_goal, now.velocity_W, now.rate_B, now.R_WB))
      escape.captured_s = end_s;
    if (end_s >= rules.keep_from_s && end_s <= rules.keep_until_s + 1e-9 &&
        !within(rules.keep, from_goal, now.velocity_W, now.rate_B, now.R_WB))
      kept = false;
  }
  escape.success = !escape.crashed && escape.captured_s > 0 && kept;
  sensors.finish(escape.log, end_s);
  flightlog::LogAmbient& room = escape.log.header.ambient;
  room.ground_z_m -= kGoal_W.z();
  room.ceiling_z_m -= kGoal_W.z();
  for (double& z : escape.log.mocap.z_m) z -= kGoal_W.z();
  return escape;
}

}  // namespace flappy::blind::c
