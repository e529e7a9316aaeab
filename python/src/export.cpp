// Exports a network of any library as our C header, and proves it like our own.
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>

#include "bind.hpp"
#include "deploy/header/exported_files.hpp"
#include "deploy/proof/proof.hpp"
#include "io/files.hpp"
#include "io/program.hpp"
#include "io/sha256.hpp"
#include "io/temporary_folder.hpp"

namespace flappy::python {
namespace {

/// As in flappy-export: number of flights for observations, and numbers of vectors for tests and proofs.
constexpr std::size_t kProofFlights = 64, kTestVectors = 24, kProofVectors = 1000;

using Numbers = std::vector<double>;

/// An export, kept in memory until it is proven.
class PyExport {
 public:
  PyExport(const std::filesystem::path& config, const std::vector<std::string>& overrides,
           const std::vector<int>& widths, const std::string& hidden, bool layer_norm, bool linear,
           const Numbers& weights, const Numbers& mean, const Numbers& scale, double clip) {
    const nb::gil_scoped_release free;
    rollout::FlyConfig fly = rollout::read_fly_config(found(config), overrides);
    const flight::Task& task = fly.fleet.task;
    policy::Actor actor;
    actor.task = task.name;
    for (const flight::Signal& s : task.observation()) actor.observation.push_back(s.name);
    for (const flight::Signal& s : task.action()) actor.action.push_back(s.name);
    actor.widths = widths;
    actor.layer_norm = layer_norm, actor.linear = linear;
    actor.hidden =
        static_cast<policy::Activation>(std::ranges::find(policy::kActivationNames, hidden) - policy::kActivationNames);
    actor.weights = weights, actor.mean = mean, actor.scale = scale, actor.clip = clip;
    // write and read the file, because reading refuses an invalid actor
    const io::TemporaryFolder work;
    policy::write_actor(work / "actor.json", actor);
    fly.actor = std::make_shared<const policy::Actor>(policy::read_actor(work / "actor.json"));

    std::string resolved;
    for (const auto& [name, text] : fly.resolved) resolved += text;
    policy::RunInfo info{io::sha256(resolved), io::commit(), false, task.name};
    constexpr std::string_view kDirty = "-dirty";
    info.dirty = info.commit.ends_with(kDirty);
    if (info.dirty) info.commit.resize(info.commit.size() - kDirty.size());

    network_ = deploy::network_of(fly);
    flown_ = deploy::roll_out(fly, 0, kProofFlights);
    policy::PolicyVectors tests = deploy::some_of(flown_, kTestVectors);
    deploy::append(tests, deploy::corners(network_, task.observation()));
    files_ = deploy::exported_files(fly, info, network_, std::move(tests));
  }

  /// Observations of flights, and the exported network's actions for them, in [-1, 1].
  nb::tuple flown() const {
    const policy::PolicyVectors some = deploy::some_of(flown_, kProofVectors);
    const auto inputs = static_cast<std::size_t>(network_.inputs()),
               outputs = static_cast<std::size_t>(network_.outputs());
    auto observation = make_array<float>({some.rows(), inputs}), action = make_array<float>({some.rows(), outputs});
    std::ranges::copy(some.observation, observation.data());
    const std::vector<float> adds = deploy::evaluate(network_, some.observation);
    for (std::size_t k = 0; k < adds.size(); ++k) {
      const float half = network_.half[k % outputs];
      action.data()[k] = half > 0 ? (adds[k] - network_.middle[k % outputs]) / half : 0;
    }
    return nb::make_tuple(observation, action);
  }

  /// Returns a table with a row for each compiler. Throws RuntimeError where a bit differs.
  std::string prove(bool everywhere) const {
    const nb::gil_scoped_release free;
    const io::TemporaryFolder work;
    for (const auto& [name, text] : files_) io::write_atomically(work / name, text);
    policy::PolicyVectors vectors = deploy::some_of(flown_, kProofVectors);
    vectors.action = deploy::evaluate(network_, vectors.observation);
    const std::vector<deploy::Parity> rows =
        deploy::prove(work / "", vectors, everywhere ? deploy::Reach::everywhere : deploy::Reach::here);
    if (everywhere && std::ranges::none_of(rows, &deploy::Parity::available))
      throw io::InputError("everywhere: there is no compiler in PATH; accepted: a C compiler");
    if (std::ranges::any_of(rows, &deploy::Parity::failed))
      throw std::runtime_error("flappy_policy.h does not compute what the network does; nothing is written:\n" +
                               deploy::table_of(rows));
    return json_of(rows).dump();
  }

  std::vector<std::string> write(const std::filesystem::path& out) const {
    io::make_folder(out);
    std::vector<std::string> names;
    for (const auto& [name, text] : files_) {
      io::write_atomically(out / name, text);
      names.push_back((out / name).string());
    }
    return names;
  }

 private:
  policy::PolicyNetwork network_;
  policy::PolicyVectors flown_;
  std::map<std::string, std::string> files_;
};

}  // namespace

void bind_export(nb::module_& m) {
  nb::class_<PyExport>(m, "Export")
      .def(nb::init<const std::filesystem::path&, const std::vector<std::string>&, const std::vector<int>&,
                    const std::string&, bool, bool, const Numbers&, const Numbers&, const Numbers&, double>(),
           "config"_a, "overrides"_a, "widths"_a, "hidden"_a, "layer_norm"_a, "linear"_a, "weights"_a, "mean"_a,
           "scale"_a, "clip"_a)
      .def("flown", &PyExport::flown)
      .def("prove", &PyExport::prove, "everywhere"_a)
      .def("write", &PyExport::write, "out"_a);
  m.def(
      "task_sizes",
      [](const std::filesystem::path& config, const std::vector<std::string>& overrides) {
        const rollout::FlyConfig fly = rollout::read_fly_config(found(config), overrides);
        return std::pair(fly.fleet.task.observation().size(), fly.fleet.task.action().size());
      },
      "config"_a, "overrides"_a);
}

}  // namespace flappy::python
