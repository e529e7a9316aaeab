// Options that choose a robot of family A, shared by the commands of flappy-blind.
#pragma once

#include <string>
#include <vector>

#include "io/installation.hpp"
#include "io/program.hpp"
#include "lab/blind/a/sampled_robot.hpp"

namespace flappy::blind {

struct RobotOptions {
  std::string vehicle = io::config_path("vehicles/hummingbird_nominal.toml"), randomise = "none", out;
  std::uint64_t seed = 0;
  std::vector<std::string> effects;
  bool power = false, wings = false, no_truth = false;
};

/// Parses texts of the form "ID=MAGNITUDE". Throws InputError if the number is missing.
std::vector<BlindEffect> effects_of(const std::vector<std::string>& texts);

void add_robot_options(const io::Command& command, RobotOptions& o);

/// The robots that a seed draws.
class Robots {
 public:
  explicit Robots(const RobotOptions& o);
  Case robot(std::uint64_t draw) const { return sampled_case(declared_, randomisation_, seed_, draw); }
  SampledRobot fly(Programme programme) const;

 private:
  Case declared_;
  std::uint64_t seed_;
  sim::Randomisation randomisation_;
};

void write(const RobotFlight& f, const std::filesystem::path& to, bool truth);

}  // namespace flappy::blind
