// Binds diagnosis and identification from measurements: flappy-gap diagnose, flappy-identify forces.
#include "bind.hpp"
#include "flappy/vehicle_file.hpp"
#include "gap/diagnose/diagnose_command.hpp"
#include "identify/force_fit.hpp"
#include "io/progress.hpp"

namespace flappy::python {
namespace {

nb::object of_json(const nlohmann::ordered_json& json) {
  return nb::module_::import_("json").attr("loads")(json.dump());
}

nb::object diagnose(const std::filesystem::path& vehicle, const std::vector<std::string>& flights,
                    const std::string& out, const std::vector<std::string>& reference,
                    const std::vector<std::string>& withheld, const std::string& manoeuvre, int threads) {
  gap::DiagnoseCommand command;
  command.settings.vehicle = found(vehicle);
  command.settings.flights = flights;
  command.settings.reference = reference;
  command.out = out;
  command.settings.withheld = withheld;
  if (!manoeuvre.empty()) command.settings.manoeuvre = found(manoeuvre);
  command.settings.threads = threads;
  command.quiet = true;
  nlohmann::ordered_json json;
  bool stopped = false;
  {
    const Interruptible until_done;
    const nb::gil_scoped_release free;
    json = gap::run_diagnose(command);
    stopped = io::interrupted();
  }
  if (stopped) raise_interrupt();
  return of_json(json);
}

nb::dict identify(const std::filesystem::path& vehicle_file, const std::filesystem::path& measured_file,
                  const std::filesystem::path& config_file, const std::vector<std::string>& parameters, int starts,
                  std::uint64_t seed, int threads) {
  if (starts < 1) throw nb::value_error(("starts: is " + std::to_string(starts) + "; accepted: 1 and more").c_str());
  identify::ForceFit fit;
  model::Vehicle vehicle;
  {
    const Interruptible until_done;
    const nb::gil_scoped_release free;
    vehicle = model::read_vehicle_for_steps(found(vehicle_file), identify::kStep_s);
    const identify::FitConfig config = identify::read_fit_config(found(config_file), vehicle, parameters);
    identify::FitOptions options;
    options.map.threads = threads;
    options.starts = starts;
    options.seed = seed;
    options.progress = [](const std::string&, double, double) { return !io::interrupted(); };
    fit = identify::fit_forces(vehicle, identify::read_measured_map(measured_file, vehicle.driver), config, options);
  }
  if (fit.stopped) raise_interrupt();
  fit.vehicle.name = vehicle.name + "_fitted";
  fit.vehicle.posterior.reset();
  nb::list all;
  for (const identify::FittedParameter& p : fit.known.parameters) {
    nb::dict d;
    d["name"] = p.path, d["value"] = p.value, d["low"] = p.low, d["high"] = p.high, d["nominal"] = p.nominal;
    d["seen"] = p.seen, d["at_bound"] = p.at_bound, d["at_nominal"] = p.at_nominal;
    all.append(d);
  }
  nb::dict result;
  result["vehicle"] = nb::cast(fit.vehicle);
  result["parameters"] = all;
  result["error_before_percent"] = fit.before.total, result["error_after_percent"] = fit.after.total;
  result["misfit"] = fit.known.misfit;
  result["starts_agreed"] = fit.starts_agreed;
  return result;
}

}  // namespace

void bind_diagnosis(nb::module_& m) {
  m.def("diagnose", &diagnose, "vehicle"_a, "flights"_a, "out"_a = "", "reference"_a = std::vector<std::string>{},
        "withheld"_a = std::vector<std::string>{}, "manoeuvre"_a = "", "threads"_a = 0,
        "What flappy-gap diagnose says of flight logs: the content of diagnosis.json. `vehicle`: the file as it was "
        "believed; `flights`: folders of "
        "logs; `reference`: folders of logs of the same robot from before the change that is asked about; `out`: "
        "folder for its files, the corrected vehicle among them. InputError for what cannot be read; "
        "KeyboardInterrupt.");
  m.def("identify", &identify, "vehicle"_a, "measured"_a, "config"_a = "identify/forces.toml",
        "parameters"_a = std::vector<std::string>{}, "starts"_a = 3, "seed"_a = 1, "threads"_a = 0,
        "Fits a vehicle to a measured force map, as flappy-identify forces does: vehicle (a Vehicle), parameters "
        "(name, value, the 95 % interval low to "
        "high, ...), error_before_percent, error_after_percent, misfit (1 where noise alone is left), starts_agreed.");
}

}  // namespace flappy::python
