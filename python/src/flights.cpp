// Binds closed-loop fleets, flight logs, and pages of flights.
#include <nanobind/stl/array.h>

#include <variant>

#include "bind.hpp"
#include "flightlog/flight_log.hpp"
#include "io/progress.hpp"
#include "rollout/fly.hpp"
#include "rollout/rollout.hpp"
#include "sim/storage.hpp"
#include "view/flight_section.hpp"

namespace flappy::python {
namespace {

using flightlog::Column;
using flightlog::FlightLog;

class PyFleet {
 public:
  PyFleet(const std::filesystem::path& config, const std::vector<std::string>& overrides, std::size_t count)
      : path_(config), overrides_(overrides) {
    const nb::gil_scoped_release free;
    const rollout::FlyConfig read = rollout::read_fly_config(found(config), overrides);
    if (read.precision == "float") flights_ = std::make_unique<rollout::Rollout<float>>(read, count);
    else flights_ = std::make_unique<rollout::Rollout<double>>(read, count);
  }
  auto with(const auto& call) const {
    return std::visit([&](auto& flights) { return call(*flights); }, flights_);
  }
  /// A copy that flies on from the same state.
  PyFleet(const PyFleet& other) : path_(other.path_), overrides_(other.overrides_) {
    const Turn turn(other.busy_, "the fleet");
    other.with([&]<class T>(rollout::Rollout<T>& f) { flights_ = std::make_unique<rollout::Rollout<T>>(f); });
  }
  /// The configuration from which an equal fleet can be made.
  nb::tuple made_of() const { return nb::make_tuple(path_, size(), overrides_); }
  std::size_t size() const {
    return with([](auto& f) { return f.fleet().size(); });
  }
  std::atomic_flag& busy() const { return busy_; }

  /// An array with `width` numbers for each flapper, or one-dimensional with one number each where `width` is 0.
  template <class T = double>
  Array<T> rows(std::size_t width, const auto& put) const {
    const Turn turn(busy_, "the fleet");
    auto array = width > 0 ? make_array<T>({size(), width}) : make_array<T>({size()});
    with([&](auto& f) {
      for (std::size_t i = 0; i < f.fleet().size(); ++i)
        put(f.fleet(), i, array.data() + i * std::max<std::size_t>(width, 1));
    });
    return array;
  }

