#include "deploy/header/contract.hpp"

#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <sstream>

#include "deploy/header/c_text.hpp"
#include "io/files.hpp"
#include "model/derive.hpp"
#include "model/jointed.hpp"

namespace flappy::deploy {
namespace {

using flight::Signal;
using rollout::FlyConfig;

long whole_us(const char* what, double seconds) {
  const double us = seconds * 1e6;
  if (std::abs(us - std::round(us)) > 1e-6 * us)
    throw io::InputError(std::string(what) + " of " + io::shortest_digits(seconds) +
                         " s is no whole number of microseconds, in which headers count; accepted: one that is");
  return std::lround(us);
}

void list(std::ostringstream& text, const char* title, const std::vector<Signal>& signals) {
  char line[160];
  std::snprintf(line, sizeof line, "  %-3s %-22s %-7s %-12s %s\n", "", title, "unit", "range", "frame");
  text << line;
  for (std::size_t i = 0; i < signals.size(); ++i) {
    const Signal& s = signals[i];
    const std::string range = io::shortest_digits(s.low) + " to " + io::shortest_digits(s.high);
    std::snprintf(line, sizeof line, "  %3zu %-22s %-7s %-12s %s", i, s.name.c_str(), s.unit.c_str(), range.c_str(),
                  s.frame.c_str());
    std::string trimmed = line;
    trimmed.erase(trimmed.find_last_not_of(' ') + 1);
    text << trimmed << "\n";
  }
}

nlohmann::ordered_json json_of(const std::vector<Signal>& signals) {
  auto list = nlohmann::ordered_json::array();
  for (const Signal& s : signals)
    list.push_back({{"name", s.name},
                    {"unit", s.unit},
                    {"frame", s.frame},
                    {"positive", s.positive},
                    {"low", s.low},
                    {"high", s.high}});
  return list;
}

nlohmann::ordered_json json_of(const std::vector<model::BeatAveraged::Input>& inputs) {
  auto list = nlohmann::ordered_json::array();
  for (const auto& i : inputs)
    list.push_back({{"name", i.name}, {"neutral", i.neutral}, {"mix", i.mix}, {"low", i.low}, {"high", i.high}});
  return list;
}

/// Rows of `width` numbers.
nlohmann::ordered_json rows_of(const std::vector<float>& numbers, std::size_t width) {
  auto rows = nlohmann::ordered_json::array();
  for (std::size_t i = 0; i + width <= numbers.size(); i += width)
    rows.push_back(std::vector<float>(numbers.begin() + static_cast<std::ptrdiff_t>(i),
                                      numbers.begin() + static_cast<std::ptrdiff_t>(i + width)));
  return rows;
}

bool holds_trim(const FlyConfig& config) { return config.fleet.task.constants.holds_trim > 0; }
bool sets_voltages(const FlyConfig& config) { return config.fleet.task.sets_voltages(); }

std::string meaning_of_action(const FlyConfig& config) {
  if (sets_voltages(config)) return "It is the voltage of the left and of the right motor.\n";
  std::string inputs;  // how the vehicle computes its inputs from the actions
  if (const auto mixed = model::mixed_inputs(config.vehicle); !mixed.empty()) {
    const auto actions = config.fleet.task.action();
    for (const model::BeatAveraged::Input& i : mixed) {
      inputs += i.name + " = " + io::shortest_digits(i.neutral);
      for (std::size_t k = 0; k < i.mix.size(); ++k)
        if (i.mix[k] != 0) inputs += " + " + io::shortest_digits(i.mix[k]) + " " + actions[k].name;
      inputs += ", within " + io::shortest_digits(i.low) + " to " + io::shortest_digits(i.high) + "\n";
    }
    inputs = "The robot's inputs are\n" + inputs;
  }
  if (config.fleet.controller.kind == flight::kNoController)
    return "It is all that flies the robot: no controller adds to it.\n" + inputs;
  if (!inputs.empty()) return "The action is added to the output of the feedback controller.\n" + inputs;
  const std::string beats =
      "The wings beat at " + io::shortest_digits(config.vehicle.driver.flapping_Hz) + " Hz. The action is added to\n";
  return beats + (holds_trim(config)
                      ? "the trim that the feedback controller has learnt and, while the policy acts, holds.\n"
                      : "the output of the feedback controller, which goes on flying.\n");
}

}  // namespace

Periods periods_of(const FlyConfig& config) {
  const double control_s = 1 / config.fleet.control_hz;
  return {whole_us("a control period", control_s),
          whole_us("a policy's period", control_s * config.fleet.task.action_repeat),
          whole_us("the driver's hold",
                   config.vehicle.beat_averaged || config.vehicle.jointed ? control_s : config.vehicle.driver.hold_s)};
}

std::string contract_text(const FlyConfig& config, const policy::RunInfo& run) {
  const Periods p = periods_of(config);
  std::ostringstream text;
  text << "Format " << kHeaderFormat << ", task " << run.task << ", of the configuration with SHA-256\n"
       << run.config_sha256 << ",\ntrained by commit " << run.commit << (run.dirty ? " and uncommitted changes" : "")
       << ".\n\n"
       << "A control period takes " << p.control_us << " us; the policy acts every " << p.policy_us << " us and its\n"
       << "action stays until the next. " << meaning_of_action(config)
       << "\nFrames: world W (x, y level, z up), body B (x forward, y left, z up, at the torso's origin). R_xy is row "
          "x,\n"
       << "column y of the rotation matrix from B to W. Errors and velocities are estimate minus set point.\n"
       << (sets_voltages(config)
               ? "previous_* is the last action; strokes and their rates are those of encoders on the wings.\n"
               : "added_* is what the last action added, trim_* what the controller has learnt to hold.\n")
       << "Ranges are those expected; other values are allowed.\n\n";
  if (config.actor && config.actor->recurrent)
    text << "It remembers " << config.actor->widths[1]
         << " numbers from inference to inference: flappy_policy_reset() before each task, then\n"
         << "flappy_policy_step_with().\n\n";
  list(text, "observation", config.fleet.task.observation());
  text << "\n";
  list(text, "action", config.fleet.task.action());
  return text.str();
}

std::uint32_t contract_crc32(const FlyConfig& config) {
  const Periods p = periods_of(config);
  std::ostringstream text;
  text << kHeaderFormat << "\n"
       << config.fleet.task.name << "\n"
       << p.control_us << " " << p.policy_us << "\n"
       << holds_trim(config) << "\n";
  if (config.actor && config.actor->recurrent) text << "memory " << config.actor->widths[1] << "\n";
  for (const auto& signals : {config.fleet.task.observation(), config.fleet.task.action()})
    for (const Signal& s : signals) text << s.name << " " << s.unit << " " << s.frame << "\n";
  std::vector<float> letters;  // one number per letter, because only equality matters
  for (const char c : text.str()) letters.push_back(c);
  return crc32(0, letters);
}

std::uint32_t crc_of_header(const std::string& text) {
  const std::string key = "_CRC32 ";
  return static_cast<std::uint32_t>(std::stoul(text.substr(text.find(key) + key.size())));
}

std::string contract_json(const FlyConfig& config, const policy::RunInfo& run, const policy::PolicyNetwork& network,
                          const policy::PolicyVectors& vectors, const ExportedCrc& crc) {
  const Periods p = periods_of(config);
  const flight::Task& task = config.fleet.task;
  const flight::Sensors& s = config.fleet.sensors;
  nlohmann::ordered_json json = {
      {"schema", 1},
      {"task", run.task},
      {"config_sha256", run.config_sha256},
      {"commit", run.commit},
      {"dirty", run.dirty},
      {"contract_crc32", contract_crc32(config)},
      {"policy_crc32", crc.policy},
      {"controller_crc32", crc.controller ? nlohmann::ordered_json(*crc.controller) : nlohmann::ordered_json()},
      {"period_us", {{"control", p.control_us}, {"policy", p.policy_us}, {"driver", p.driver_us}}},
      {"flapping_Hz", model::beats_Hz(config.vehicle)},
      {"holds_trim", holds_trim(config)},
      {"sensors",
       {{"imu_Hz", s.imu.rate_hz},
        {"imu_latency_s", s.imu.latency_s},
        {"imu_position_m", {s.imu.position_m.x, s.imu.position_m.y, s.imu.position_m.z}},
        {"mocap_Hz", s.mocap.rate_hz},
        {"mocap_latency_s", s.mocap.latency_s}}},
      {"history", task.history},
      {"memory", network.memory()},
      {"observation", json_of(task.observation())},
      {"normalisation", {{"mean", network.mean}, {"scale", network.scale}, {"clip", network.clip}}},
      {"action", json_of(task.action())},
      {"inputs", json_of(model::mixed_inputs(config.vehicle))},
      {"test_vectors",
       {{"observation", rows_of(vectors.observation, static_cast<std::size_t>(network.inputs()))},
        {"action", rows_of(vectors.action, static_cast<std::size_t>(network.outputs()))}}}};
  return json.dump(2) + "\n";
}

std::string wiring_text(const FlyConfig& config, const policy::RunInfo& run, bool with_controller) {
  const Periods p = periods_of(config);
  const bool remembers = config.actor && config.actor->recurrent;
  const std::string step = remembers ? "flappy_policy_step_with()" : "flappy_policy_step()";
  std::ostringstream text;
  text
      << "# A policy of the task " << run.task << ", exported by flappy-export\n\n"
      << "`contract.json` has the order, frame, unit, sign and range of every observation and action, the periods, "
         "the\n"
      << "normalisation, checksums and test vectors. The comment at the head of each header says the same in words.\n\n"
      << "1. Put the headers on the include path, of gcc from 9 or clang from 11. They need no library.\n"
      << "2. At start-up, fly only if `flappy_policy_selftest()`"
      << (with_controller ? " and `flappy_controller_selftest()` return" : " returns") << " 0.\n";
  if (with_controller) {
    text << "3. Convert what your sensors say: rates in rad/s and specific force in m/s^2 (at rest +9.8 along z), both "
            "in\n"
         << "   B: x forward, y left, z up; poses of the torso's origin in W, z up, attitude as w, x, y, z from B to "
            "W.\n"
         << "4. `flappy_controller_start()` with the pose; then, every " << p.control_us << " us, in this order:\n"
         << "   - if `flappy_controller_policy_due()`: `_observe()`, `" << step << "`, `_act()`\n"
         << (model::mixed_inputs(config.vehicle).empty()
                 ? "   - `_steer()`, and from then on `_drive()` every " + std::to_string(p.driver_us) +
                       " us: the motors' voltages\n"
                 : "   - `_steer()`, then `_inputs()`: the robot's inputs\n")
         << "   - at the end of the period `_imu()` and `_pose()` with all that has arrived, oldest first, then "
            "`_tick()`\n"
         << (config.fleet.controller.kind == flight::kNoController
                 ? "5. There is no feedback controller: who flies until `flappy_controller_begin()` and after the "
                   "hand-back is "
                   "yours.\n"
                 : "5. `flappy_controller_hover()` until the trim is learnt, then `flappy_controller_begin()`: the "
                   "policy "
                   "acts.\n")
         << (remembers ? "   `flappy_policy_reset()` at each begin: the policy remembers its task alone.\n" : "")
         << "6. Log what the sensors said and what was set, with their times: `flappy-gap check --flown`\n"
         << "   says whether the robot flew this, or which mistake of its firmware explains what it did.\n";
  } else {
    text << "3. Every " << p.policy_us
         << " us, fill the observation in the order of `contract.json`, raw, in its units:\n"
         << "   `" << step << "` normalises it. What it returns holds until the next call.\n"
         << (remembers ? "   `flappy_policy_reset()` before each task: the policy remembers it alone.\n" : "")
         << "4. If it returns 1, a number was none: do not use the action.\n";
  }
  return text.str();
}

std::string contract_macros(const std::string& prefix, const FlyConfig& config, const policy::RunInfo& run) {
  const Periods p = periods_of(config);
  std::ostringstream text;
  const auto define = [&](const char* name, const std::string& value) {
    text << "#define " << prefix << name << " " << value << "\n";
  };
  define("FORMAT", std::to_string(kHeaderFormat));
  define("CONTRACT", std::to_string(contract_crc32(config)) + "U");
  define("TASK", c_string(run.task));
  define("CONFIG_SHA256", c_string(run.config_sha256));
  define("COMMIT", c_string(run.commit));
  define("DIRTY", run.dirty ? "1" : "0");
  define("CONTROL_US", std::to_string(p.control_us) + "U");
  define("PERIOD_US", std::to_string(p.policy_us) + "U");
  define("FLAPPING_HZ", c_number(static_cast<float>(model::beats_Hz(config.vehicle))));
  define("HOLDS_TRIM", holds_trim(config) ? "1" : "0");
  return text.str();
}

}  // namespace flappy::deploy
