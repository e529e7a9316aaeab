#include "lab/blind/b/b_escape.hpp"

#include <algorithm>
#include <cmath>

#include "io/files.hpp"
#include "lab/blind/b/b_flight.hpp"

namespace flappy::blind::b {
namespace {

/// In the middle of the room, far from all surfaces.
const Vector3d kGoal_m(0, 0, 1);

/// By the parts' names in task files, relative to the goal, whose heading is 0.
std::vector<double> observed(const std::vector<std::string>& names, const View& view, double beat_phase, double time,
                             const Beat& trim, const std::array<double, 4>& added) {
  std::vector<double> out;
  const Matrix3d R = view.attitude.toRotationMatrix();
  const auto vector = [&](const Vector3d& v) { out.insert(out.end(), {v.x(), v.y(), v.z()}); };
  const double heading = heading_of(view.attitude);
  for (const std::string& name : names) {
    if (name == "rotation_matrix" || name == "goal_rotation") {  // row by row; equal, as the goal's heading is 0
      for (int i = 0; i < 3; ++i) vector(R.row(i).transpose());
    } else if (name == "position_error") {
      vector(view.position_m - kGoal_m);
    } else if (name == "velocity") {
      vector(view.velocity_m_s);
    } else if (name == "body_rate") {
      vector(view.rate_rad_s);
    } else if (name == "beat_phase") {
      out.insert(out.end(), {std::sin(beat_phase), std::cos(beat_phase)});
    } else if (name == "heading_error") {
      out.insert(out.end(), {std::sin(heading), std::cos(heading)});
    } else if (name == "previous_action") {
      out.insert(out.end(), added.begin(), added.end());
    } else if (name == "time") {
      out.push_back(time);
    } else if (name == "trim") {
      out.insert(out.end(), {trim.amplitude_V, trim.difference_V, trim.bias_V, trim.split_cycle});
    } else {
      const std::vector<std::string> known = {
          "rotation_matrix", "goal_rotation", "position_error",  "velocity", "body_rate",
          "beat_phase",      "heading_error", "previous_action", "time",     "trim"};
      throw io::InputError("observation " + name + ": nothing of this name is seen; accepted: " + io::joined(known) +
                           io::did_you_mean(name, known));
    }
  }
  return out;
}

struct Standing {
  double distance_m, speed_m_s, body_rate_rad_s, tilt_rad, heading_rad;
};

Standing standing(const Vector3d& position, const Vector3d& velocity, const Vector3d& rate,
                  const Eigen::Quaterniond& attitude) {
  const double up = (attitude * Vector3d::UnitZ()).z();
  return {(position - kGoal_m).norm(), velocity.norm(), rate.norm(), std::acos(std::clamp(up, -1.0, 1.0)),
          std::abs(heading_of(attitude))};
}

bool within(const Standing& s, const EscapeAssignment::Bounds& b) {
  // A bound of 0 or less is not applied.
  const auto held = [](double value, double bound) { return bound <= 0 || value <= bound; };
  return held(s.distance_m, b.distance_m) && held(s.speed_m_s, b.speed_m_s) &&
         held(s.body_rate_rad_s, b.body_rate_rad_s) && held(s.tilt_rad, b.tilt_rad) &&
         held(s.heading_rad, b.heading_rad);
}

}  // namespace

FamilyEscape fly_escape(const Assignment& a, std::size_t number, const EscapeAssignment& rules, double trim_s) {
  const Case c = make_case(a);
  const std::uint64_t flight = draw_number(1000 + number, a.session);
  Random random(a.seed, draw_number(1000 + number, programme_session(a)), Stream::kStart);
  Vector3d start;
  for (std::size_t k = 0; k < 3; ++k)
    start[static_cast<Eigen::Index>(k)] = rules.start_m[k] + rules.start_half_m[k] * random.uniform(-1, 1);
  start.x() = std::clamp(start.x(), rules.x_low_m, rules.x_high_m);
  start += kGoal_m;
  const double heading = wrapped(rules.heading_rad + rules.heading_half_rad * random.uniform(-1, 1));
  Flight flown(a, c, flight, start, heading, trim_s);
  observed(rules.observation, flown.view(), 0, 0, flown.pilot().trim(),
           {});  // throws for an unknown name before anything is flown

  FamilyEscape out;
  Beat beat;
  std::array<double, 4> added{};
  bool handed_back = false, kept = true;
  double next_action = 0;
  const double end = std::max(rules.keep_until_s, rules.capture_by_s);
  while (flown.time_s() < end - 1e-9) {
    const double now = flown.time_s();
    if (flown.steers_now()) {
      const View& view = flown.view();
      if (now < -1e-9) {
        beat = flown.pilot().steer(view, {start, Vector3d::Zero(), heading});
      } else {
        const bool there =
            rules.hand_back.distance_m > 0 &&
            within(standing(view.position_m, view.velocity_m_s, view.rate_rad_s, view.attitude), rules.hand_back);
        handed_back = handed_back || there || (rules.hand_back_at_s > 0 && now >= rules.hand_back_at_s - 1e-9);
        if (handed_back) {
          beat = flown.pilot().steer(view, {kGoal_m, Vector3d::Zero(), 0});
        } else {
          const Beat trim = flown.pilot().trim();
          if (now >= next_action - 1e-9) {
            const double phase = 2 * kPi * (now + trim_s) * c.parameters.flapping_Hz;
            added = rules.policy(observed(rules.observation, view, phase, now, trim, added));
            for (double& u : added)
              if (!std::isfinite(u)) u = 0;
            next_action += rules.action_period_s;
          }
          beat = {trim.amplitude_V + added[0], trim.difference_V + added[1], trim.bias_V + added[2],
                  trim.split_cycle + added[3]};
        }
      }
    }
    const std::string how = flown.tick(beat, true);  // may tumble: an escape is a somersault
    if (!how.empty()) {
      out.crashed = true;
      break;
    }
    const double t = flown.time_s();
    if (t < 0) continue;
    const State& x = flown.robot().state();
    const Eigen::Quaterniond attitude(x[kQuaternion], x[kQuaternion + 1], x[kQuaternion + 2], x[kQuaternion + 3]);
    const Standing s = standing(flown.robot().position(), flown.robot().velocity_W(), flown.robot().rate(), attitude);
    if (out.captured_s == 0 && within(s, rules.capture)) out.captured_s = t;
    if (t >= rules.keep_from_s && t <= rules.keep_until_s && !within(s, rules.keep)) kept = false;
  }
  out.success = !out.crashed && kept && out.captured_s > 0 && out.captured_s <= rules.capture_by_s;
  out.log = flown.log(std::max(flown.time_s(), 0.0));
  return out;
}

}  // namespace flappy::blind::b