 private:
  std::filesystem::path path_;
  std::vector<std::string> overrides_;
  std::variant<std::unique_ptr<rollout::Rollout<double>>, std::unique_ptr<rollout::Rollout<float>>> flights_;
  mutable std::atomic_flag busy_ = ATOMIC_FLAG_INIT;
};

nb::dict motion(const PyFleet& fleet, const auto& of) {
  nb::dict d;
  d["position_m"] =
      fleet.rows(3, [&](auto& f, std::size_t i, double* to) { std::ranges::copy(of(f, i).position_m, to); });
  d["attitude"] = fleet.rows(4, [&](auto& f, std::size_t i, double* to) { std::ranges::copy(of(f, i).attitude, to); });
  d["velocity_m_s"] =
      fleet.rows(3, [&](auto& f, std::size_t i, double* to) { std::ranges::copy(of(f, i).velocity_m_s, to); });
  d["body_rate_rad_s"] =
      fleet.rows(3, [&](auto& f, std::size_t i, double* to) { std::ranges::copy(of(f, i).body_rate_rad_s, to); });
  return d;
}

void bind_fleet(nb::module_& m) {
  nb::class_<PyFleet> type(m, "Fleet",
                           "Many flights of a configuration of flappy-fly, in closed loop with its sensors, estimator "
                           "and controller, and its actor "
                           "where it has one. A row for each flapper, SI units.");
  bind_copies(type);
  type.def("__reduce__", [](const PyFleet& f) { return nb::make_tuple(nb::type<PyFleet>(), f.made_of()); })
      .def(
          "__init__",
          [](PyFleet* self, const std::filesystem::path& config, std::int64_t count,
             const std::vector<std::string>& overrides) {
            if (count < 1)
              throw nb::value_error(("count: is " + std::to_string(count) + "; accepted: 1 and more").c_str());
            new (self) PyFleet(config, overrides, static_cast<std::size_t>(count));
          },
          "config"_a, "count"_a = 1, "overrides"_a = std::vector<std::string>{})
      .def("__len__", &PyFleet::size)
      .def(
          "step",
          [](const PyFleet& fleet, int periods) {
            if (periods < 0) throw nb::value_error("periods: accepted: 0 and more");
            const Turn turn(fleet.busy(), "the fleet");
            const nb::gil_scoped_release free;
            fleet.with([&](auto& f) {
              for (int k = 0; k < periods; ++k) f.step();
            });
          },
          "periods"_a = 1, "Flies all for so many control periods; the interpreter is free meanwhile.")
      .def_prop_ro("t_s", [](const PyFleet& fleet) { return fleet.with([](auto& f) { return f.t_s(); }); })
      .def_prop_ro("period_s",
                   [](const PyFleet& fleet) { return fleet.with([](auto& f) { return f.fleet().period_s(); }); })
      .def(
          "truth",
          [](const PyFleet& fleet) { return motion(fleet, [](auto& f, std::size_t i) { return f.truth(i); }); },
          "True motion: position_m (count, 3), attitude (count, 4), velocity_m_s (count, 3), body_rate_rad_s (count, "
          "3).")
      .def(
          "estimate",
          [](const PyFleet& fleet) { return motion(fleet, [](auto& f, std::size_t i) { return f.estimate(i); }); },
          "As the estimator has it.")
      .def(
          "inputs",
          [](const PyFleet& fleet) {
            return fleet.rows(4, [](auto& f, std::size_t i, double* to) {
              const sim::Input u = f.input(i);
              to[0] = u.amplitude_V, to[1] = u.difference_V, to[2] = u.bias_V, to[3] = u.split_cycle;
            });
          },
          "Of the wing beat (count, 4): V, V, V and fractions of a beat, as last set, before the driver clips them.")
      .def(
          "observations",
          [](const PyFleet& fleet) {
            const std::size_t width = fleet.with([](auto& f) { return f.fleet().observation(0).size(); });
            return fleet.rows<float>(width, [](auto& f, std::size_t i, float* to) {
              for (const double x : f.observation(i)) *to++ = static_cast<float>(x);
            });
          },
          "Of the task, float32 (count, observations).")
      .def(
          "rewards",
          [](const PyFleet& fleet) {
            return fleet.rows(0, [](auto& f, std::size_t i, double* to) { *to = f.reward(i); });
          },
          "Of the last control period (count,).")
      .def(
          "ended",
          [](const PyFleet& fleet) {
            return fleet.rows<std::uint32_t>(0, [](auto& f, std::size_t i, std::uint32_t* to) { *to = f.ended(i); });
          },
          "Why each one's task is over, bits, uint32 (count,): 1 time out, 2 contact, 4 not finite, 8 out of bounds, "
          "16 heading late, 32 arrival late.")
      .def(
          "hash",
          [](const PyFleet& fleet) {
            const Turn turn(fleet.busy(), "the fleet");
            return fleet.with([](auto& f) {
              std::uint64_t hash = 0;
              for (std::size_t i = 0; i < f.fleet().size(); ++i)
                hash = sim::mixed(hash, f.fleet().batch().hash(i, i + 1));
              return hash;
            });
          },
          "Of how all vehicles move, as flappy-fly prints it.");
}

// ---- flight logs: a dict of streams, each a dict of columns

struct NamedColumn {
  const char* name;
  Column* column;
};

/// Calls visit(name of a stream, its columns) for all streams of a log.
void streams(FlightLog& log, const auto& visit) {
  auto& c = log.command;
  std::vector<NamedColumn> command = {{"t_s", &c.t_s}};
  if (log.header.inputs.empty())
    command.insert(command.end(), {{"left_voltage_V", &c.left_voltage_V}, {"right_voltage_V", &c.right_voltage_V}});
  for (std::size_t i = 0; i < c.declared.size(); ++i) command.push_back({log.header.inputs[i].c_str(), &c.declared[i]});
  if (c.inputs)
    command.insert(command.end(), {{"amplitude_V", &c.inputs->amplitude_V},
                                   {"difference_V", &c.inputs->difference_V},
                                   {"bias_V", &c.inputs->bias_V},
                                   {"split_cycle", &c.inputs->split_cycle}});
  if (c.phase_rad) command.push_back({"phase_rad", &*c.phase_rad});
  visit("command", command);
  auto& p = log.mocap;
  visit("mocap", std::vector<NamedColumn>{{"t_s", &p.t_s},
                                          {"x_m", &p.x_m},
                                          {"y_m", &p.y_m},
                                          {"z_m", &p.z_m},
                                          {"qw", &p.qw},
                                          {"qx", &p.qx},
                                          {"qy", &p.qy},
                                          {"qz", &p.qz}});
  auto& u = log.imu;
  std::vector<NamedColumn> imu = {{"t_s", &u.t_s}};
  if (log.header.imu.gyro)
    imu.insert(
        imu.end(),
        {{"gyro_x_rad_s", &u.gyro_x_rad_s}, {"gyro_y_rad_s", &u.gyro_y_rad_s}, {"gyro_z_rad_s", &u.gyro_z_rad_s}});
  imu.insert(imu.end(),
             {{"accel_x_m_s2", &u.accel_x_m_s2}, {"accel_y_m_s2", &u.accel_y_m_s2}, {"accel_z_m_s2", &u.accel_z_m_s2}});
  if (log.header.imu.rate_hz > 0) visit("imu", imu);
  if (log.power) {
    auto& b = *log.power;
    std::vector<NamedColumn> power = {{"t_s", &b.t_s}, {"battery_V", &b.battery_V}};
    if (log.header.power->currents)
      power.insert(power.end(), {{"left_current_A", &b.left_current_A}, {"right_current_A", &b.right_current_A}});
    visit("power", power);
  }
  if (log.wings)
    visit("wings", std::vector<NamedColumn>{{"t_s", &log.wings->t_s},
                                            {"left_stroke_rad", &log.wings->left_stroke_rad},
                                            {"left_rotation_rad", &log.wings->left_rotation_rad},
                                            {"right_stroke_rad", &log.wings->right_stroke_rad},
                                            {"right_rotation_rad", &log.wings->right_rotation_rad}});
  if (log.attitude) {
    auto& a = *log.attitude;
    visit("attitude",
          std::vector<NamedColumn>{{"t_s", &a.t_s}, {"qw", &a.qw}, {"qx", &a.qx}, {"qy", &a.qy}, {"qz", &a.qz}});
  }
}

nb::dict read_flight(const std::filesystem::path& folder) {
  FlightLog log = flightlog::read_flight_log(folder);
  nb::dict flight;
  flight["header"] = flightlog::flight_log_files(log).at(flightlog::log_file::kHeader);
  streams(log, [&](const char* name, const std::vector<NamedColumn>& columns) {
    nb::dict stream;
    for (const NamedColumn& c : columns) {
      auto array = make_array<double>({c.column->size()});
      std::ranges::copy(*c.column, array.data());
      stream[c.name] = array;
    }
    flight[name] = stream;
  });
  return flight;
}

/// Converts the dict of read_flight to a log. Goes through the text of the files, so that errors read as those of a log in `folder`.
FlightLog log_of(const nb::dict& flight, const std::filesystem::path& folder) {
  flightlog::LogFiles files;
  for (const auto [key, value] : flight) {
    const std::string name = nb::cast<std::string>(key);
    if (name == "header") {
      files[flightlog::log_file::kHeader] = nb::cast<std::string>(value);
      continue;
    }
    std::string head;
    std::vector<nb::ndarray<const double, nb::ndim<1>, nb::c_contig, nb::device::cpu>> columns;
    for (const nb::handle column : value.attr("keys")()) {
      const std::string column_name = nb::cast<std::string>(column);
      head += (head.empty() ? "" : ",") + column_name;
      const nb::object array =
          nb::module_::import_("numpy").attr("ascontiguousarray")(value[column], "dtype"_a = "float64");
      if (!nb::try_cast(array, columns.emplace_back(), false) || columns.back().size() != columns.front().size())
        throw nb::value_error(
            (name + "." + column_name + ": is " + described(value[column]) + "; accepted: one number in each row")
                .c_str());
    }
    std::string text = head + "\n";
    for (std::size_t row = 0; !columns.empty() && row < columns.front().size(); ++row)
      for (std::size_t k = 0; k < columns.size(); ++k)
        text += io::shortest_digits(columns[k].data()[row]) + (k + 1 < columns.size() ? "," : "\n");
    files[name + ".csv"] = text;
  }
  return flightlog::parse_flight_log(files, folder);
}

void write_flight(const std::filesystem::path& folder, const nb::dict& flight) {
  flightlog::write_flight_log(folder, log_of(flight, folder));
}

/// The HTML page of flights. Each is a folder or a dict of read_flight; a dict is named by its place in the list.
std::string flights_page(const nb::list& flights, const std::optional<std::filesystem::path>& vehicle,
                         const std::optional<std::array<double, 3>>& goal_m) {
  std::vector<view::ShownFlight> shown;
  for (const nb::handle flight : flights) {
    if (nb::isinstance<nb::dict>(flight)) {
      const std::string name = "flight " + std::to_string(shown.size() + 1);
      shown.push_back({name, name, log_of(nb::cast<nb::dict>(flight), name)});
    } else {
      const auto folder = nb::cast<std::filesystem::path>(flight);
      shown.push_back({io::folder_name(std::filesystem::absolute(folder).lexically_normal()), folder,
                       flightlog::read_flight_log(folder)});
    }
  }
  const nb::gil_scoped_release free;
  view::Packing packing;
  const view::Section section =
      view::flight_section(std::move(shown), {vehicle ? found(*vehicle) : std::filesystem::path(), goal_m}, packing);
  return view::page_text(section.title(), {section}, packing);
}

/// Wall-clock seconds for `steps` steps of `periods` control periods of the fleet alone, the reference for the speed of environments.
double fleet_seconds(const std::filesystem::path& config, const std::vector<std::string>& overrides, std::size_t count,
                     int periods, int steps) {
  const rollout::FlyConfig fly = rollout::read_fly_config(found(config), overrides);
  const nb::gil_scoped_release free;
  flight::Fleet<float> fleet(count, fly.vehicle, fly.fleet);
  const auto step = [&] {
    fleet.begin(periods);
    io::parallel_for(fleet.blocks(), fly.fleet.batch.threads, [&](std::size_t b) { fleet.fly_block(b); });
    fleet.end();
  };
  for (int k = 0; k < 30; ++k) step();
  const double start = io::steady_seconds();
  for (int k = 0; k < steps; ++k) step();
  return io::steady_seconds() - start;
}

nb::dict fly(const std::filesystem::path& config, const std::vector<std::string>& overrides, std::size_t count,
             const std::optional<std::filesystem::path>& log) {
  if (count < 1) throw nb::value_error("count: is 0; accepted: 1 and more");
  rollout::FlyOptions options;
  options.count = count;
  options.keep_going = [](double) { return !io::interrupted(); };
  if (log) options.log_folder = *log;
  rollout::FlyResult result;
  bool stopped = false;
  {
    const Interruptible until_done;
    const nb::gil_scoped_release free;
    result = rollout::fly(rollout::read_fly_config(found(config), overrides), options);
    stopped = io::interrupted();
  }
  if (stopped) raise_interrupt();
  nb::dict d;
  d["hash"] = result.hash, d["successes"] = result.successes, d["flown_s"] = result.flown_s, d["logs"] = result.logs;
  return d;
}

}  // namespace

void bind_flights(nb::module_& m) {
  bind_fleet(m);
  m.def("read_flight", &read_flight, "folder"_a,
        "A flight log: \"header\" (the text of flight.toml) and the streams command, mocap, imu, and power, wings and "
        "attitude where it has them, each a dict "
        "of columns, float64 (samples,), in the units that their names end with. InputError: \"file:line: what; what "
        "is accepted\".");
  m.def("write_flight", &write_flight, "folder"_a, "flight"_a,
        "Writes what read_flight reads, whole or not at all; streams may be pandas frames. InputError for what would "
        "be refused when read.");
  m.def("flights_page", &flights_page, "flights"_a, "vehicle"_a = nb::none(), "goal_m"_a = nb::none(),
        "What flappy-report writes of flights, folders or what read_flight returns: the text of an HTML file.");
  m.def("fleet_seconds", &fleet_seconds, "config"_a, "overrides"_a, "count"_a, "periods"_a, "steps"_a);
  m.def("fly", &fly, "config"_a, "overrides"_a = std::vector<std::string>{}, "count"_a = 1, "log"_a = nb::none(),
        "What flappy-fly does. A dict: hash (as flappy-fly prints it), successes (flights), flown_s (duration of each "
        "flight), logs (folders written into `log`). InputError for a faulty file; KeyboardInterrupt after Ctrl-C.");
}

}  // namespace flappy::python
