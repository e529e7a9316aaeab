#include "deploy/header/policy_vectors.hpp"

#include <algorithm>
#include <cmath>
#include <span>
#include <utility>

#include "rollout/rollout.hpp"

namespace flappy::deploy {
namespace {

using Lane = model::Lanes<float, 1>;

template <class To, class From>
std::vector<To> cast(const From& from) {
  std::vector<To> to;
  for (const auto x : from) to.push_back(static_cast<To>(x));
  return to;
}

}  // namespace

policy::PolicyNetwork network_of(const rollout::FlyConfig& config) {
  const policy::Actor& a = *config.actor;
  policy::PolicyNetwork n{a.widths,
                          a.hidden,
                          a.layer_norm,
                          a.linear,
                          a.recurrent,
                          static_cast<float>(a.clip),
                          cast<float>(a.mean),
                          cast<float>(a.scale),
                          cast<float>(a.weights),
                          {},
                          {}};
  const auto& k = config.fleet.task.constants;
  for (int i = 0; i < config.fleet.task.actions(); ++i) {  // the same rounding as in scaled_action()
    const auto low = static_cast<float>(k.action_low[i]), high = static_cast<float>(k.action_high[i]);
    n.middle.push_back(static_cast<float>(0.5 * static_cast<double>(low + high)));
    n.half.push_back(static_cast<float>(0.5 * static_cast<double>(high - low)));
  }
  return n;
}

std::vector<float> evaluate(const policy::PolicyNetwork& n, const std::vector<float>& observation) {
  const auto view = policy::view_of(n, n.weights.data(), n.mean.data(), n.scale.data());
  const auto inputs = static_cast<std::size_t>(n.inputs()), actions = static_cast<std::size_t>(n.actions());
  std::vector<float> action;
  std::vector<Lane> in(inputs), out(actions);
  const std::span memory = std::span(in).subspan(static_cast<std::size_t>(n.observations()));
  for (std::size_t row = 0; row < observation.size(); row += inputs) {
    for (std::size_t i = 0; i < inputs; ++i) in[i] = Lane::load(&observation[row + i]);
    policy::evaluate(view, in.data(), out.data(), memory.data());
    for (std::size_t i = 0; i < actions; ++i) {
      const Lane adds = Lane::load(&n.middle[i]) + Lane::load(&n.half[i]) * clamp(out[i], Lane(-1), Lane(1));
      action.push_back(adds.raw[0]);
    }
    for (const Lane& next : memory) action.push_back(next.raw[0]);
  }
  return action;
}

policy::PolicyVectors roll_out(const rollout::FlyConfig& given, std::size_t first, std::size_t count) {
  rollout::FlyConfig config = given;
  config.fleet.first_flapper = kRolloutFlappers + static_cast<std::uint32_t>(first);
  config.excitation = {};
  config.fleet.task.action_late_most = 0;  // a late one would stand beside the next observation
  rollout::Rollout<float> flights(std::move(config), count);
  const flight::Fleet<float>& fleet = flights.fleet();
  const flight::Task& task = fleet.options().task;
  const auto inputs = task.observation().size();
  std::vector<policy::PolicyVectors> each(count);
  while (!flights.over()) {
    const bool acts = flights.tick() % task.action_repeat == 0;
    std::vector<std::size_t> acting;
    for (std::size_t i = 0; i < count && acts; ++i)
      if (fleet.ended(i) == 0 && !fleet.handed_back(i)) acting.push_back(i);
    if (acting.empty() && acts) break;
    for (const std::size_t i : acting) {
      std::vector<float>& seen = each[i].observation;
      seen.resize(seen.size() + inputs);
      fleet.observation(i, &seen[seen.size() - inputs]);
      const std::vector<float> memory = fleet.actor_memory(i);
      seen.insert(seen.end(), memory.begin(), memory.end());
    }
    flights.step();
    for (const std::size_t i : acting) {
      const auto adds = fleet.adds(i);
      std::vector<float>& done = each[i].action;
      done.insert(done.end(), adds.begin(), adds.begin() + task.actions());
      const std::vector<float> memory = fleet.actor_memory(i);
      done.insert(done.end(), memory.begin(), memory.end());
    }
  }
  const policy::PolicyNetwork network = network_of(given);
  policy::PolicyVectors all{network.inputs(), network.outputs(), {}, {}};
  for (const policy::PolicyVectors& v : each) append(all, v);
  return all;
}

BesideActor fly_beside(const rollout::FlyConfig& given, const policy::Policy& policy, std::size_t count) {
  BesideActor found;
  rollout::FlyConfig config = given;
  config.fleet.first_flapper = kRolloutFlappers;
  config.excitation = {};
  rollout::Rollout<float> of_actor(config, count);
  config.actor.reset();
  rollout::Rollout<float> of_file(config, count, &policy);
  std::vector<bool> over(count, false);
  while (!of_actor.over()) {
    of_actor.step();
    of_file.step();
    for (std::size_t i = 0; i < count; ++i) {
      if (over[i]) continue;
      const auto& one = of_actor.fleet();
      const auto& other = of_file.fleet();
      const auto state = [i](const flight::Fleet<float>& fleet) {
        return std::pair(fleet.ended(i), fleet.handed_back(i));
      };
      const flight::Motion a = one.truth(i), b = other.truth(i);
      found.largest_distance_m = std::max(
          found.largest_distance_m, std::hypot(a.position_m[0] - b.position_m[0], a.position_m[1] - b.position_m[1],
                                               a.position_m[2] - b.position_m[2]));
      over[i] = state(one) != std::pair(std::uint32_t{0}, false) || state(other) != std::pair(std::uint32_t{0}, false);
      if (over[i] && state(one) == state(other)) ++found.ended_alike;
    }
  }
  found.ended_alike += static_cast<std::size_t>(std::ranges::count(over, false));
  return found;
}

policy::PolicyVectors some_of(const policy::PolicyVectors& all, std::size_t count) {
  const auto in = static_cast<std::size_t>(all.inputs), out = static_cast<std::size_t>(all.outputs);
  const std::size_t rows = std::min(count, all.rows());
  policy::PolicyVectors some{all.inputs, all.outputs, {}, {}};
  for (std::size_t k = 0; k < rows; ++k) {
    const std::size_t row = all.rows() * k / rows;
    some.observation.insert(some.observation.end(), &all.observation[row * in], &all.observation[row * in] + in);
    some.action.insert(some.action.end(), &all.action[row * out], &all.action[row * out] + out);
  }
  return some;
}

void append(policy::PolicyVectors& to, const policy::PolicyVectors& more) {
  to.observation.insert(to.observation.end(), more.observation.begin(), more.observation.end());
  to.action.insert(to.action.end(), more.action.begin(), more.action.end());
}

policy::PolicyNetwork louder(policy::PolicyNetwork network) {
  const auto inputs = static_cast<std::size_t>(network.widths[network.widths.size() - 2]);
  const std::size_t last = static_cast<std::size_t>(network.outputs()) * (inputs + 1);
  for (std::size_t k = network.weights.size() - last; k < network.weights.size(); ++k) network.weights[k] *= 16;
  return network;
}

policy::PolicyVectors saturating(const policy::PolicyNetwork& network, const policy::PolicyVectors& flown) {
  constexpr std::size_t kRows = 64;
  constexpr float kStep = 1.03F;  // three from 8.2 to 9, where onnxruntime's tanh is larger than 1
  const policy::PolicyVectors some = some_of(flown, kRows);
  policy::PolicyVectors v{network.inputs(), network.outputs(), {}, {}};
  for (float far = 1; far < 1000; far *= kStep)
    for (std::size_t k = 0; k < some.observation.size(); ++k) {
      const std::size_t i = k % static_cast<std::size_t>(network.inputs());
      const bool of_memory = i >= network.mean.size();  // it never leaves its range
      const float middle = of_memory ? some.observation[k] : network.mean[i];
      v.observation.push_back(middle + far * (some.observation[k] - middle));
    }
  v.action = evaluate(network, v.observation);
  return v;
}

policy::PolicyVectors corners(const policy::PolicyNetwork& network, const std::vector<flight::Signal>& observation) {
  policy::PolicyVectors v{network.inputs(), network.outputs(), {}, {}};
  for (const float reach : {0.0F, 1.0F, 1000.0F, 1e30F})  // distance from the middle, in units of half the range
    for (unsigned pattern = 0; pattern < 4 && (reach > 0 || pattern == 0); ++pattern) {
      const auto high = [&](std::size_t i) { return (pattern < 2 ? pattern : (i + pattern) % 2) == 1; };
      for (std::size_t i = 0; i < observation.size(); ++i) {
        const auto middle = static_cast<float>((observation[i].low + observation[i].high) / 2);
        const auto half = static_cast<float>((observation[i].high - observation[i].low) / 2);
        v.observation.push_back(middle + (high(i) ? reach : -reach) * half);
      }
      const float kept = std::min(reach, 1.0F);
      for (std::size_t i = 0; i < static_cast<std::size_t>(network.memory()); ++i)
        v.observation.push_back(high(i) ? kept : -kept);
    }
  v.action = evaluate(network, v.observation);
  return v;
}

}  // namespace flappy::deploy
