// Binds vehicles, and batches of them in open loop: flappy::sim::Batch, with a row of an array for each flapper.
#include <algorithm>
#include <cmath>
#include <span>
#include <variant>

#include "bind.hpp"
#include "flappy/batch.hpp"
#include "flappy/vehicle_file.hpp"
#include "io/files.hpp"

namespace flappy::python {
namespace {

using model::Vehicle;

model::Parameter parameter(Vehicle& v, const std::string& path) {
  std::vector<std::string> paths;
  for (const model::Parameter& p : model::parameters(v)) {
    if (p.path == path) return p;
    paths.push_back(p.path);
  }
  throw nb::key_error((path + ": no such parameter of a vehicle; accepted: those of Vehicle.parameters()" +
                       io::did_you_mean(path, paths))
                          .c_str());
}

/// A batch in double or single precision.
class PyBatch {
 public:
  PyBatch(std::size_t count, const Vehicle& vehicle, double step_s, int threads, const sim::World& world,
          const std::string& instruction_set, bool meters_energy, bool single)
      : vehicle_(vehicle), options_{step_s, threads, world, instruction_set, meters_energy}, count_(count) {
    const sim::BatchOptions& options = options_;
    if (single) batch_ = std::make_unique<sim::Batch<float>>(count, vehicle, options);
    else batch_ = std::make_unique<sim::Batch<double>>(count, vehicle, options);
  }

  auto with(const auto& call) const {
    return std::visit([&](auto& batch) { return call(*batch); }, batch_);
  }
  /// A copy that flies on from the same state.
  PyBatch(const PyBatch& other) : vehicle_(other.vehicle_), options_(other.options_), count_(other.count_) {
    const Turn turn(other.busy_, "the batch");
    other.with([&]<class T>(sim::Batch<T>& batch) { batch_ = std::make_unique<sim::Batch<T>>(batch); });
  }
  /// The vehicle and options from which an equal batch can be made.
  nb::tuple made_of() const {
    const bool single = std::holds_alternative<std::unique_ptr<sim::Batch<float>>>(batch_);
    return nb::make_tuple(count_, vehicle_, options_.step_s, options_.threads, options_.world, options_.instruction_set,
                          options_.meters_energy, single ? "float" : "double");
  }

  std::size_t size() const { return count_; }
  bool meters_energy() const { return options_.meters_energy; }
  std::size_t at(std::int64_t i) const { return checked_index(i, count_); }
  std::atomic_flag& busy() const { return busy_; }

