#include "check_flown.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <limits>
#include <nlohmann/json.hpp>

#include "deploy/flown/flown.hpp"
#include "deploy/flown/inferences.hpp"
#include "deploy/header/controller_header.hpp"
#include "deploy/header/exported_files.hpp"
#include "flightlog/check/digits.hpp"
#include "flightlog/flight_log.hpp"
#include "io/files.hpp"
#include "io/temporary_folder.hpp"
#include "io/text.hpp"
#include "learn/run_folder.hpp"

namespace flappy::gap {
namespace {

using Json = nlohmann::ordered_json;

[[noreturn]] void refuse(const std::string& folder, const std::string& what, const std::string& accepted) {
  throw io::InputError(folder + "/flight.toml: " + what + "; accepted: " + accepted);
}

/// Writes what a check needs of the export of a finished run.
void export_run(const std::string& folder, const std::filesystem::path& to) {
  const learn::FinishedRun run = learn::read_finished_run(folder);
  if (const std::string why = deploy::no_controller(run.fly); !why.empty())
    throw io::InputError(folder + ": has no controller to export: " + why +
                         "; accepted: a run whose controller flappy-export writes");
  for (const auto& [name, text] : deploy::exported_files(run.fly, run.info)) io::write_atomically(to / name, text);
}

/// Refuses times of [flown] that are none of this flight.
void check_times(const std::string& folder, const flightlog::FlownHeader& flown, const flightlog::CommandStream& c) {
  constexpr double kBefore_s = 600;
  const double first_s = c.t_s.front(), last_s = c.t_s.back();
  const auto within = [&](const char* key, double t_s, double low, double high) {
    if (!(t_s >= low && t_s <= high))
      refuse(folder, io::format("flown.%s: %g s is no time of this flight", key, t_s),
             io::format("%g to %g", low, high));
  };
  within("start_s", flown.start_s, first_s - kBefore_s, last_s);
  if (flown.begin_s) within("begin_s", *flown.begin_s, flown.start_s, last_s + kBefore_s);
  if (flown.hand_back_s)
    within("hand_back_s", *flown.hand_back_s, flown.begin_s.value_or(flown.start_s), last_s + kBefore_s);
  if (!flown.start_pose) return;
  const auto& p = *flown.start_pose;
  const double length = std::sqrt(p[3] * p[3] + p[4] * p[4] + p[5] * p[5] + p[6] * p[6]);
  if (std::abs(length - 1) > 1e-3)
    refuse(folder, io::format("flown.start_pose: its quaternion has length %g", length), "1 to within 0.001");
}

/// Names of OnboardLog::Mode.
constexpr std::array<const char*, 3> kModes = {"hover", "stay", "task"};

/// Time of a log at which the robot's controller was started.
double start_of(const flightlog::FlightLog& log) {
  return log.header.flown ? log.header.flown->start_s : log.command.t_s.front();
}

/// Adds what the log has of what the policy got and gave.
void add_inferences(deploy::OnboardLog& to, const std::string& folder, const flightlog::FlightLog& log,
                    const deploy::Contract& contract) {
  const flightlog::FlightHeader& h = log.header;
  const double zero_s = start_of(log);
  if (!log.policy) return;
  std::vector<std::string> known;
  for (const auto& s : contract.observation) known.push_back("observation_" + s.name);
  for (const auto& s : contract.action) known.push_back("action_" + s.name);
  for (std::size_t k = 0; k < h.policy.size(); ++k) {
    const auto found = std::ranges::find(known, h.policy[k]);
    if (found == known.end())
      refuse(folder, "policy.numbers: \"" + h.policy[k] + "\" is no number of this policy",
             io::joined(known) + io::did_you_mean(h.policy[k], known));
    to.policy_numbers.push_back(static_cast<std::size_t>(found - known.begin()));
    to.policy_steps.push_back(flightlog::last_digit(log.policy->numbers[k]));
  }
  for (std::size_t i = 0; i < log.policy->t_s.size(); ++i) {
    deploy::OnboardLog::Inference& row = to.inferences.emplace_back();
    row.t_s = log.policy->t_s[i] - zero_s;
    for (const flightlog::Column& numbers : log.policy->numbers) row.numbers.push_back(numbers[i]);
  }
}

/// The inputs as they were set at or after each inference, up to the next.
std::vector<deploy::LoggedInput> logged_inputs(const flightlog::FlightLog& log, const deploy::OnboardLog& onboard) {
  std::vector<deploy::LoggedInput> all;
  const std::vector<double>& t_s = log.command.t_s;
  for (std::size_t k = 0; k < log.header.inputs.size(); ++k) {
    deploy::LoggedInput& input = all.emplace_back(deploy::LoggedInput{log.header.inputs[k], {}});
    for (const deploy::OnboardLog::Inference& row : onboard.inferences) {
      const auto after = std::ranges::lower_bound(t_s, row.t_s + start_of(log) - 1e-6);
      const auto at = std::min<std::ptrdiff_t>(after - t_s.begin(), static_cast<std::ptrdiff_t>(t_s.size()) - 1);
      input.value.push_back(log.command.declared[k][static_cast<std::size_t>(at)]);
    }
  }
  return all;
}

/// What a person reads of a robot with inputs.
std::string sentence(const deploy::Inferences& f) {
  std::string text = io::format("%zu of %zu inferences are the exported policy's", f.same, f.rows);
  if (f.same < f.rows)
    text += io::format(" (%s differs by up to %.1f %% of its range)", f.output.c_str(), 100 * f.largest);
  for (const auto& i : f.inputs)
    text += io::format("; %s follows it in %.1f %%", i.name.c_str(), 100 * i.share) +
            (i.follows() ? "" : io::format(" (set %+.3g off, median)", i.offset));
  return (f.as_exported() ? "the robot flew what was exported: " : "the robot did not fly what was exported: ") + text;
}

/// The flight as it passed the robot's processor, from its start on: at t = 0.
deploy::OnboardLog onboard(const std::string& folder, const flightlog::FlightLog& log,
                           const deploy::Contract& contract) {
  const flightlog::FlightHeader& h = log.header;
  if (!h.inputs.empty())
    refuse(folder, "has declared inputs, which no exported controller sets", "a log with voltages");
  const double zero_s = start_of(log);
  if (h.flown) check_times(folder, *h.flown, log.command);
  deploy::OnboardLog to;
  to.imu_latency_s = h.imu.latency_s;
  to.pose_latency_s = h.mocap.latency_s;
  to.imu_Hz = h.imu.rate_hz;
  for (std::size_t i = 0; i < log.imu.t_s.size(); ++i)
    to.imu.push_back({log.imu.t_s[i] - zero_s,
                      {log.imu.gyro_x_rad_s[i], log.imu.gyro_y_rad_s[i], log.imu.gyro_z_rad_s[i]},
                      {log.imu.accel_x_m_s2[i], log.imu.accel_y_m_s2[i], log.imu.accel_z_m_s2[i]}});
  const flightlog::MocapStream& m = log.mocap;
  for (std::size_t i = 0; i < m.t_s.size(); ++i)
    to.poses.push_back({m.t_s[i] - zero_s, {m.x_m[i], m.y_m[i], m.z_m[i]}, {m.qw[i], m.qx[i], m.qy[i], m.qz[i]}});
  const flightlog::CommandStream& c = log.command;
  for (std::size_t i = 0; i < c.t_s.size(); ++i)
    to.commands.push_back({c.t_s[i] - zero_s, c.left_voltage_V[i], c.right_voltage_V[i]});
  if (h.flown) {
    to.start_pose = h.flown->start_pose;
    for (const double x : h.flown->start_memory) to.start_memory.push_back(static_cast<float>(x));
    to.start_phase = h.flown->start_phase;
    if (h.flown->imu_latency_s) to.imu_latency_s = *h.flown->imu_latency_s;
    if (!h.flown->mode.empty())
      to.mode = static_cast<deploy::OnboardLog::Mode>(std::ranges::find(kModes, h.flown->mode) - kModes.begin());
    if (h.flown->begin_s) to.begin_s = *h.flown->begin_s - zero_s;
    if (h.flown->hand_back_s) to.hand_back_s = *h.flown->hand_back_s - zero_s;
  }
  using flightlog::last_digit;
  add_inferences(to, folder, log, contract);
  // a double of a clock that counts from 1970 has a quarter of a microsecond at best
  to.time_noise_s = 2 * std::numeric_limits<double>::epsilon() * std::abs(zero_s);
  to.time_step_s = std::max({last_digit(log.imu.t_s), last_digit(m.t_s), 4 * to.time_noise_s});
  to.rate_step_rad_s = last_digit(log.imu.gyro_x_rad_s);
  to.force_step_m_s2 = last_digit(log.imu.accel_z_m_s2);
  to.position_step_m = last_digit(m.x_m);
  to.attitude_step = last_digit(m.qx);
  to.voltage_step_V = last_digit(c.left_voltage_V);
  return to;
}

std::string percent(double share) { return io::format("%.2f %%", 100 * share); }

/// What a person reads.
std::string sentence(const deploy::Flown& f) {
  if (f.as_exported)
    return "the robot flew what was exported (" + percent(f.share) + " of the commands within " +
           io::format("%.2g V", f.tolerance_V) + ")";
  std::string text = "the robot did not fly what was exported, from " + io::format("%.3f s", f.from_s) + " on: ";
  if (f.mistakes.empty()) return text + "no mistake explains it; it differs in " + f.unexplained;
  for (std::size_t i = 0; i < f.mistakes.size(); ++i) text += (i > 0 ? ", and " : "") + f.mistakes[i].words;
  return f.explained > 0 ? text + " (" + percent(f.explained) + " of the commands)" : text;
}

}  // namespace

Json check_flown(const std::string& exported, const std::vector<std::string>& folders) {
  const io::TemporaryFolder made;
  const bool is_run = std::filesystem::exists(std::filesystem::path(exported) / "run.json");
  if (is_run) export_run(exported, made / "");
  const deploy::FlownCheck check(is_run ? made / "" : std::filesystem::path(exported));
  Json flights = Json::array();
  bool all = true;
  for (const std::string& folder : folders) {
    const flightlog::FlightLog log = flightlog::read_flight_log(folder);
    flightlog::require_flown(log, folder);
    const auto& header = log.header.flown;
    if (header) {
      const auto compare = [&](const char* what, std::optional<std::uint32_t> flew, std::uint32_t is) {
        if (flew && *flew != is)
          std::printf("%s: the log says that another %s flew: %u, and %s has %u\n", folder.c_str(), what, *flew,
                      exported.c_str(), is);
      };
      compare("policy", header->policy_crc32, check.contract().policy_crc32);
      compare("controller", header->controller_crc32, check.contract().controller_crc32);
    }
    if (!check.contract().inputs.empty()) {
      if (log.header.inputs.empty())
        refuse(folder, "has voltages, and the export is for a robot with inputs", "a log with declared inputs");
      deploy::OnboardLog got;
      add_inferences(got, folder, log, check.contract());
      const deploy::Inferences f =
          deploy::check_inferences(check.folder(), check.contract(), got, logged_inputs(log, got));
      std::printf("%s: %s\n", folder.c_str(), sentence(f).c_str());
      Json inputs = Json::array();
      for (const auto& i : f.inputs) inputs.push_back({{"name", i.name}, {"share", i.share}, {"offset", i.offset}});
      flights.push_back({{"folder", folder},
                         {"as_exported", f.as_exported()},
                         {"inferences", f.rows},
                         {"same", f.same},
                         {"inputs", inputs}});
      all = all && f.as_exported();
      continue;
    }
    if (header && !header->start_memory.empty() && header->start_memory.size() != check.remembered())
      refuse(folder,
             io::format("flown.start_memory: %zu numbers, and the exported controller remembers %zu",
                        header->start_memory.size(), check.remembered()),
             "a log of a flight under the controller that was exported");
    deploy::Flown f = check.check(onboard(folder, log, check.contract()));
    f.from_s += start_of(log);
    if (f.begin_s) *f.begin_s += start_of(log);
    std::printf("%s: %s\n", folder.c_str(), sentence(f).c_str());
    const char* mode = kModes[static_cast<std::size_t>(f.mode)];
    const auto taken = [&](const std::string& what, const std::string& as) {
      std::printf("%s: %s is missing: taken for %s\n", folder.c_str(), what.c_str(), as.c_str());
    };
    if (!header) taken("[flown]", "one that starts with the first command");
    if (!header || header->mode.empty()) taken("flown.mode", "\"" + std::string(mode) + "\"");
    if (f.begin_s && (!header || !header->begin_s)) taken("flown.begin_s", io::format("%.3f", *f.begin_s));
    Json mistakes = Json::array();
    for (const deploy::FlownMistake& m : f.mistakes)
      mistakes.push_back({{"kind", name_of(m.stage)}, {"mistake", m.id}, {"words", m.words}});
    flights.push_back({{"folder", folder},
                       {"as_exported", f.as_exported},
                       {"share", f.share},
                       {"tolerance_V", f.tolerance_V},
                       {"from_s", f.from_s},
                       {"mode", mode},
                       {"begin_s", f.begin_s ? Json(*f.begin_s) : Json()},
                       {"mistakes", mistakes},
                       {"explained", f.explained},
                       {"unexplained", f.unexplained}});
    all = all && f.as_exported;
  }
  return {{"exported", exported}, {"as_exported", all}, {"flights", flights}};
}

}  // namespace flappy::gap
