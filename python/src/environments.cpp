// Binds environments. A step writes directly into arrays that Python sees.
#include "rollout/environments.hpp"

#include <algorithm>
#include <array>
#include <memory>
#include <mutex>

#include "bind.hpp"
#include "view/shape.hpp"

namespace flappy::python {
namespace {

/// The memory that a step writes.
struct Buffer {
  Buffer(std::size_t count, std::size_t observations)
      : observation(count * observations), reward(count), terminated(new bool[count]()), truncated(new bool[count]()) {}
  std::vector<float> observation, reward;
  std::unique_ptr<bool[]> terminated, truncated;
};

/// Buffers that Python no longer uses, for the next steps.
struct Pool {
  std::mutex mutex;
  std::vector<std::unique_ptr<Buffer>> free;
};

/// A buffer that Python uses. It returns to the pool with the last array that refers to it.
struct Lease {
  explicit Lease(std::shared_ptr<Pool> from) : pool(std::move(from)) {}
  Lease(const Lease&) = delete;
  std::shared_ptr<Pool> pool;
  std::unique_ptr<Buffer> buffer;
  ~Lease() {
    const std::scoped_lock lock(pool->mutex);
    pool->free.push_back(std::move(buffer));
  }
};

/// The four arrays of a buffer: observation, reward, terminated, truncated.
using Shown = std::array<nb::object, 4>;

class PyEnvironments {
 public:
  PyEnvironments(const std::filesystem::path& config, const std::vector<std::string>& overrides, std::int64_t count,
                 const std::string& autoreset, bool copy)
      : pool_(std::make_shared<Pool>()), copy_(copy) {
    rollout::EnvironmentOptions options{static_cast<std::size_t>(count), rollout::Autoreset::same_step};
    if (count < 1 || count > 1'000'000)
      throw nb::value_error(("num_envs: is " + std::to_string(count) + "; accepted: 1 to 1000000").c_str());
    if (autoreset == "next_step") options.autoreset = rollout::Autoreset::next_step;
    if (autoreset == "disabled") options.autoreset = rollout::Autoreset::disabled;
    const nb::gil_scoped_release free;
    all_ = rollout::make_environments(rollout::read_fly_config(found(config), overrides), options);
  }

  /// A copy that flies on from the same state. It has memory of its own.
  PyEnvironments(const PyEnvironments& other) : pool_(std::make_shared<Pool>()), copy_(other.copy_) {
    const Turn turn(other.busy_, "the environment");
    if (other.all_) all_ = other.all_->copy();
    last_ = other.last_;
  }

  rollout::Environments& all() const {
    if (!all_) throw std::runtime_error("the environment is closed; accepted: calls before close()");
    return *all_;
  }
  std::size_t observations() const { return all().observed().size(); }

  nb::object reset(std::optional<std::uint64_t> seed) {
    const Turn turn(busy_, "the environment");
    Buffer& buffer = fresh();
    {
      const nb::gil_scoped_release free;
      all().reset(seed, buffer.observation.data());
    }
    keep(buffer);
    return shown_[0];
  }

  nb::object reset_some(const nb::ndarray<const bool, nb::ndim<1>, nb::c_contig, nb::device::cpu>& which) {
    const Turn turn(busy_, "the environment");
    const std::size_t count = all().count();
    if (which.size() != count)
      throw nb::value_error(("reset_mask: has shape " + shape_text({{which.size()}}) + "; accepted: bool of shape " +
                             shape_text({{count}}))
                                .c_str());
    Buffer& buffer = fresh();
    std::copy(last_.begin(), last_.end(), buffer.observation.begin());
    {
      const nb::gil_scoped_release free;
      all().reset(std::span(which.data(), count), buffer.observation.data());
    }
    keep(buffer);
    return shown_[0];
  }

  nb::tuple step(nb::handle action) {
    std::size_t ended = 0;
    const Turn turn(busy_, "the environment");
    const Floats floats(action, "action", {all().count(), all().actions().size()}, 1);
    Buffer& buffer = fresh();
    {
      const nb::gil_scoped_release free;
      ended = all().step(floats.data(), {buffer.observation.data(), buffer.reward.data(), buffer.terminated.get(),
                                         buffer.truncated.get()});
    }
    keep(buffer);
    return nb::make_tuple(shown_[0], shown_[1], shown_[2], shown_[3], ended);
  }

