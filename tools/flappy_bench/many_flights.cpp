#include "many_flights.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <random>

#include "accuracy.hpp"
#include "flappy/vehicle_file.hpp"
#include "io/config.hpp"
#include "io/files.hpp"
#include "io/installation.hpp"
#include "sim/randomise.hpp"
#include "sim/storage.hpp"
#include "speed.hpp"
#ifdef FLAPPY_HAVE_PEERS
#include "dart_peer.hpp"
#include "mujoco_peer.hpp"
#endif

namespace flappy::bench {
namespace {

constexpr double kFlight_s = 0.3, kSettles_s = 0.5;
[[maybe_unused]] constexpr double kHold_s = 1e-3;  // used by peers only
constexpr double kPeriod_s = 2e-3;
constexpr int kBeats = 17;
constexpr std::uint64_t kSeed = 9;
const Manoeuvre kAboutHover{256, 8, 12, {}};

struct OwnFlight {
  model::Vehicle vehicle;
  sim::Input input;
  sim::FlapperState start;
};

std::vector<OwnFlight> draw(const model::Vehicle& vehicle, const Manoeuvre& manoeuvre) {
  const sim::Randomisation randomisation =
      sim::read_randomisation(vehicle, io::Config::load(io::config_path("randomisation/published.toml")).root());
  std::mt19937_64 random(kSeed);
  const auto within = [&](double limit) { return limit * (2 * static_cast<double>(random() >> 11) * 0x1p-53 - 1); };
  std::vector<OwnFlight> flights;
  for (std::size_t i = 0; i < manoeuvre.flights; ++i) {
    const double amplitude_V =
        (manoeuvre.low_V + manoeuvre.high_V) / 2 + within((manoeuvre.high_V - manoeuvre.low_V) / 2);
    const sim::Input input{amplitude_V, within(1), within(0.5), within(0.05)};
    const sim::FlapperState start{.stroke_rad = {within(0.5), within(0.5)}, .rotation_rad = {within(0.5), within(0.5)}};
    model::Vehicle own = randomisation.sample({.seed = kSeed, .flapper = static_cast<std::uint32_t>(i)});
    if (!manoeuvre.effect.empty()) own.effects[manoeuvre.effect];
    flights.push_back({own, input, start});
  }
  return flights;
}

template <class T>
sim::Batch<T> batch_of(const std::vector<OwnFlight>& flights, double step_s, sim::Start start) {
  sim::Batch<T> batch(flights.size(), flights[0].vehicle, {.step_s = step_s, .threads = 1});
  for (std::size_t i = 0; i < flights.size(); ++i) {
    batch.set_vehicle(i, flights[i].vehicle);
    batch.reset(i, flights[i].start, start);
    batch.set_input(i, flights[i].input);
  }
  return batch;
}

template <class T>
void advance(sim::Batch<T>& batch, double seconds, double step_s) {
  batch.step(static_cast<int>(std::lround(seconds / step_s)));
}

Flight end_of(const sim::FlapperState& s) {
  return {
      s.position_m[0], s.position_m[1], s.position_m[2], {s.attitude[0], s.attitude[1], s.attitude[2], s.attitude[3]}};
}

std::vector<Flight> free_flights(const std::vector<OwnFlight>& flights, double step_s) {
  auto batch = batch_of<double>(flights, step_s, sim::Start::flying);
  advance(batch, kFlight_s, step_s);
  std::vector<Flight> ends;
  for (std::size_t i = 0; i < flights.size(); ++i) ends.push_back(end_of(batch.state(i)));
  return ends;
}

/// Mean thrust over whole beats, torso welded.
std::vector<double> thrusts_N(const std::vector<OwnFlight>& flights, double step_s) {
  auto batch = batch_of<double>(flights, step_s, sim::Start::welded);
  advance(batch, kSettles_s, step_s);
  std::vector<double> thrust_N;
  for (std::size_t i = 0; i < flights.size(); ++i) thrust_N.push_back(-batch.held_impulse(i).force_N_s[2]);
  const double beats_s = kBeats / flights[0].vehicle.driver.flapping_Hz;
  advance(batch, beats_s, step_s);
  for (std::size_t i = 0; i < flights.size(); ++i)
    thrust_N[i] = (thrust_N[i] + batch.held_impulse(i).force_N_s[2]) / beats_s;
  return thrust_N;
}

/// Rms errors of position (m) and attitude (rad).
std::array<double, 2> rms(const std::vector<Flight>& flights, const std::vector<Flight>& exact) {
  double position = 0, attitude = 0;
  for (std::size_t i = 0; i < flights.size(); ++i) {
    position += std::pow(distance_m(flights[i], exact[i]), 2);
    attitude += std::pow(turn_rad(flights[i], exact[i]), 2);
  }
  const auto n = static_cast<double>(flights.size());
  return {std::sqrt(position / n), std::sqrt(attitude / n)};
}

/// Seconds of flight per second of one processor, in float, in control periods of 2 ms; median of five runs.
double flapper_s_per_cpu_s(const std::vector<OwnFlight>& few, double step_s) {
  std::vector<OwnFlight> flights;
  while (flights.size() < 1024) flights.insert(flights.end(), few.begin(), few.end());
  std::vector<double> goes;
  for (int go = 0; go < 5; ++go) {
    auto batch = batch_of<float>(flights, step_s, sim::Start::flying);
    const double begin_s = processor_seconds();
    for (int period = 0; period < std::lround(kFlight_s / kPeriod_s); ++period) advance(batch, kPeriod_s, step_s);
    goes.push_back(kFlight_s * static_cast<double>(flights.size()) / (processor_seconds() - begin_s));
  }
  return summary(goes).median;
}

#ifdef FLAPPY_HAVE_PEERS
/// Voltages of the driver, each held for 1 ms: [flight][hold][side].
std::vector<std::vector<std::array<double, 2>>> voltages_of(const std::vector<OwnFlight>& flights) {
  const double coarse_s = kHold_s / 2;
  auto batch = batch_of<double>(flights, coarse_s, sim::Start::welded);
  std::vector<std::vector<std::array<double, 2>>> voltages(flights.size());
  for (double t_s = 0; t_s < kFlight_s - kHold_s / 2; t_s += kHold_s) {
    advance(batch, kHold_s, coarse_s);
    for (std::size_t i = 0; i < flights.size(); ++i) {
      const auto at = sim::storage_of(batch).at(i);
      const auto v = sim::get<sim::Drive<double>>(at.block.drive, at.lane).voltages;
      voltages[i].push_back({v.left_V, v.right_V});
    }
  }
  return voltages;
}

struct PeerSettings {
  std::string engine, name;
  std::function<std::pair<Flight, double>(const OwnFlight&, const std::vector<std::array<double, 2>>&, double)> fly;
};

/// End of a peer's flight at a step size, and the processor time that it took, s.
template <class Peer, class Settings>
std::pair<Flight, double> fly_peer(const OwnFlight& own, const std::vector<std::array<double, 2>>& voltages,
                                   double step_s, const Settings& settings) {
  Peer peer(own.vehicle, {.step_s = step_s}, settings);
  reference::PeerState start;
  start.stroke_rad = {own.start.stroke_rad[0], own.start.stroke_rad[1]};
  start.rotation_rad = {own.start.rotation_rad[0], own.start.rotation_rad[1]};
  peer.set_state(start);
  const int each = static_cast<int>(std::lround(kHold_s / step_s));
  const double begin_s = processor_seconds();
  for (const auto& [left_V, right_V] : voltages)
    for (int i = 0; i < each; ++i) peer.step(left_V, right_V);
  const double took_s = processor_seconds() - begin_s;
  reference::PeerState s = peer.state();
  if constexpr (requires { peer.diverged(); })
    if (peer.diverged()) s.p_WB_W_m[0] = std::numeric_limits<double>::infinity();
  return {{s.p_WB_W_m[0], s.p_WB_W_m[1], s.p_WB_W_m[2], s.q_WB}, took_s};
}

/// Settings that a careful user would try: all integrators, linear damping given as a load or as the joints' own, and of
/// MuJoCo stops of its defaults, as stiff as the step allows, or damped so much that they do not throw back.
std::vector<PeerSettings> peer_settings() {
  std::vector<PeerSettings> all;
  const auto add_mujoco = [&](const std::string& integrator, bool joint_damping) {
    for (const char* stops : {"default", "stiff", "hard"})
      all.push_back({"MuJoCo", integrator + (joint_damping ? ", joint damping, " : ", ") + stops + " stops",
                     [=](const OwnFlight& own, const auto& voltages, double step_s) {
                       reference::MujocoSettings settings{
                           .integrator = integrator, .joint_damping = joint_damping, .stop_time_s = 2 * step_s};
                       if (stops == std::string("hard")) settings.stop_damping_ratio = 4;
                       if (stops == std::string("default")) settings = reference::with_default_stops(settings);
                       return fly_peer<reference::MujocoPeer>(own, voltages, step_s, settings);
                     }});
  };
  for (const bool joint_damping : {false, true}) add_mujoco("Euler", joint_damping);
  add_mujoco("implicit", true);
  if (reference::mujoco_has_implicitfast()) add_mujoco("implicitfast", true);
  add_mujoco("RK4", true);
  for (const bool implicit_spring : {false, true})
    for (const bool joint_damping : {false, true})
      all.push_back({"DART",
                     std::string(implicit_spring ? "implicit" : "explicit") + " spring" +
                         (joint_damping ? ", joint damping" : ""),
                     [=](const OwnFlight& own, const auto& voltages, double step_s) {
                       return fly_peer<reference::DartPeer>(
                           own, voltages, step_s,
                           reference::DartSettings{.implicit_spring = implicit_spring, .joint_damping = joint_damping});
                     }});
  return all;
}

/// One row, from as many of the flights as fit into one minute.
WorkPrecisionRow row_of(const PeerSettings& peer, double step_s, const std::vector<OwnFlight>& flights,
                        const std::vector<std::vector<std::array<double, 2>>>& voltages,
                        const std::vector<Flight>& exact) {
  std::vector<Flight> ends;
  double took_s = 0;
  while (ends.size() < flights.size() && took_s < 60) {
    const auto [end, seconds] = peer.fly(flights[ends.size()], voltages[ends.size()], step_s);
    ends.push_back(end);
    took_s += seconds;
  }
  const auto [position_m, attitude_rad] = rms(ends, exact);
  return {peer.engine, peer.name,    step_s,
          position_m,  attitude_rad, kFlight_s * static_cast<double>(ends.size()) / took_s};
}
#endif

}  // namespace

std::vector<Errors> errors_of(const model::Vehicle& vehicle, const Manoeuvre& manoeuvre,
                              const std::vector<double>& steps_s) {
  const std::vector<OwnFlight> flights = draw(vehicle, manoeuvre);
  const std::vector<Flight> exact = free_flights(flights, manoeuvre.exact_step_s);
  const std::vector<double> exact_N = thrusts_N(flights, manoeuvre.exact_step_s);
  std::vector<Errors> errors;
  for (const double step_s : steps_s) {
    const auto [position_m, attitude_rad] = rms(free_flights(flights, step_s), exact);
    const std::vector<double> thrust_N = thrusts_N(flights, step_s);
    double thrust = 0, mean_N = 0;
    for (std::size_t i = 0; i < flights.size(); ++i) {
      thrust += std::pow(thrust_N[i] - exact_N[i], 2);
      mean_N += exact_N[i];
    }
    const auto n = static_cast<double>(flights.size());
    errors.push_back({position_m, attitude_rad, std::sqrt(thrust / n) / (mean_N / n)});
  }
  return errors;
}

void write_flights([[maybe_unused]] const model::Vehicle& vehicle, [[maybe_unused]] std::size_t count,
                   [[maybe_unused]] const std::filesystem::path& folder) {
#ifdef FLAPPY_HAVE_PEERS
  std::vector<OwnFlight> flights = draw(vehicle, kAboutHover);
  flights.resize(std::min(count, flights.size()));
  const std::vector<Flight> exact = free_flights(flights, kAboutHover.exact_step_s);
  const auto voltages = voltages_of(flights);
  nlohmann::json all = nlohmann::json::array();
  std::filesystem::create_directories(folder);
  for (std::size_t i = 0; i < flights.size(); ++i) {
    const std::string file = "vehicle_" + std::to_string(i) + ".toml";
    io::write_atomically(folder / file, model::vehicle_text(flights[i].vehicle));
    all.push_back({{"vehicle", file},
                   {"stroke_rad", flights[i].start.stroke_rad},
                   {"rotation_rad", flights[i].start.rotation_rad},
                   {"voltages_V", voltages[i]},
                   {"end_m", {exact[i].x_m, exact[i].y_m, exact[i].z_m}}});
  }
  io::write_atomically(folder / "flights.json", all.dump() + "\n");
#else
  throw io::InputError("--flights: this build has neither MuJoCo nor DART; accepted: a build of scripts/bench");
#endif
}

std::vector<WorkPrecisionRow> work_precision(const model::Vehicle& vehicle, [[maybe_unused]] double enough_m,
                                             [[maybe_unused]] bool peers,
                                             const std::function<void(double done, const std::string& now)>& tell) {
  const std::vector<OwnFlight> flights = draw(vehicle, kAboutHover);
  const std::vector<Flight> exact = free_flights(flights, kAboutHover.exact_step_s);
  std::vector<WorkPrecisionRow> rows;
  double most = 8;  // largest number of rows
#ifdef FLAPPY_HAVE_PEERS
  constexpr double kPeerSteps_us[] = {1000, 500, 250, 200, 125, 100, 50, 25, 20, 10, 5};
  const std::vector<PeerSettings> settings = peers ? peer_settings() : std::vector<PeerSettings>();
  most += static_cast<double>(settings.size() * std::size(kPeerSteps_us));
#endif
  const auto print_time = [&](const std::string& engine, double us) {
    tell(static_cast<double>(rows.size()) / most, engine + " at " + std::to_string(static_cast<int>(us)) + " us");
  };
  for (const double us : {500, 250, 200, 125, 100, 50, 25, 10}) {
    const double step_s = us * 1e-6;
    print_time("flappy", us);
    const auto [position_m, attitude_rad] = rms(free_flights(flights, step_s), exact);
    rows.push_back({"flappy", "float", step_s, position_m, attitude_rad, flapper_s_per_cpu_s(flights, step_s)});
  }
#ifdef FLAPPY_HAVE_PEERS
  if (!peers) return rows;
  const auto voltages = voltages_of(flights);
  for (const PeerSettings& peer : settings) {
    double before_m = 0;
    for (const double us : kPeerSteps_us) {
      print_time(peer.engine + ", " + peer.name, us);
      rows.push_back(row_of(peer, us * 1e-6, flights, voltages, exact));
      const double error_m = rows.back().position_error_m;
      const bool settled = us <= 100 && std::abs(error_m / before_m - 1) < 0.02;  // at another limit than ours
      if (error_m < enough_m / 2 || settled) break;
      before_m = error_m;
    }
  }
#endif
  return rows;
}

}  // namespace flappy::bench
