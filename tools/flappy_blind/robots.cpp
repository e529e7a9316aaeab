#include "robots.hpp"

#include <filesystem>

#include "io/config.hpp"

namespace flappy::blind {
namespace {

namespace fs = std::filesystem;

sim::Randomisation read_spread(const model::Vehicle& declared, const std::string& path) {
  if (path == "none") return sim::Randomisation(declared);
  return sim::read_randomisation(declared, io::Config::load(path).root());
}

}  // namespace

std::vector<BlindEffect> effects_of(const std::vector<std::string>& texts) {
  std::vector<BlindEffect> effects;
  for (const std::string& text : texts) {
    const std::size_t equals = text.find('=');
    const std::string magnitude = equals == std::string::npos ? "" : text.substr(equals + 1);
    char* end = nullptr;
    const double value = std::strtod(magnitude.c_str(), &end);
    if (magnitude.empty() || *end != '\0')
      throw io::InputError("--effect " + text + ": no magnitude; accepted: ID=MAGNITUDE, as ground_effect=1");
    effects.push_back({text.substr(0, equals), value});
  }
  return effects;
}

void add_robot_options(const io::Command& command, RobotOptions& o) {
  command.option("--vehicle", o.vehicle, "the vehicle as declared").shows_default();
  command.option("--randomise", o.randomise, "[[randomise]] tables that the robot is drawn from, or none")
      .shows_default();
  command.option("--seed", o.seed, "of all that is drawn").range(std::uint64_t{0}, std::uint64_t{1} << 53).required();
  command.option("--effect", o.effects, "ID=MAGNITUDE; 1 is typical").one_at_a_time();
  command.flag("--power", o.power, "log battery and currents");
  command.flag("--wings", o.wings, "log wing angles");
  command.flag("--no-truth", o.no_truth, "leave out truth.csv");
}

Robots::Robots(const RobotOptions& o)
    : declared_(declared_case(o.vehicle)), seed_(o.seed), randomisation_(read_spread(declared_.vehicle, o.randomise)) {
  declared_.magnitudes = Magnitudes(effects_of(o.effects));
  declared_.power = o.power;
  declared_.wings = o.wings;
}

SampledRobot Robots::fly(Programme programme) const {
  Case c = declared_;
  c.programme = programme;
  return fly_sampled(c, randomisation_, seed_);
}

void write(const RobotFlight& f, const fs::path& to, bool truth) {
  flightlog::write_flight_log(to, f.log);
  if (!truth) return;
  std::vector<std::string> names = flightlog::kMotionNames;
  // robots of family A do not log true accelerations
  std::erase_if(names, [](const std::string& name) { return name.find("acceleration") != std::string::npos; });
  flightlog::write_truth(to, names, f.truth);
}

}  // namespace flappy::blind