  /// The episodes that ended in the last step.
  nb::dict ended() const {
    const rollout::Environments& e = all();
    const std::size_t n = e.count();
    auto mask = make_array<bool>({n});
    auto final_observation = make_array<float>({n, observations()});
    auto episode_return = make_array<float>({n});
    auto length = make_array<std::int32_t>({n});
    auto success = make_array<bool>({n});
    auto causes = make_array<std::uint32_t>({n});
    for (std::size_t i = 0; i < n; ++i) {
      if (!(mask.data()[i] = e.ended()[i])) continue;
      const rollout::EndedEpisode& episode = e.episodes()[i];
      std::copy_n(e.final_observation() + i * observations(), observations(),
                  final_observation.data() + i * observations());
      episode_return.data()[i] = episode.episode_return;
      length.data()[i] = static_cast<std::int32_t>(episode.length);
      success.data()[i] = episode.success;
      causes.data()[i] = episode.causes;
    }
    nb::dict d;
    d["ended"] = mask, d["observation"] = final_observation, d["return"] = episode_return, d["length"] = length;
    d["is_success"] = success, d["causes"] = causes;
    return d;
  }

  /// The state to draw an environment: true pose and wing angles, and the target.
  nb::dict pose(std::int64_t at) const {
    const std::size_t i = checked_index(at, all().count());
    const sim::FlapperState s = all().state(i);
    const flight::Target target = all().target(i);
    nb::dict d;
    const auto put = [&](const char* name, std::span<const double> values) {
      auto array = make_array<double>({values.size()});
      std::ranges::copy(values, array.data());
      d[name] = array;
    };
    put("position_m", s.position_m), put("attitude", s.attitude), put("velocity_m_s", s.velocity_m_s);
    put("body_rate_rad_s", s.body_rate_rad_s), put("stroke_rad", s.stroke_rad), put("rotation_rad", s.rotation_rad);
    put("target_m", target.position_m);
    const double heading[2] = {target.heading_cos, target.heading_sin};
    put("target_heading", heading);
    d["t_s"] = all().time_s(i);
    return d;
  }

  /// The constant part of a drawing, as JSON in the form of a flight page: the vehicle's form and its surroundings.
  std::string scene() const {
    const rollout::FlyConfig& config = all().config();
    const sim::World& world = config.fleet.batch.world;
    nlohmann::json walls = nlohmann::json::array();
    for (const sim::Wall& w : world.walls) walls.push_back({w.x_m, w.y_m, w.normal_x, w.normal_y});
    return nlohmann::json(
               {{"vehicle", view::shape_of(config.vehicle)},
                {"ambient", {{"ground_z_m", world.ground_z_m}, {"ceiling_z_m", world.ceiling_z_m}, {"walls", walls}}}})
        .dump();
  }

  void close() {
    const Turn turn(busy_, "the environment");
    all_.reset();
  }

 private:
  /// The buffer for the next step: one that Python no longer uses, or, without copies, the other one of two.
  Buffer& fresh() {
    if (!copy_ && views_.size() == 2) {
      turn_ = 1 - turn_;
      shown_ = views_[turn_].second;
      return *views_[turn_].first;
    }
    auto lease = std::make_unique<Lease>(pool_);
    {
      const std::scoped_lock lock(pool_->mutex);
      if (!pool_->free.empty()) {
        lease->buffer = std::move(pool_->free.back());
        pool_->free.pop_back();
      }
    }
    const std::size_t n = all().count(), m = observations();
    if (!lease->buffer) lease->buffer = std::make_unique<Buffer>(n, m);
    Buffer& b = *lease->buffer;
    const nb::capsule owner(lease.release(), [](void* p) noexcept { delete static_cast<Lease*>(p); });
    shown_ = {nb::cast(Array<float>(b.observation.data(), {n, m}, owner)),
              nb::cast(Array<float>(b.reward.data(), {n}, owner)),
              nb::cast(Array<bool>(b.terminated.get(), {n}, owner)),
              nb::cast(Array<bool>(b.truncated.get(), {n}, owner))};
    if (!copy_) {
      turn_ = views_.size();
      views_.emplace_back(&b, shown_);
    }
    return b;
  }
  /// With autoreset disabled, keeps the observations: reset_some() replaces only the rows of the environments that it
  /// resets.
  void keep(const Buffer& buffer) {
    if (all().options().autoreset == rollout::Autoreset::disabled) last_ = buffer.observation;
  }

