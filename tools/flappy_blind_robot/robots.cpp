#include "robots.hpp"

#include <filesystem>

#include "flappy/vehicle_file.hpp"
#include "io/config.hpp"
#include "io/sha256.hpp"

namespace flappy::blind {
namespace {

namespace fs = std::filesystem;

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

model::Vehicle read_declared(const std::string& path) {
  model::Vehicle declared = model::read_vehicle(path);
  if (!declared.effects.empty())
    throw io::InputError(path + ": [effects]: the blind robot has effects of its own; accepted: a vehicle without");
  return declared;
}

sim::Randomisation read_spread(const model::Vehicle& declared, const std::string& path) {
  if (path == "none") return sim::Randomisation(declared);
  return sim::read_randomisation(declared, io::Config::load(path).root());
}

}  // namespace

void add_robot_options(CLI::App& command, RobotOptions& o) {
  command.add_option("--vehicle", o.vehicle, "the vehicle as declared")->required();
  command.add_option("--randomise", o.randomise, "[[randomise]] tables that the robot is drawn from, or none")
      ->capture_default_str();
  command.add_option("--seed", o.seed, "of all that is drawn")
      ->check(CLI::Range(std::uint64_t{0}, std::uint64_t{1} << 53))
      ->required();
  command.add_option("--effect", o.effects, "ID=SIZE; 1 is typical")->allow_extra_args(false);
  command.add_flag("--power", o.power, "log battery and currents");
  command.add_flag("--wings", o.wings, "log wing angles");
  command.add_flag("--no-truth", o.no_truth, "leave out truth.csv");
}

Robots::Robots(const RobotOptions& o)
    : declared_{.vehicle = read_declared(o.vehicle),
                .vehicle_file = fs::path(o.vehicle).filename().string(),
                .vehicle_sha256 = io::sha256(io::read_text(o.vehicle)),
                .sizes = Sizes(effects_of(o.effects)),
                .power = o.power,
                .wings = o.wings},
      seed_(o.seed),
      randomisation_(read_spread(declared_.vehicle, o.randomise)) {
  declared_.declared_density_kg_m3 = declared_.vehicle.air_density_kg_m3;
}

Case Robots::robot(std::uint64_t draw) const {
  Case c = declared_;
  c.seed = seed_ * kTries + draw;
  c.vehicle = randomisation_.sample({c.seed, 0, 0, sim::Stream::vehicle});
  return c;
}

void make_folder(const std::string& out) {
  std::error_code error;
  if (fs::exists(out, error) && !fs::is_directory(out, error))
    throw io::InputError(out + ": is a file; accepted: a folder, or a name for a new one");
  fs::create_directories(out, error);
  if (error)
    throw io::InputError(out + ": cannot be made: " + error.message() +
                         "; accepted: a folder, or a name for a new one");
}

void write(const Flight& f, const fs::path& to, bool truth) {
  flight::write_flight_log(to, f.log);
  if (truth) flight::write_truth(to, flight::kMotionNames, f.truth);
}

}  // namespace flappy::blind
