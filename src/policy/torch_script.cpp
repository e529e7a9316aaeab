#include "policy/torch_script.hpp"

#include <ATen/Parallel.h>
#include <torch/script.h>

#include <algorithm>
#include <sstream>
#include <string>

#include "io/files.hpp"
#include "io/refuse.hpp"

namespace flappy::policy {
namespace {

std::string reason(const std::string& complaint) {
  const std::size_t mark = complaint.rfind("Error: ");
  const std::size_t begin = mark == std::string::npos ? 0 : mark + 7;
  return complaint.substr(begin, complaint.find('\n', begin) - begin);
}

class TorchScript : public Policy {
 public:
  TorchScript(const torch::jit::Module& module, int observations, int actions)
      : Policy(observations, actions), module_(module) {
    module_.eval();
    if (!module_.hasattr("memory") || !module_.attr("memory").isInt()) return;
    const std::int64_t units = module_.attr("memory").toInt();
    if (units < 0 || units > kMaxRemembered)
      throw io::InputError("a TorchScript that remembers " + std::to_string(units) + " numbers; accepted: 0 to " +
                           std::to_string(kMaxRemembered));
    memory_ = static_cast<int>(units);
  }

  void act(std::size_t count, const float* observation, float* action) const override {
    const torch::Tensor out = forward(count, observation);
    if (out.numel() != static_cast<std::int64_t>(count) * (actions() + memory()))
      throw io::InputError("a TorchScript that makes " + std::to_string(out.numel()) + " numbers of " +
                           std::to_string(count) + " observations; accepted: " + std::to_string(actions() + memory()) +
                           " of each");
    std::copy_n(out.data_ptr<float>(), out.numel(), action);
  }

  torch::Tensor forward(std::size_t count, const float* observation) const {
    const torch::NoGradGuard no_gradients;
    const torch::Tensor in = torch::from_blob(
        const_cast<float*>(observation), {static_cast<std::int64_t>(count), observations() + memory()}, torch::kFloat);
    if (memory() == 0) return module_.forward({in}).toTensor().contiguous();
    const auto made =
        module_.forward({in.narrow(1, 0, observations()), in.narrow(1, observations(), memory())}).toTuple();
    const torch::Tensor action = made->elements().at(0).toTensor(), next = made->elements().at(1).toTensor();
    if (next.dim() != 2 || next.size(1) != memory())
      throw std::runtime_error("Error: the next memory is not as wide as the memory, " + std::to_string(memory()));
    return torch::cat({action, next}, 1).contiguous();
  }

