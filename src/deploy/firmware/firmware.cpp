#include "deploy/firmware/firmware.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <vector>

#include "deploy/embedded.hpp"
#include "deploy/header/controller_header.hpp"
#include "io/files.hpp"
#include "io/text.hpp"
#include "model/derive.hpp"
#include "model/jointed.hpp"

namespace flappy::deploy {
namespace {

using Input = model::BeatAveraged::Input;

/// An input of a Flapper, its channel of the log, and the values that control_t can carry to it
/// (power_distribution_flapper.c): flapperConfig.maxThrust of 60000 with half of int16_t for roll, 0.4 of int16_t about
/// the middle, int16_t about the middle.
struct Channel {
  const char* input;
  const char* logged;
  double low, high;
};
constexpr double kFull = 65535, kInt16 = 32767;
constexpr std::array<Channel, 4> kFlapper = {
    {{"left_flap", "motor.m2", 0, 60000 / kFull},
     {"right_flap", "motor.m4", 0, 60000 / kFull},
     {"pitch_servo", "motor.m1", 0.5 - 0.4 * kInt16 / kFull, 0.5 + 0.4 * kInt16 / kFull},
     {"yaw_servo", "motor.m3", 0.5 - kInt16 / kFull, 0.5 + kInt16 / kFull}}};

/// Lowest and highest value of an input that the task's actions can ask for.
std::array<double, 2> reach_of(const Input& input, const flight::Task& task) {
  double low = input.neutral, high = input.neutral;
  for (std::size_t k = 0; k < input.mix.size(); ++k) {
    const double a = input.mix[k] * task.constants.action_low[k], b = input.mix[k] * task.constants.action_high[k];
    low += std::min(a, b);
    high += std::max(a, b);
  }
  return {std::max(low, input.low), std::min(high, input.high)};
}

void check_flapper(const rollout::FlyConfig& config) {
  const std::vector<Input> inputs = model::mixed_inputs(config.vehicle);
  std::string has, wants;
  for (const Input& input : inputs) has += (has.empty() ? "" : ", ") + input.name;
  for (const Channel& c : kFlapper) wants += (wants.empty() ? "" : ", ") + std::string(c.input);
  const bool fits = inputs.size() == kFlapper.size() && std::ranges::all_of(kFlapper, [&](const Channel& c) {
                      return std::ranges::find(inputs, c.input, &Input::name) != inputs.end();
                    });
  if (!fits)
    throw io::InputError("--for crazyflie: the vehicle has " + (has.empty() ? "two motors" : "the inputs " + has) +
                         "; accepted: a vehicle with " + wants + ", such as flapper_nimble" +
                         (has.empty() ? "; for two motors, --for px4 or tools/onboard" : ""));
  if (config.fleet.controller.kind != flight::kNoController) return;  // feedback and policy add up, and are clipped
  std::string beyond;
  for (const Channel& c : kFlapper) {
    constexpr double kDigits = 1e-4;
    const auto [low, high] = reach_of(*std::ranges::find(inputs, c.input, &Input::name), config.fleet.task);
    if (low >= c.low - kDigits && high <= c.high + kDigits) continue;
    beyond += (beyond.empty() ? "" : ", ") + io::format("%s from %.3g to %.3g (the firmware sets %.3g to %.3g)",
                                                        c.input, low, high, std::ceil(c.low * 1000) / 1000,
                                                        std::floor(c.high * 1000) / 1000);
  }
  if (!beyond.empty())
    throw io::InputError("--for crazyflie: the task's actions move " + beyond +
                         "; accepted: what the firmware sets, after training with narrower task.action.amplitude_V, "
                         "difference_V, bias_V or split_cycle");
}

struct Logged {
  std::string column, variable, scale;
};

/// Columns of the mapping's streams and the variables of the card's log.
const std::vector<Logged> kMocap = {{"x_m", "stateEstimate.x", ""}, {"y_m", "stateEstimate.y", ""},
                                    {"z_m", "stateEstimate.z", ""}, {"qw", "stateEstimate.qw", ""},
                                    {"qx", "stateEstimate.qx", ""}, {"qy", "stateEstimate.qy", ""},
                                    {"qz", "stateEstimate.qz", ""}};
const std::vector<Logged> kImu = {{"gyro_x_rad_s", "gyro.x", "0.017453292519943295"},
                                  {"gyro_y_rad_s", "gyro.y", "0.017453292519943295"},
                                  {"gyro_z_rad_s", "gyro.z", "0.017453292519943295"},
                                  {"accel_x_m_s2", "acc.x", "9.81"},
                                  {"accel_y_m_s2", "acc.y", "9.81"},
                                  {"accel_z_m_s2", "acc.z", "9.81"}};

/// A stream's columns and scales.
std::string columns_of(const std::string& stream, const std::vector<Logged>& columns) {
  std::string text = "[" + stream + ".columns]\n", scales;
  for (const Logged& c : columns) {
    text += c.column + " = \"" + c.variable + "\"\n";
    if (!c.scale.empty()) scales += c.column + " = " + c.scale + "\n";
  }
  return text + (scales.empty() ? "" : "[" + stream + ".scale]\n" + scales);
}

/// The columns of the policy's observations and actions, and the log's variables for them.
std::vector<Logged> policy_of(const flight::Task& task, const auto& observation_at, const auto& action_at) {
  std::vector<Logged> all;
  const auto observation = task.observation(), action = task.action();
  for (std::size_t i = 0; i < observation.size(); ++i)
    all.push_back({"observation_" + observation[i].name, observation_at(i), ""});
  for (std::size_t i = 0; i < action.size(); ++i) all.push_back({"action_" + action[i].name, action_at(i), ""});
  return all;
}

/// As flappy_log.h names them.
std::vector<Logged> policy_on_card(const flight::Task& task) {
  return policy_of(
      task, [](std::size_t i) { return "flappy.o" + std::to_string(i); },
      [](std::size_t i) { return "flappy.a" + std::to_string(i); });
}

std::vector<Logged> commands() {
  std::vector<Logged> all;
  for (const Channel& c : kFlapper) all.push_back({c.input, c.logged, "1.5259021896692422e-05"});
  return all;
}

/// The firmware logs so many variables at one event (usddeck.c, MAX_USD_LOG_VARIABLES_PER_EVENT).
constexpr std::size_t kVariablesOfAnEvent = 20;

std::string event_of(std::size_t variable) { return "flappy" + std::to_string(variable / kVariablesOfAnEvent); }

/// flappy_log.h: variables of the log, and events that log them at each inference. The first event is the last to be
/// triggered, so that at its time all have their newest values.
std::string log_header(const flight::Task& task) {
  std::string variables, declared, triggered;
  const auto add = [&](const char* name, const char* member, std::size_t k) {
    const std::string number = std::to_string(k);
    variables += " \\\n  LOG_ADD(LOG_FLOAT, " + std::string(name) + number + ", &guest." + member + "[" + number + "])";
  };
  const std::size_t seen = task.observation().size(), acts = static_cast<std::size_t>(task.actions());
  for (std::size_t k = 0; k < seen; ++k) add("o", "observation", k);
  for (std::size_t k = 0; k < acts; ++k) add("a", "action", k);
  for (std::size_t k = 0; k < seen + acts; k += kVariablesOfAnEvent) {
    declared += "EVENTTRIGGER(" + event_of(k) + ")\n";
    triggered = "  eventTrigger(&eventTrigger_" + event_of(k) + ");\n" + triggered;
  }
  return "/* What the policy got and gave, in the order of contract.json. The firmware logs at most 20 variables of an "
         "event. */\n"
         "#define FLAPPY_LOG" +
         variables + "\n\n" + declared + "\nstatic void flappy_log_inference(void) {\n" + triggered + "}\n";
}

/// config.txt of the microSD card (the firmware's docs of the micro SD card deck): it logs from the start.
std::string card(const rollout::FlyConfig& config) {
  std::string text = "1\n2048\nlog\n1\non:fixedFrequency\n200\n1\n";
  for (const auto& list : {commands(), kMocap, kImu})
    for (const Logged& c : list) text += c.variable + "\n";
  text += "pm.vbat\nflappy.state\nflappy.flags\n";
  const std::vector<Logged> policy = policy_on_card(config.fleet.task);
  for (std::size_t k = 0; k < policy.size(); ++k)
    text += (k % kVariablesOfAnEvent == 0 ? "on:" + event_of(k) + "\n" : "") + policy[k].variable + "\n";
  return text;
}

/// The stream of what the policy got and gave.
std::string policy_stream(const std::string& channel, const std::vector<Logged>& policy) {
  std::string numbers;
  for (const Logged& c : policy) numbers += (numbers.empty() ? "\"" : ", \"") + c.column + "\"";
  return "\n[policy]  # what it got and gave\nchannel = \"" + channel + "\"\nnumbers = [" + numbers + "]\n" +
         columns_of("policy", policy);
}

std::string mapping(const rollout::FlyConfig& config) {
  std::string inputs;
  for (const Channel& c : kFlapper) inputs += (inputs.empty() ? "\"" : ", \"") + std::string(c.input) + "\"";
  std::string others;  // columns that are logged at another event than the first
  const std::vector<Logged> policy = policy_on_card(config.fleet.task);
  for (std::size_t k = kVariablesOfAnEvent; k < policy.size(); ++k)
    others += (others.empty() ? "[policy.from]\n" : "") + policy[k].column + " = \"" + event_of(k) + "\"\n";
  return "# The log of this app on the microSD card: flappy-gap import log00 --mapping mapping.toml --out FLIGHT.\n"
         "# Vehicle file, air and noise are yours to check; all keys are in docs/reference/import.md.\n"
         "schema = 1\nvehicle = \"" +
         config.vehicle.name + ".toml\"\nflapping_Hz = " + io::shortest_digits(model::beats_Hz(config.vehicle)) +
         "\ngravity_m_s2 = 9.81\n\n[ambient]\nair_density_kg_m3 = 1.2\nground_z_m = 0.0\nceiling_z_m = 1000.0\nwalls = "
         "[]\n\n"
         "[command]\nchannel = \"fixedFrequency\"\ninputs = [" +
         inputs + "]\n" + columns_of("command", commands()) +
         "[command.flown]  # the wings beat\nfield = \"motor.m2\"\nabove = 0.0\n\n"
         "[mocap]  # the firmware's own estimate\nsource = \"estimate\"\nchannel = \"fixedFrequency\"\nlatency_s = "
         "0.0\n"
         "position_noise_m = 2e-3\nattitude_noise_rad = 0.03\n" +
         columns_of("mocap", kMocap) +
         "\n[imu]\nchannel = \"fixedFrequency\"\nlatency_s = 0.0\nbandwidth_hz = 80.0\nposition_m = [0.0, 0.0, 0.0]\n"
         "gyro_noise_rad_s = 0.5  # in flight, with the beat, as that of the accelerometer, whose bandwidth is 30 "
         "Hz\ngyro_bias_sd_rad_s = [0.02, 0.02, 0.02]\naccel_noise_m_s2 = 10.0\n" +
         columns_of("imu", kImu) +
         "\n[power]\nchannel = \"fixedFrequency\"\ncurrents = false\nbattery_nominal_V = 7.4\nlatency_s = 0.0\n"
         "voltage_noise_V = 0.04\n[power.columns]\nbattery_V = \"pm.vbat\"\n" +
         policy_stream(event_of(0), policy) + others;
}

std::map<std::string, std::string> crazyflie_files(const rollout::FlyConfig& config) {
  check_flapper(config);
  return {
      {"Makefile",
       "# make, then make cload. CRAZYFLIE_BASE: a clone of the firmware with its submodules.\n"
       "CRAZYFLIE_BASE ?= $(HOME)/crazyflie-firmware\nOOT := $(CURDIR)\nOOT_CONFIG := $(OOT)/app-config\n"
       "# Kconfig drops this with another controller than the PID, which flies the Flapper all the same\n"
       "EXTRA_CFLAGS += -DCONFIG_CONTROLLER_PID_FILTER_ALL=1\n"
       "include $(CRAZYFLIE_BASE)/tools/make/oot.mk\n"},
      {"app-config",
       "CONFIG_APP_ENABLE=y\nCONFIG_APP_PRIORITY=1\nCONFIG_APP_STACKSIZE=700\nCONFIG_CONTROLLER_OOT=y\n"
       "CONFIG_PLATFORM_FLAPPER=y\nCONFIG_ESTIMATOR_AUTO_SELECT=y\nCONFIG_MOTORS_ESC_PROTOCOL_STANDARD_PWM=y\n"
       "CONFIG_DECK_FORCE=\"bcUSD:bcLedRing:bcFlapperDeck\"\nCONFIG_DECK_FLAPPER=y\nCONFIG_DECK_USD=y\n"
       "CONFIG_DECK_LEDRING=y\nCONFIG_DECK_FLAPPER_EXTRX_ENABLE=n\nCONFIG_DECK_CPPM=y\nCONFIG_DECK_CPPM_USE_PA3=y\n"},
      {"Kbuild", "obj-y += src/\n"},
      {"src/Kbuild", "obj-y += flappy_crazyflie.o\n"},
      {"src/flappy_crazyflie.c", std::string(kEmbedded.at("flappy_crazyflie.c"))},
      {"src/flappy_guest.h", std::string(kEmbedded.at("flappy_guest.h"))},
      {"src/flappy_log.h", log_header(config.fleet.task)},
      {"config.txt", card(config)},
      {"mapping.toml", mapping(config)},
  };
}

/// px4.toml for this vehicle and policy.
std::string px4_mapping(const rollout::FlyConfig& config) {
  std::string text(kEmbedded.at("px4.toml"));
  const auto replace = [&](const std::string& key, const std::string& value) {
    const std::size_t begin = text.find("\n" + key + " = ") + 1;
    text.replace(begin, text.find('\n', begin) - begin, key + " = " + value);
  };
  replace("vehicle", "\"" + config.vehicle.name + ".toml\"");
  replace("world", "\"ned_x_north\"");  // as flappy_px4.cc turns poses
  const std::string of_battery = "# -1 to 1, as a share of the battery's voltage";
  text.replace(text.find(of_battery), of_battery.size(), "# 1 is FLAPPY_PX4_FULL_V of flappy_px4.cpp, below");
  replace("flapping_Hz", io::shortest_digits(config.vehicle.driver.flapping_Hz));
  const std::size_t inputs = config.fleet.task.observation().size();
  const auto data = [](std::size_t i) { return "data[" + std::to_string(i) + "]"; };
  return text + policy_stream("debug_array",
                              policy_of(config.fleet.task, data, [&](std::size_t i) { return data(inputs + i); }));
}

std::map<std::string, std::string> px4_files(const rollout::FlyConfig& config) {
  constexpr std::size_t kDebugArray = 58;
  if (!model::mixed_inputs(config.vehicle).empty())
    throw io::InputError(
        "--for px4: the vehicle has inputs in place of two motors; accepted: a vehicle with motors; for these inputs, "
        "--for crazyflie");
  if (const std::string why_not = no_controller(config); !why_not.empty())
    throw io::InputError("--for px4: " + why_not + "; accepted: a task that leaves the controller to fly");
  if (config.fleet.controller.kind == flight::kNoController)
    throw io::InputError(
        "--for px4: without a controller its motors would stop when the policy has acted for a second; accepted: a run "
        "with a controller");
  if (std::abs(config.fleet.control_hz * 2e-3 - 1) > 1e-9)
    throw io::InputError("--for px4: its loop runs at 500 Hz, and this controller at " +
                         io::shortest_digits(config.fleet.control_hz) + " Hz; accepted: control_hz = 500");
  if (const std::size_t n = config.fleet.task.observation().size() + 4; n > kDebugArray)
    throw io::InputError("--for px4: the policy gets and gives " + std::to_string(n) +
                         " numbers; accepted: at most 58, which its log holds");
  const std::string at = "src/modules/flappy_control/";
  return {
      {"src/CMakeLists.txt", "set(config_module_list_external modules/flappy_control PARENT_SCOPE)\n"},
      {at + "CMakeLists.txt",
       "px4_add_module(\n  MODULE modules__flappy_control\n  MAIN flappy_control\n"
       "  STACK_MAIN 4096  # for the self-tests\n  COMPILE_FLAGS -fno-reciprocal-math  # the numbers of the headers "
       "are those of IEEE\n"
       "  SRCS flappy_px4.cpp onboard.c\n  DEPENDS px4_work_queue\n  EXTERNAL\n)\n"},
      {at + "flappy_px4.cpp", std::string(kEmbedded.at("flappy_px4.cc"))},
      {at + "onboard.h", std::string(kEmbedded.at("onboard.h"))},
      {at + "onboard.c", std::string(kEmbedded.at("onboard.c"))},
      {"logger_topics.txt",
       "actuator_motors 0\nsensor_combined 0\nvehicle_visual_odometry 0\nbattery_status 0\nactuator_armed 0\n"
       "debug_array 0\n"},
      {"mapping.toml", px4_mapping(config)},
  };
}

}  // namespace

bool is_app(const std::filesystem::path& folder, const std::string& firmware) {
  return std::filesystem::exists(
      folder / (firmware == "px4" ? "src/modules/flappy_control/flappy_px4.cpp" : "src/flappy_crazyflie.c"));
}

std::map<std::string, std::string> firmware_files(const std::string& firmware, const rollout::FlyConfig& config,
                                                  const std::map<std::string, std::string>& headers) {
  const bool px4 = firmware == "px4";
  std::map<std::string, std::string> files = px4 ? px4_files(config) : crazyflie_files(config);
  for (const char* header : {"flappy_policy.h", "flappy_controller.h"})
    files[(px4 ? "src/modules/flappy_control/" : "src/") + std::string(header)] = headers.at(header);
  return files;
}

}  // namespace flappy::deploy
