// flappy-blind-robot: flies a robot of another making, with or without something wrong, and writes what it logged.
#include <cstdio>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "blind/drawn.hpp"
#include "io/program.hpp"

namespace flappy::blind {
namespace {

using Json = nlohmann::ordered_json;

struct Options {
  std::string vehicle, randomise = "none", programme = "rich", out;
  std::uint64_t seed = 0;
  std::vector<std::string> effects;
  bool power = false, wings = false, no_truth = false;
};

std::vector<BlindEffect> effects_of(const std::vector<std::string>& texts) {
  std::vector<BlindEffect> effects;
  for (const std::string& text : texts) {
    const std::size_t equals = text.find('=');
    const std::string size = equals == std::string::npos ? "" : text.substr(equals + 1);
    char* end = nullptr;
    const double value = std::strtod(size.c_str(), &end);
    if (size.empty() || *end != '\0')
      throw io::InputError("--effect " + text + ": no size; accepted: ID=SIZE, as ground_effect=1");
    effects.push_back({text.substr(0, equals), value});
  }
  return effects;
}

Json fly_case(const Options& o) {
  Case c = declared_case(o.vehicle);
  sim::Randomisation randomisation(c.vehicle);
  if (o.randomise != "none") randomisation = sim::read_randomisation(c.vehicle, io::Config::load(o.randomise).root());
  const std::filesystem::path folder(o.out);
  std::error_code error;
  if (std::filesystem::exists(folder, error) && !std::filesystem::is_directory(folder, error))
    throw io::InputError(o.out + ": is a file; accepted: a folder, or a name for a new one");
  c.sizes = Sizes(effects_of(o.effects));
  c.programme = o.programme == "rich" ? Programme::rich : Programme::hover;
  c.power = o.power;
  c.wings = o.wings;
  const Drawn drawn = fly_drawn(c, randomisation, o.seed);
  Json crashes = Json::array(), list = Json::array();
  for (std::size_t draw = 0; draw < drawn.lost.size(); ++draw) {
    const Crash& lost = drawn.lost[draw];
    std::printf("draw %zu: flight %zu %s; the next draw\n", draw, lost.flight, lost.how.c_str());
    crashes.push_back(lost.how);
  }
  std::filesystem::create_directories(folder, error);
  if (error)
    throw io::InputError(o.out + ": cannot be made: " + error.message() +
                         "; accepted: a folder, or a name for a new one");
  for (std::size_t k = 0; k < kFlights; ++k) {
    const Flight& flight = drawn.flights[k];
    const std::filesystem::path to = folder / ("flight_" + std::to_string(k + 1));
    flight::write_flight_log(to, flight.log);
    if (!o.no_truth) flight::write_truth(to, flight::kMotionNames, flight.truth);
    std::printf("%s: %g s, up to %.0f mm off, tilted up to %.0f deg\n", to.c_str(), kFlight_s, 1e3 * flight.farthest_m,
                flight.most_tilt_rad * 180 / kPi);
    list.push_back(
        {{"folder", to.string()}, {"farthest_m", flight.farthest_m}, {"most_tilt_rad", flight.most_tilt_rad}});
  }
  return {{"seed", o.seed}, {"draw", drawn.draw}, {"crashes", crashes}, {"flights", list}};
}

}  // namespace
}  // namespace flappy::blind

int main(int argc, char** argv) {
  using namespace flappy;
  io::Program program("flappy-blind-robot", "A robot of another making, for a diagnosis to be tried on.", {});
  blind::Options o;
  CLI::App* list = program.app().add_subcommand("effects", "lists what may be wrong with it");
  CLI::App* fly = program.app().add_subcommand("fly", "flies three times and writes the logs");
  fly->add_option("--vehicle", o.vehicle, "the vehicle as declared")->required();
  fly->add_option("--randomise", o.randomise, "[[randomise]] tables that the robot is drawn from, or none")
      ->capture_default_str();
  fly->add_option("--seed", o.seed, "of all that is drawn")
      ->check(CLI::Range(std::uint64_t{0}, std::uint64_t{1} << 53))
      ->required();
  fly->add_option("--programme", o.programme, "rich: excitation, a path, turns; hover: calm")
      ->check(CLI::IsMember({"rich", "hover"}))
      ->capture_default_str();
  fly->add_option("--effect", o.effects, "ID=SIZE; 1 is typical")->allow_extra_args(false);
  fly->add_flag("--power", o.power, "log battery and currents");
  fly->add_flag("--wings", o.wings, "log wing angles");
  fly->add_flag("--no-truth", o.no_truth, "leave out truth.csv");
  fly->add_option("--out", o.out, "folder for flight_1, flight_2, flight_3")->required();
  program.app().require_subcommand(1);
  return program.run(argc, argv, [&] {
    if (*list)
      for (const std::string& name : blind::effect_names()) std::printf("%s\n", name.c_str());
    else program.write_json(blind::fly_case(o));
  });
}