 private:
  Vehicle vehicle_;
  sim::BatchOptions options_;
  std::size_t count_;
  std::variant<std::unique_ptr<sim::Batch<double>>, std::unique_ptr<sim::Batch<float>>> batch_;
  mutable std::atomic_flag busy_ = ATOMIC_FLAG_INIT;
};

/// The members of a state: name, index of the first number, and number of numbers.
struct Part {
  const char* name;
  std::size_t first, width;
};
constexpr Part kParts[] = {{"position_m", 0, 3},
                           {"attitude", 3, 4},
                           {"velocity_m_s", 7, 3},
                           {"body_rate_rad_s", 10, 3},
                           {"stroke_rad", 13, 2},
                           {"rotation_rad", 15, 2},
                           {"stroke_rate_rad_s", 17, 2},
                           {"rotation_rate_rad_s", 19, 2},
                           {"stroke_acceleration_rad_s2", 21, 2},
                           {"rotation_acceleration_rad_s2", 23, 2}};
static_assert(sizeof(sim::FlapperState) == 25 * sizeof(double));

sim::Start start_of(const std::string& name) {
  if (name == "flying") return sim::Start::flying;
  if (name == "standing") return sim::Start::standing;
  if (name == "welded") return sim::Start::welded;
  throw nb::value_error(("start: is \"" + name + "\"; accepted: flying, standing, welded").c_str());
}

using Doubles = nb::ndarray<const double, nb::c_contig, nb::device::cpu>;

sim::FlapperState state_of(const nb::dict& given) {
  sim::FlapperState s;
  for (const auto [key, value] : given) {
    const std::string name = nb::cast<std::string>(key);
    const auto part = std::ranges::find(kParts, name, &Part::name);
    if (part == std::end(kParts)) {
      std::vector<std::string> names;
      for (const Part& p : kParts) names.emplace_back(p.name);
      throw nb::key_error(("state: no part \"" + name + "\"; accepted: " + io::joined(names)).c_str());
    }
    const auto array =
        nb::cast<Doubles>(nb::module_::import_("numpy").attr("ascontiguousarray")(value, "dtype"_a = "float64"));
    if (array.ndim() != 1 || array.size() != part->width)
      throw nb::value_error(
          (name + ": is " + described(value) + "; accepted: float64 of shape (" + std::to_string(part->width) + ",)")
              .c_str());
    if (!std::ranges::all_of(std::span(array.data(), part->width), [](double x) { return std::isfinite(x); }))
      throw nb::value_error((name + ": is not finite; accepted: finite numbers").c_str());
    if (name == "attitude" &&
        std::ranges::all_of(std::span(array.data(), part->width), [](double x) { return x == 0; }))
      throw nb::value_error("attitude: is 0, no rotation; accepted: a quaternion (w, x, y, z)");
    std::copy_n(array.data(), part->width, reinterpret_cast<double*>(&s) + part->first);
  }
  return s;
}

/// Calls `set(i, row)` for every flapper, with an array of one row for each flapper or of one row for all. Throws ValueError for other
/// shapes and for numbers that are not finite.
void for_rows(nb::handle given, const char* name, std::size_t count, std::size_t width, const auto& set) {
  const auto array =
      nb::cast<Doubles>(nb::module_::import_("numpy").attr("ascontiguousarray")(given, "dtype"_a = "float64"));
  const bool one = array.ndim() == 1 && array.size() == width;
  if (!one && !(array.ndim() == 2 && array.shape(0) == count && array.shape(1) == width))
    throw nb::value_error((std::string(name) + ": is " + described(given) + "; accepted: float64 of shape " +
                           shape_text({{count, width}}) + " or " + shape_text({{width}}))
                              .c_str());
  for (std::size_t k = 0; k < array.size(); ++k)
    if (!std::isfinite(array.data()[k]))
      throw nb::value_error((std::string(name) + ": is not finite; accepted: finite numbers").c_str());
  for (std::size_t i = 0; i < count; ++i) set(i, array.data() + (one ? 0 : i * width));
}

void bind_batch(nb::module_& m) {
  nb::class_<sim::Wall>(m, "Wall",
                        "A vertical wall through (x_m, y_m); its normal has length 1 and points into the free space.")
      .def(
          "__init__",
          [](sim::Wall* w, double x, double y, double nx, double ny) {
            if (!(std::abs(std::hypot(nx, ny) - 1) < 1e-6))
              throw nb::value_error("normal: its length is not 1; accepted: normal_x and normal_y of a unit vector");
            new (w) sim::Wall{x, y, nx, ny};
          },
          "x_m"_a, "y_m"_a, "normal_x"_a, "normal_y"_a)
      .def("__reduce__", [](const sim::Wall& w) {
        return nb::make_tuple(nb::type<sim::Wall>(), nb::make_tuple(w.x_m, w.y_m, w.normal_x, w.normal_y));
      });
  nb::class_<sim::World>(m, "World", "What surrounds the flappers. The defaults stand for none: far away.")
      .def(
          "__init__",
          [](sim::World* w, double gravity, double ground, double ceiling, const std::vector<sim::Wall>& walls) {
            new (w) sim::World{gravity, ground, ceiling, walls};
          },
          "gravity_m_s2"_a = 9.81, "ground_z_m"_a = -1e3, "ceiling_z_m"_a = 1e3, "walls"_a = std::vector<sim::Wall>{})
      .def("__reduce__", [](const sim::World& w) {
        return nb::make_tuple(nb::type<sim::World>(),
                              nb::make_tuple(w.gravity_m_s2, w.ground_z_m, w.ceiling_z_m, w.walls));
      });

  nb::class_<PyBatch> type(m, "Batch",
                           "Many flappers in open loop (flappy::sim::Batch): their bytes depend neither on threads nor "
                           "on batch or processor.");
  bind_copies(type);
  type.def("__reduce__", [](const PyBatch& b) { return nb::make_tuple(nb::type<PyBatch>(), b.made_of()); })
      .def(
          "__init__",
          [](PyBatch* self, std::int64_t count, const Vehicle& vehicle, double step_s, int threads,
             const sim::World& world, const std::string& instruction_set, bool meters_energy,
             const std::string& precision) {
            if (count < 1)
              throw nb::value_error(("count: is " + std::to_string(count) + "; accepted: 1 and more").c_str());
            if (precision != "float" && precision != "double")
              throw nb::value_error(("precision: is \"" + precision + "\"; accepted: float, double").c_str());
            new (self) PyBatch(static_cast<std::size_t>(count), vehicle, step_s, threads, world, instruction_set,
                               meters_energy, precision == "float");
          },
          "count"_a, "vehicle"_a, "step_s"_a = sim::kDefaultStep_s, "threads"_a = 0, "world"_a = sim::World{},
          "instruction_set"_a = "", "meters_energy"_a = false, "precision"_a = "double",
          "`count` copies of `vehicle`, flying at the origin with wings at rest and no voltage. ValueError where the "
          "driver's hold is no whole "
          "number of steps.")
      .def("__len__", &PyBatch::size)
      .def(
          "step",
          [](const PyBatch& b, int steps) {
            const Turn turn(b.busy(), "the batch");
            const nb::gil_scoped_release free;
            b.with([&](auto& batch) { batch.step(steps); });
          },
          "steps"_a = 1, "Advances all by `steps` physics steps; the interpreter is free meanwhile.")
      .def(
          "set_inputs",
          [](const PyBatch& b, nb::handle inputs) {
            const Turn turn(b.busy(), "the batch");
            for_rows(inputs, "inputs", b.size(), 4, [&](std::size_t i, const double* u) {
              b.with([&](auto& batch) { batch.set_input(i, {u[0], u[1], u[2], u[3]}); });
            });
          },
          "inputs"_a,
          "Inputs of the wing beat, float64 (count, 4) or (4,): amplitude, difference and bias in V, split cycle in "
          "beats.")
      .def(
          "set_voltages",
          [](const PyBatch& b, nb::handle voltages) {
            const Turn turn(b.busy(), "the batch");
            for_rows(voltages, "voltages", b.size(), 2, [&](std::size_t k, const double* v) {
              b.with([&](auto& batch) { batch.set_voltages(k, v[0], v[1]); });
            });
          },
          "voltages"_a,
          "Voltages of the left and the right motor in place of the wing beat's, float64 (count, 2) or (2,), each "
          "clipped to what its motor "
          "takes, until set_inputs or reset.")
      .def(
          "set_vehicle",
          [](const PyBatch& b, std::int64_t i, const Vehicle& v) {
            const Turn turn(b.busy(), "the batch");
            b.with([&](auto& batch) { batch.set_vehicle(b.at(i), v); });
          },
          "i"_a, "vehicle"_a, "Gives one a vehicle of its own; its state stays.")
      .def(
          "reset",
          [](const PyBatch& b, std::int64_t i, const nb::dict& state, const std::string& start) {
            const Turn turn(b.busy(), "the batch");
            b.with([&](auto& batch) { batch.reset(b.at(i), state_of(state), start_of(start)); });
          },
          "i"_a, "state"_a = nb::dict(), "start"_a = "flying",
          "Starts one anew, at the parts of a state that are given; the others as of a new batch.")
      .def(
          "states",
          [](const PyBatch& b) {
            const Turn turn(b.busy(), "the batch");
            nb::dict all;
            for (const Part& part : kParts) {
              auto array = make_array<double>({b.size(), part.width});
              for (std::size_t i = 0; i < b.size(); ++i) {
                const sim::FlapperState s = b.with([&](auto& batch) { return batch.state(i); });
                std::copy_n(reinterpret_cast<const double*>(&s) + part.first, part.width,
                            array.data() + i * part.width);
              }
              all[part.name] = array;
            }
            return all;
          },
          "A row for each flapper, SI units: position_m (count, 3), attitude (count, 4), velocity_m_s, "
          "body_rate_rad_s, stroke_rad (count, 2), ...")
      .def(
          "status",
          [](const PyBatch& b) {
            const Turn turn(b.busy(), "the batch");
            auto array = make_array<std::uint32_t>({b.size()});
            for (std::size_t i = 0; i < b.size(); ++i)
              array.data()[i] = b.with([&](auto& batch) { return batch.status(i); });
            return array;
          },
          "Bits, uint32 (count,): 1 frozen, 2 touched the ground, 4 the ceiling, 8 a wall.")
      .def(
          "energy_J",
          [](const PyBatch& b) {
            const Turn turn(b.busy(), "the batch");
            if (!b.meters_energy())
              throw nb::value_error("energy_J: is not metered; accepted: a batch with meters_energy");
            auto array = make_array<double>({b.size()});
            for (std::size_t i = 0; i < b.size(); ++i)
              array.data()[i] = b.with([&](auto& batch) { return batch.energy_J(i); });
            return array;
          },
          "What both motors drew since the reset, float64 (count,). ValueError unless `meters_energy`.")
      .def(
          "held_impulse",
          [](const PyBatch& b) {
            const Turn turn(b.busy(), "the batch");
            auto array = make_array<double>({b.size(), 6});
            for (std::size_t i = 0; i < b.size(); ++i) {
              const sim::HeldImpulse h = b.with([&](auto& batch) { return batch.held_impulse(i); });
              std::copy_n(h.force_N_s, 3, array.data() + 6 * i);
              std::copy_n(h.moment_Nm_s, 3, array.data() + 6 * i + 3);
            }
            return array;
          },
          "What the air did to the wings of standing or welded ones since their reset, float64 (count, 6): N s and N m "
          "s, in B about the "
          "torso origin.")
      .def(
          "support",
          [](const PyBatch& b) {
            const Turn turn(b.busy(), "the batch");
            static constexpr const char* kNames[] = {"flying", "standing", "welded"};
            std::vector<std::string> names;
            for (std::size_t i = 0; i < b.size(); ++i)
              names.emplace_back(kNames[static_cast<int>(b.with([&](auto& batch) { return batch.support(i); }))]);
            return names;
          },
          "What holds each: \"flying\", \"standing\" or \"welded\".")
      .def(
          "hash",
          [](const PyBatch& b) {
            const Turn turn(b.busy(), "the batch");
            return b.with([](auto& batch) { return batch.hash(); });
          },
          "Of every number that moves.");
  m.def("instruction_sets", &sim::instruction_sets, "Those that this processor can run, the best last.");
}

}  // namespace

void bind_vehicle(nb::module_& m) {
  nb::class_<Vehicle> type(m, "Vehicle",
                           "A vehicle as its file states it; `vehicle[\"left.motor.resistance_ohm\"]` is one of its "
                           "parameters, in its unit.");
  bind_copies(type);
  type.def("__getstate__", [](const Vehicle& v) { return model::vehicle_text(v); })
      .def("__setstate__",
           [](Vehicle& v, const std::string& text) { new (&v) Vehicle(model::parse_vehicle(text, "the vehicle")); })
      .def(
          "__init__",
          [](Vehicle* self, const std::filesystem::path& path, const std::vector<std::string>& overrides) {
            new (self) Vehicle(model::read_vehicle(found(path), overrides));
          },
          "path"_a, "overrides"_a = std::vector<std::string>{},
          "Reads a vehicle file; InputError, one line with file, line and column.")
      .def_rw("name", &Vehicle::name)
      .def(
          "parameters",
          [](Vehicle& v) {
            nb::dict all;
            for (const model::Parameter& p : model::parameters(v)) all[p.path.c_str()] = *p.value;
            return all;
          },
          "All paths with their values.")
      .def("__getitem__", [](Vehicle& v, const std::string& path) { return *parameter(v, path).value; })
      .def("__setitem__",
           [](Vehicle& v, const std::string& path, double value) {
             const model::Parameter p = parameter(v, path);
             if (!(value >= p.low && value <= p.high))
               throw nb::value_error((path + ": is " + io::shortest_digits(value) + "; accepted: " +
                                      io::shortest_digits(p.low) + " to " + io::shortest_digits(p.high))
                                         .c_str());
             *p.value = value;
           })
      .def("copy", [](const Vehicle& v) { return Vehicle(v); })
      .def_prop_ro(
          "text", [](const Vehicle& v) { return model::vehicle_text(v); }, "As a vehicle file.")
      .def("__repr__", [](const Vehicle& v) { return "<flappy.Vehicle " + v.name + ">"; });
  bind_batch(m);
}

}  // namespace flappy::python