 private:
  mutable torch::jit::Module module_;  // forward() is not const, but does not change the module
};

std::string write(const PolicyNetwork& n, const std::string& contract) {
  const auto tensor = [](const std::vector<float>& numbers) { return torch::tensor(numbers); };
  torch::jit::Module module("FlappyPolicy");
  module.register_attribute("contract", torch::jit::StringType::get(), contract);
  if (n.recurrent) module.register_attribute("memory", torch::jit::IntType::get(), n.memory());
  module.register_buffer("mean", tensor(n.mean));
  module.register_buffer("scale", tensor(n.scale));
  module.register_buffer("middle", tensor(n.middle));
  module.register_buffer("half", tensor(n.half));
  std::ostringstream forward;
  forward.precision(9);
  forward << "def forward(self, observation" << (n.recurrent ? ", memory" : "") << "):\n"
          << "    x = torch.clamp((observation - self.mean) * self.scale, " << -n.clip << ", " << n.clip << ")\n";
  const float* weights = n.weights.data();
  /// Adds `name` = the sums of a layer's outputs over `of`.
  const auto sums = [&](const char* name, const char* of, std::int64_t inputs, std::int64_t outputs,
                        const std::string& number) {
    // for each output its bias, then one weight for each input
    const torch::Tensor all =
        torch::from_blob(const_cast<float*>(weights), {outputs, inputs + 1}, torch::kFloat).transpose(0, 1);
    weights += outputs * (inputs + 1);
    module.register_parameter("bias" + number, all.select(0, 0).clone(), false);
    module.register_parameter("weight" + number, all.narrow(0, 1, inputs).clone(torch::MemoryFormat::Contiguous),
                              false);
    forward << "    " << name << " = torch.addmm(self.bias" << number << ", " << of << ", self.weight" << number
            << ")\n";
  };
  if (n.recurrent) {
    const std::int64_t units = n.memory();
    sums("seen", "x", n.observations(), 3 * units, "_seen");
    sums("kept", "memory", units, 3 * units, "_kept");
    forward << "    seen_reset, seen_update, seen_new = torch.chunk(seen, 3, 1)\n"
            << "    kept_reset, kept_update, kept_new = torch.chunk(kept, 3, 1)\n"
            << "    new = torch.tanh(seen_new + torch.sigmoid(seen_reset + kept_reset) * kept_new)\n"
            << "    x = new + torch.sigmoid(seen_update + kept_update) * (memory - new)\n"
            << "    remembered = x\n";
  }
  for (std::size_t layer = n.recurrent ? 1 : 0; layer + 1 < n.widths.size(); ++layer) {
    const std::int64_t outputs = n.widths[layer + 1];
    const std::string number = std::to_string(layer);
    const bool last = layer + 2 == n.widths.size();
    sums("x", "x", n.widths[layer], outputs, number);
    if (n.layer_norm && !last) {
      for (const char* name : {"gain", "shift"}) {
        module.register_parameter(
            name + number, torch::from_blob(const_cast<float*>(weights), {outputs}, torch::kFloat).clone(), false);
        weights += outputs;
      }
      forward << "    x = torch.layer_norm(x, [" << outputs << "], self.gain" << number << ", self.shift" << number
              << ", " << kLayerNormEpsilon << ")\n";
    }
    if (!last || !n.linear) forward << "    x = torch." << (last ? "tanh" : name_of(n.hidden)) << "(x)\n";
  }
  forward << "    x = torch.clamp(x, -1.0, 1.0)\n"  // after tanh too: that of a runtime may be larger than 1
          << "    action = self.middle + self.half * x\n"
          << "    refused = torch.isnan(observation).any(1, True)\n"
          << "    action = torch.where(refused, torch.zeros_like(action), action)\n"
          << (n.recurrent ? "    return action, torch.where(refused, memory, remembered)\n" : "    return action\n");
  module.define(forward.str());
  module.eval();
  std::ostringstream file;  // a file written to disk would contain its own name
  module.save(file);
  return file.str();
}

std::unique_ptr<const Policy> load(const std::filesystem::path& path, int observations, int actions) {
  std::istringstream file(io::read_text(path));
  at::set_num_threads(1);                       // such small networks are slower on more threads
  torch::jit::setGraphExecutorOptimize(false);  // all calls give the bits of the first one
  std::unique_ptr<TorchScript> policy;
  try {
    policy = std::make_unique<TorchScript>(torch::jit::load(file), observations, actions);
  } catch (const io::InputError&) {
    throw;
  } catch (const std::exception& e) {
    io::refuse(path, "is no TorchScript file: " + reason(e.what()), "what torch.jit.save writes");
  }
  const std::string sizes =
      "float[n][" + std::to_string(observations) + "] to float[n][" + std::to_string(actions) + "]";
  try {
    const std::vector<float> nothing(2 * static_cast<std::size_t>(observations + policy->memory()));
    const torch::Tensor out = policy->forward(2, nothing.data());
    if (out.dim() != 2 || out.size(0) != 2 || out.size(1) != actions + policy->memory() ||
        out.scalar_type() != torch::kFloat) {
      std::ostringstream what;
      what << "makes " << out.scalar_type() << out.sizes() << " of float[2, " << observations << "]";
      io::refuse(path, what.str(), sizes + ", as the task has");
    }
  } catch (const io::InputError&) {
    throw;
  } catch (const std::exception& e) {
    io::refuse(path, "does not take " + std::to_string(observations) + " inputs: " + reason(e.what()),
               sizes + ", as the task has");
  }
  return policy;
}

}  // namespace

const TorchFunctions flappy_torch_functions = {load, write};

}  // namespace flappy::policy
