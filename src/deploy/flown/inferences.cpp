#include "deploy/flown/inferences.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <random>
#include <utility>

#include "io/refuse.hpp"
#include "io/statistics.hpp"

namespace flappy::deploy {
namespace {

constexpr double kSame = 0.99, kFollows = 0.95, kOfRange = 0.01;
constexpr int kDithers = 8;
/// Policy periods between inferences: more than kMissed, and the log has missed one; more than kPause, and the policy has
/// been reset.
constexpr double kMissed = 1.5, kPause = 3;
constexpr double kRounding = 1e-6;  ///< of an output's range: single precision rounds the policy's sums

/// Where each number of the contract is in a row of the log.
std::vector<std::size_t> places(const std::filesystem::path& folder, const Contract& contract, const OnboardLog& log) {
  const std::size_t inputs = contract.observation.size(), count = inputs + contract.action.size();
  std::vector<std::size_t> at;
  for (std::size_t k = 0; k < count; ++k) {
    const auto found = std::ranges::find(log.policy_numbers, k);
    if (found == log.policy_numbers.end())
      io::refuse(folder,
                 "is checked by all that the policy got and gave, and the log lacks " +
                     (k < inputs ? "observation_" + contract.observation[k].name
                                 : "action_" + contract.action[k - inputs].name),
                 "a log with policy.csv, as the mapping beside the exported app makes it");
    at.push_back(static_cast<std::size_t>(found - log.policy_numbers.begin()));
  }
  return at;
}

}  // namespace

bool Inferences::Input::follows() const { return share >= kFollows; }

bool Inferences::as_exported() const {
  return rows > 0 && static_cast<double>(same) >= kSame * static_cast<double>(rows) &&
         std::ranges::all_of(inputs, &Input::follows);
}

Inferences check_inferences(const std::filesystem::path& folder, const Contract& contract, const OnboardLog& log,
                            const std::vector<LoggedInput>& inputs) {
  const std::size_t seen = contract.observation.size(), acts = contract.action.size();
  const std::vector<std::size_t> at = places(folder, contract, log);
  for (const Contract::Input& c : contract.inputs)
    if (std::ranges::count(inputs, c.name, &LoggedInput::name) == 0)
      io::refuse(folder, "steers by " + c.name + ", which the log lacks",
                 "a log whose inputs are those of contract.json");
  const ExportedC exported(folder, Build::exact);
  Inferences found;
  std::vector<std::vector<double>> offsets(inputs.size());
  std::vector<std::size_t> follow(inputs.size(), 0);
  std::mt19937 random(1);
  std::vector<float> observation((kDithers + 1) * seen), action((kDithers + 1) * acts);
  // a recurrent policy remembers; each dithered sequence of observations has a state of its own
  std::vector<std::vector<std::uint64_t>> states(kDithers + 1,
                                                 std::vector<std::uint64_t>(exported.state_bytes() / 8 + 1));
  double last_s = -INFINITY;
  bool memory_lost = false;  // the log missed an inference, which the policy remembers and this replay does not
  for (std::size_t row = 0; row < log.inferences.size(); ++row) {
    const auto number = [&](std::size_t k) { return log.inferences[row].numbers[at[k]]; };
    bool begun = false;  // before its first inference all numbers are 0
    for (std::size_t k = 0; k < seen; ++k) begun = begun || number(k) != 0;
    if (!begun) continue;
    const double pause_s = log.inferences[row].t_s - last_s;
    if (contract.memory > 0 && pause_s > kMissed * contract.policy_s) {
      memory_lost = pause_s <= kPause * contract.policy_s;
      if (!memory_lost)
        for (auto& state : states) exported.reset(state.data());
    }
    last_s = log.inferences[row].t_s;
    if (memory_lost) continue;
    ++found.rows;
    for (std::size_t d = 0; d <= kDithers; ++d)  // the digits that the log has lost
      for (std::size_t k = 0; k < seen; ++k) {
        const double share = d == 0 ? 0 : static_cast<double>(random()) / 0x1p32 - 0.5;
        observation[d * seen + k] = static_cast<float>(number(k) + share * log.policy_steps[at[k]]);
      }
    for (std::size_t d = 0; d <= kDithers; ++d)
      exported.policy(states[d].data(), &observation[d * seen], &action[d * acts]);
    bool same = true;
    for (std::size_t k = 0; k < acts; ++k) {
      const Contract::Signal& signal = contract.action[k];
      const double range = signal.high - signal.low, is = number(seen + k), should = static_cast<double>(action[k]);
      double tolerance = kRounding * range + log.policy_steps[at[seen + k]];
      for (std::size_t d = 1; d <= kDithers; ++d)
        tolerance = std::max(tolerance, 2 * std::abs(static_cast<double>(action[d * acts + k]) - should));
      if (std::abs(is - should) <= tolerance) continue;
      same = false;
      if (range > 0 && std::abs(is - should) / range > found.largest) {
        found.largest = std::abs(is - should) / range;
        found.output = signal.name;
      }
    }
    found.same += same;
    for (std::size_t i = 0; i < inputs.size(); ++i) {
      const auto known = std::ranges::find(contract.inputs, inputs[i].name, &Contract::Input::name);
      if (known == contract.inputs.end()) continue;
      double asked = known->neutral;
      for (std::size_t k = 0; k < acts; ++k) asked += known->mix[k] * number(seen + k);
      asked = std::clamp(asked, known->low, known->high);
      const double off = inputs[i].value[row] - asked;
      offsets[i].push_back(off);
      follow[i] += std::abs(off) <= kOfRange * (known->high - known->low);
    }
  }
  for (std::size_t i = 0; i < inputs.size(); ++i)
    if (!offsets[i].empty()) {
      const double share = static_cast<double>(follow[i]) / static_cast<double>(offsets[i].size());
      found.inputs.push_back({inputs[i].name, share, io::median(std::move(offsets[i]))});
    }
  return found;
}

}  // namespace flappy::deploy
