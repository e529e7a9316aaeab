// The onboard loop around the headers of an escape, compiled on the spot.
#pragma once

#include <gtest/gtest.h>

#include <random>

#include "deploy/header/controller_header.hpp"
#include "deploy/header/policy_header.hpp"
#include "deploy/header/policy_vectors.hpp"
#include "deploy/proof/board.hpp"
#include "tools/onboard_loop.hpp"

namespace flappy::deploy {

using flight::Folder;
using flight::source_path;
using rollout::FlyConfig;
using Words = std::vector<std::string>;

/// Keeps roll, pitch and height much as the feedback would, besides small weights of everything it sees.
inline std::shared_ptr<const policy::Actor> upright_actor(const flight::Task& task, std::uint32_t seed = 3) {
  policy::Actor a;
  a.task = task.name;
  std::mt19937 random(seed);
  for (const auto& s : task.observation()) a.observation.push_back(s.name);
  for (const auto& s : task.action()) a.action.push_back(s.name);
  a.widths = {static_cast<int>(a.observation.size()), flight::kMaxActions};
  a.mean.assign(a.observation.size(), 0);
  a.scale.assign(a.observation.size(), 1);
  a.clip = 100;
  const double none[] = {-0.235, 0, 0, 0};  // what adds nothing, of -5 to 8 V for the amplitude
  for (int out = 0; out < flight::kMaxActions; ++out) {
    a.weights.push_back(none[out]);
    for (const std::string& name : a.observation) {
      double w = (name.starts_with("trim") ? 0.0002 : 0.005) * (static_cast<double>(random()) / 0x1p31 - 1);
      if (out == 0 && name == "z_error") w = -15 / 6.5;
      if (out == 0 && name == "z_velocity") w = -4 / 6.5;
      if (out == 1 && name == "goal_R_zy") w = -16.7 / 3;
      if (out == 1 && name == "roll_rate") w = -0.708 / 3;
      if (out == 2 && name == "goal_R_zx") w = 14.9 / 3.5;
      if (out == 2 && name == "pitch_rate") w = -0.319 / 3.5;
      a.weights.push_back(w);
    }
  }
  return std::make_shared<const policy::Actor>(a);
}

/// A short way, which the feedback can go if the policy does not.
inline const Words kShort = {"task.start.position_m.x=-0.05", "task.start.x_low_m=-0.1", "task.start.x_high_m=0.1",
                             "task.start.rotation_rad.z=0.1", "task.hand_back.distance_m=0.01"};

inline FlyConfig escape(const Words& overrides = kShort) {
  FlyConfig c = rollout::read_fly_config(source_path("configs/fly/escape.toml"), overrides);
  c.actor = upright_actor(c.fleet.task);
  return c;
}

inline FlyConfig of_nominal(FlyConfig config) {
  config.randomisation.reset();
  return config;
}

inline const policy::RunInfo kRun{std::string(64, 'a'), "0123456789ab", false, "escape"};

inline std::string policy_text(const FlyConfig& config) {
  const policy::PolicyNetwork network = network_of(config);
  policy::PolicyVectors v = some_of(roll_out(config, 0, 4), 20);
  append(v, corners(network, config.fleet.task.observation()));
  v.action = evaluate(network, v.observation);
  return policy_header(config, kRun, network, v);
}

inline std::string controller_text(const FlyConfig& config) {
  return controller_header(config, kRun, record_controller(config));
}

struct Headers {
  std::string policy, controller;
};
inline const Headers& escape_headers() {
  static const Headers headers{policy_text(escape()), controller_text(escape())};
  return headers;
}

inline std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  if (at == std::string::npos) throw std::runtime_error("nowhere: " + from);
  return text.replace(at, from.size(), to);
}

/// The loop compiled around headers.
class Loop {
 public:
  explicit Loop(const Headers& headers) {
    folder_.write("flappy_policy.h", headers.policy);
    folder_.write("flappy_controller.h", headers.controller);
    write_board(folder_ / "");
  }
  /// Makes a mistake in the code between sensors and headers.
  void spoil(const std::string& from, const std::string& to) {
    folder_.write("hal_spoilt.c", replaced(io::read_text(source_path("tools/onboard/hal_simulated.c")), from, to));
    hal_ = (folder_ / "hal_spoilt.c").string();
  }
  /// Of this machine; the complaints of the compiler.
  std::string build(const std::string& compiler, const Words& options = {"-O1"}) {
    Words command = {compiler};
    append(command, strict());
    append(command, options);
    append(command, sources());
    append(command, {folder_ / "board_host.c", "-o", folder_ / "loop"});
    return run_limited(command).err;
  }
  /// The flight logic without its loop, around a program of the tests.
  std::string build_around(const std::string& program, const Words& options = {"-O2"}) {
    Words command = {"gcc"};
    append(command, strict());
    append(command, options);
    append(command, {program, source_path("tools/onboard/onboard.c"), "-o", folder_ / "loop"});
    return run_limited(command).err;
  }
  std::string build_for_board(const Words& options = {"-O2"}) {
    Words all = strict();
    append(all, options);
    std::vector<std::filesystem::path> list;
    for (const std::string& s : sources()) list.emplace_back(s);
    return run_limited(board_build(folder_ / "", list, all, folder_ / "loop.elf")).err;
  }
  Words program() const { return {folder_ / "loop"}; }
  Words board() const { return board_run(folder_ / "loop.elf", false); }

 private:
  Words strict() const {
    Words options = {"-std=c99"};
    append(options, strict_options({folder_ / "", source_path("tools/onboard")}));
    return options;
  }
  Words sources() const {
    const std::string at = source_path("tools/onboard/");
    return {at + "main.c", at + "onboard.c", hal_};
  }
  Folder folder_;
  std::string hal_ = source_path("tools/onboard/hal_simulated.c");
};

/// The escape's loop on this machine, once.
inline const Words& escape_loop() {
  static Loop loop(escape_headers());
  static const std::string complaints = loop.build("gcc", {"-O2"});
  if (!complaints.empty()) throw std::runtime_error(complaints);
  static const Words program = loop.program();
  return program;
}

}  // namespace flappy::deploy