  std::unique_ptr<rollout::Environments> all_;
  std::shared_ptr<Pool> pool_;
  bool copy_;
  std::vector<std::pair<Buffer*, Shown>> views_;
  std::size_t turn_ = 0;
  Shown shown_;
  std::vector<float> last_;
  mutable std::atomic_flag busy_ = ATOMIC_FLAG_INIT;
};

nb::list signals(const std::vector<flight::Signal>& list) {
  nb::list all;
  for (const flight::Signal& s : list) {
    nb::dict d;
    d["name"] = s.name, d["unit"] = s.unit, d["low"] = s.low, d["high"] = s.high, d["frame"] = s.frame;
    all.append(d);
  }
  return all;
}

}  // namespace

void bind_environments(nb::module_& m) {
  nb::class_<PyEnvironments> type(
      m, "Environments",
      "Many environments of one configuration, stepped together; flappy.envs shows them to Gymnasium.");
  bind_copies(type);
  type.def(nb::init<const std::filesystem::path&, const std::vector<std::string>&, std::int64_t, const std::string&,
                    bool>(),
           "config"_a, "overrides"_a, "count"_a, "autoreset"_a, "copy"_a)
      .def("reset", &PyEnvironments::reset, nb::sig("def reset(self, seed: int | None) -> NDArray[numpy.float32]"),
           "seed"_a.none(), "Starts all anew; float32 (count, observations).")
      .def("reset_some", &PyEnvironments::reset_some,
           nb::sig("def reset_some(self, which: NDArray[numpy.bool_]) -> NDArray[numpy.float32]"),
           "which"_a.noconvert(), "Starts those that are marked anew: bool (count,).")
      .def("step", &PyEnvironments::step,
           nb::sig("def step(self, action: object) -> tuple[NDArray[numpy.float32], NDArray[numpy.float32], "
                   "NDArray[numpy.bool_], NDArray[numpy.bool_], int]"),
           "action"_a.noconvert().none(),
           "One action of each, float32 (count, actions) in [-1, 1]: observation, reward, terminated, truncated, and "
           "how many ended.")
      .def("ended", &PyEnvironments::ended, "Episodes that ended in the last step.")
      .def("pose", &PyEnvironments::pose, "i"_a, "True pose and wings of one, SI units.")
      .def("scene", &PyEnvironments::scene,
           "JSON: the vehicle's shape (src/view/shape.hpp), and ground, ceiling and walls.")
      .def(
          "hash",
          [](const PyEnvironments& e, std::size_t first, std::size_t last) {
            if (first > last || last > e.all().count())
              throw nb::index_error("hash: accepted: first <= last <= num_envs");
            return e.all().hash(first, last);
          },
          "first"_a, "last"_a, "Of how vehicles [first, last) move, as flappy-fly prints it.")
      .def("close", &PyEnvironments::close)
      .def_prop_ro("count", [](const PyEnvironments& e) { return e.all().count(); })
      .def_prop_ro("step_s", [](const PyEnvironments& e) { return e.all().step_s(); })
      .def_prop_ro("longest_s",
                   [](const PyEnvironments& e) { return e.all().config().fleet.task.constants.limits.time_s; })
      .def_prop_ro("seed", [](const PyEnvironments& e) { return e.all().config().fleet.seed; })
      .def_prop_ro("task", [](const PyEnvironments& e) { return e.all().config().fleet.task.name; })
      .def_prop_ro("observed", [](const PyEnvironments& e) { return signals(e.all().observed()); })
      .def_prop_ro("actions", [](const PyEnvironments& e) { return signals(e.all().actions()); });
}

}  // namespace flappy::python
