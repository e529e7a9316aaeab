// Binds policies, trained or exported.
#include "policy/policy.hpp"

#include "bind.hpp"
#include "deploy/header/policy_vectors.hpp"
#include "learn/run_folder.hpp"

namespace flappy::python {
namespace {

/// The policy of a finished run, or one of a file that policy::load_policy() reads.
class PyPolicy {
 public:
  PyPolicy(const std::filesystem::path& path, int observations, int actions)
      : observations_(observations), actions_(actions) {
    if (observations > 0) {
      policy_ = policy::load_policy(path, observations, actions);
      memory_ = policy_->memory();
      return;
    }
    network_ = deploy::network_of(learn::read_finished_run(path).fly);
    observations_ = network_.observations();
    actions_ = network_.actions();
    memory_ = network_.memory();
  }
  int observations() const { return observations_; }
  int actions() const { return actions_; }
  int memory() const { return memory_; }

  /// Rows of observation and memory to rows of action and memory.
  Array<float> act(nb::handle observation) {
    const Turn turn(busy_, "the policy");
    const nb::object array = nb::module_::import_("numpy").attr("asarray")(observation);
    if (nb::cast<int>(array.attr("ndim")) != 2)
      throw nb::value_error(("observation: is " + described(observation) + "; accepted: float32 of shape (n, " +
                             std::to_string(observations_ + memory_) + ")")
                                .c_str());
    const auto rows = nb::cast<std::size_t>(array.attr("shape")[0]);
    const Floats floats(array, "observation", {rows, static_cast<std::size_t>(observations_ + memory_)},
                        std::numeric_limits<float>::max());
    auto action = make_array<float>({rows, static_cast<std::size_t>(actions_ + memory_)});
    const nb::gil_scoped_release free;
    if (policy_) {
      policy_->act(rows, floats.data(), action.data());
    } else {
      const std::size_t count = rows * static_cast<std::size_t>(observations_ + memory_);
      const std::vector<float> result = deploy::evaluate(network_, {floats.data(), floats.data() + count});
      std::ranges::copy(result, action.data());
    }
    return action;
  }

 private:
  std::unique_ptr<const policy::Policy> policy_;
  policy::PolicyNetwork network_;
  int observations_, actions_, memory_ = 0;
  std::atomic_flag busy_ = ATOMIC_FLAG_INIT;
};

}  // namespace

void bind_policy(nb::module_& m) {
  nb::class_<PyPolicy>(m, "Policy")
      .def(nb::init<const std::filesystem::path&, int, int>(), "path"_a, "observations"_a, "actions"_a)
      .def("act", &PyPolicy::act, "observation"_a)
      .def_prop_ro("observations", &PyPolicy::observations)
      .def_prop_ro("actions", &PyPolicy::actions)
      .def_prop_ro("memory", &PyPolicy::memory);
}

}  // namespace flappy::python
