// flappy-blind-robot: flies a robot of another making, with or without something wrong, and writes what it logged.
#include <cstdio>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "blind/flights.hpp"
#include "flappy/vehicle_file.hpp"
#include "io/program.hpp"
#include "io/sha256.hpp"
#include "oracle.hpp"
#include "sim/randomise.hpp"

namespace flappy::blind {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::uint64_t kTries = 20;  ///< robots drawn until one does not crash

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
  const model::Vehicle declared = model::read_vehicle(o.vehicle);
  if (!declared.effects.empty())
    throw io::InputError(o.vehicle +
                         ": [effects]: the blind robot has effects of its own; accepted: a vehicle without");
  sim::Randomisation randomisation(declared);
  if (o.randomise != "none") randomisation = sim::read_randomisation(declared, io::Config::load(o.randomise).root());
  const std::filesystem::path vehicle_path(o.vehicle), folder(o.out);
  std::error_code error;
  if (std::filesystem::exists(folder, error) && !std::filesystem::is_directory(folder, error))
    throw io::InputError(o.out + ": is a file; accepted: a folder, or a name for a new one");
  Case c{.vehicle = declared,
         .declared_density_kg_m3 = declared.air_density_kg_m3,
         .vehicle_file = vehicle_path.filename().string(),
         .vehicle_sha256 = io::sha256(io::read_text(vehicle_path)),
         .sizes = Sizes(effects_of(o.effects)),
         .programme = o.programme == "rich" ? Programme::rich : Programme::hover,
         .power = o.power,
         .wings = o.wings};
  Json crashes = Json::array();
  for (std::uint64_t draw = 0; draw < kTries; ++draw) {
    c.seed = o.seed * kTries + draw;
    c.vehicle = randomisation.sample({c.seed, 0, 0, sim::Stream::vehicle});
    std::vector<Flight> flights;
    for (std::size_t k = 0; k < kFlights && (flights.empty() || !flights.back().crashed); ++k)
      flights.push_back(fly(c, k));
    if (flights.back().crashed) {
      std::printf("draw %llu: flight %zu %s; the next draw\n", static_cast<unsigned long long>(draw), flights.size(),
                  flights.back().how.c_str());
      crashes.push_back(flights.back().how);
      continue;
    }
    Json list = Json::array();
    std::filesystem::create_directories(folder, error);
    if (error)
      throw io::InputError(o.out + ": cannot be made: " + error.message() +
                           "; accepted: a folder, or a name for a new one");
    for (std::size_t k = 0; k < kFlights; ++k) {
      const std::filesystem::path to = folder / ("flight_" + std::to_string(k + 1));
      flight::write_flight_log(to, flights[k].log);
      if (!o.no_truth) flight::write_truth(to, flight::kMotionNames, flights[k].truth);
      std::printf("%s: %g s, up to %.0f mm off, tilted up to %.0f deg\n", to.c_str(), kFlight_s,
                  1e3 * flights[k].farthest_m, flights[k].most_tilt_rad * 180 / kPi);
      list.push_back({{"folder", to.string()},
                      {"farthest_m", flights[k].farthest_m},
                      {"most_tilt_rad", flights[k].most_tilt_rad}});
    }
    return {{"seed", o.seed}, {"draw", draw}, {"crashes", crashes}, {"flights", list}};
  }
  throw io::InputError("--seed " + std::to_string(o.seed) + ": " + std::to_string(kTries) +
                       " robots in a row crashed; accepted: effects of smaller size, less randomisation");
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
  CLI::App* oracle = program.app().add_subcommand("oracle", "finds how large effects have to be to be found");
  blind::OracleCommand command;
  oracle->add_option("--vehicle", command.vehicle, "the vehicle as declared")->required();
  oracle->add_option("--randomise", command.randomise, "what robots are drawn from")->capture_default_str();
  oracle->add_option("--priors", command.priors, "what is uncertain of them")->capture_default_str();
  oracle->add_option("--vehicles", command.vehicles, "how many")->check(CLI::Range(1, 1000))->capture_default_str();
  oracle->add_option("--seed", command.seed, "of the first")
      ->check(CLI::Range(std::uint64_t{0}, std::uint64_t{1} << 53))
      ->capture_default_str();
  oracle->add_option("--out", command.out, "file for what is found")->required();
  oracle->add_option("--threads", command.threads, "0: one for each processor")->check(CLI::Range(0, 1024));
  program.app().require_subcommand(1);
  return program.run(argc, argv, [&] {
    if (*list)
      for (const std::string& name : blind::effect_names()) std::printf("%s\n", name.c_str());
    else if (*oracle) program.write_json(blind::run_oracle(command));
    else program.write_json(blind::fly_case(o));
  });
}
