// What flappy-export makes of an actor: the C header in both precisions, TorchScript, and what they have to agree with.
#include "deploy/header/policy_header.hpp"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <random>

#include "deploy/header/controller_header.hpp"
#include "deploy/header/policy_vectors.hpp"
#include "deploy/proof/file_proof.hpp"
#include "full.hpp"
#include "io/run_program.hpp"
#include "policy/policy.hpp"
#include "policy/torch_script.hpp"
#include "rollout/evaluation.hpp"
#include "rollout/fly_fixture.hpp"
#include "rollout/rollout.hpp"

namespace flappy::deploy {
namespace {

using flight::Folder;
using policy::Activation;
using Words = std::vector<std::string>;

/// The escape, or another flight, under an actor of random weights.
rollout::FlyConfig escape(const std::vector<int>& hidden_widths, Activation hidden, const Words& overrides = {},
                          bool layer_norm = false, const std::string& name = "escape", bool recurrent = false) {
  Words all = {"flight.duration_s=0.7", "task.success.keep.until_s=0.7", "flight.threads=1"};
  all.insert(all.end(), overrides.begin(), overrides.end());
  rollout::FlyConfig config = rollout::read_fly_config(test::source_path("configs/fly/" + name + ".toml"), all);
  policy::Actor a;
  a.task = config.fleet.task.name;
  for (const flight::Signal& s : config.fleet.task.observation()) {
    a.observation.push_back(s.name);
    a.mean.push_back((s.low + s.high) / 2);
    a.scale.push_back(2 / (s.high - s.low));
  }
  for (const flight::Signal& s : config.fleet.task.action()) a.action.push_back(s.name);
  a.widths = {static_cast<int>(a.observation.size())};
  a.widths.insert(a.widths.end(), hidden_widths.begin(), hidden_widths.end());
  a.widths.push_back(static_cast<int>(a.action.size()));
  a.hidden = hidden;
  a.layer_norm = layer_norm;
  a.linear = hidden == Activation::elu;
  std::mt19937 engine(5);
  const auto random = [&](double size) {
    a.weights.push_back(static_cast<float>((static_cast<double>(engine()) / 0x1p31 - 1) * size));
  };
  a.recurrent = recurrent;
  const auto add = [&](int inputs, int outputs) {
    for (int i = 0; i < (inputs + 1) * outputs; ++i) random(std::sqrt(3.0 / inputs));
  };
  if (recurrent) {
    add(a.widths[0], 3 * a.widths[1]);
    add(a.widths[1], 3 * a.widths[1]);
  }
  for (std::size_t layer = recurrent ? 1 : 0; layer + 1 < a.widths.size(); ++layer) {
    add(a.widths[layer], a.widths[layer + 1]);
    if (layer_norm && layer + 2 < a.widths.size())
      for (int i = 0; i < 2 * a.widths[layer + 1]; ++i) random(1);
  }
  config.actor = std::make_shared<policy::Actor>(a);
  return config;
}

const policy::RunInfo kRun{std::string(64, 'a'), "0123456789ab", true, "escape"};

/// An exported header with a self-test of 20 rows and the corners.
template <class Network>
std::string header_of(const rollout::FlyConfig& config, const Network& network, const policy::PolicyVectors& flown) {
  policy::PolicyVectors v = some_of(flown, 20);
  append(v, corners(network_of(config), config.fleet.task.observation()));
  v.action = evaluate(network, v.observation);
  return policy_header(config, kRun, network, v);
}

/// Compiles sources in `folder` and runs the program; what it prints, or the compiler's complaint.
std::string compiled(const Folder& folder, const Words& options, const Words& sources) {
  Words command = {"cc",         "-std=c99",     "-Wall",         "-Wextra",
                   "-Wpedantic", "-Wconversion", "-Wfloat-equal", "-Wdouble-promotion",
                   "-Werror"};
  command.insert(command.end(), options.begin(), options.end());
  for (const std::string& source : sources) command.push_back(folder / source);
  command.insert(command.end(), {"-o", folder / "program"});
  const io::Finished done = io::run(command);
  return done.exit_code == 0 ? io::run({folder / "program"}).out : done.err;
}

std::vector<float> acts(const policy::Policy& policy, const std::vector<float>& observation) {
  const std::size_t rows = observation.size() / static_cast<std::size_t>(policy.observations() + policy.memory());
  std::vector<float> action(rows * static_cast<std::size_t>(policy.actions() + policy.memory()));
  policy.act(rows, observation.data(), action.data());
  return action;
}

std::vector<std::uint32_t> bits(const std::vector<float>& numbers) {
  std::vector<std::uint32_t> list;
  for (const float x : numbers) list.push_back(std::bit_cast<std::uint32_t>(x));
  return list;
}

TEST(PolicyHeader, ActsAsTheLanesToTheBit) {
  const Folder folder;
  const std::vector<int> none;
  for (const auto& [widths, hidden, layer_norm, recurrent] :
       {std::tuple{std::vector<int>{32, 32}, Activation::relu, false, false},
        {{7, 40, 3, 5, 9}, Activation::tanh, false, false},
        {none, Activation::relu, false, false},
        {{12, 9}, Activation::elu, false, false},
        {{9, 300, 13}, Activation::silu, true, false},
        {{16, 32}, Activation::relu, false, true},
        {{5}, Activation::tanh, false, true}}) {
    const rollout::FlyConfig config = escape(widths, hidden, {}, layer_norm, "escape", recurrent);
    const policy::PolicyNetwork network = network_of(config);
    const policy::PolicyVectors flown = roll_out(config, 0, 40);
    ASSERT_GT(flown.action.size(), 4000u);
    EXPECT_EQ(bits(evaluate(network, flown.observation)), bits(flown.action));
    folder.write("p.h", header_of(config, network, flown));
    const auto policy = policy::load_policy(folder / "p.h", network.observations(), network.actions());
    EXPECT_EQ(policy->memory(), recurrent ? widths[0] : 0);
    EXPECT_EQ(bits(acts(*policy, flown.observation)), bits(flown.action));
    const policy::PolicyVectors wild = corners(network, config.fleet.task.observation());
    EXPECT_EQ(bits(acts(*policy, wild.observation)), bits(wild.action));

    if (hidden == Activation::elu || layer_norm) {
      EXPECT_THROW(quantise(network, flown.observation), std::invalid_argument);
      continue;
    }
    const QuantisedNetwork whole = quantise(network, flown.observation);
    folder.write("q.h", header_of(config, whole, flown));
    const auto int8 = policy::load_policy(folder / "q.h", network.observations(), network.actions());
    EXPECT_EQ(bits(acts(*int8, flown.observation)), bits(evaluate(whole, flown.observation)));
    EXPECT_EQ(bits(acts(*int8, wild.observation)), bits(evaluate(whole, wild.observation)));
  }
}

TEST(PolicyHeader, FliesEveryEpisodeAsTheRunItCameFrom) {
  const Folder folder;
  for (const bool recurrent : {false, true}) {
    const rollout::FlyConfig config = escape({16, 8}, Activation::relu, {}, false, "escape", recurrent);
    const policy::PolicyNetwork network = network_of(config);
    folder.write("p.h", header_of(config, network, roll_out(config, 0, 4)));
    const auto policy = policy::load_policy(folder / "p.h", network.observations(), network.actions());
    rollout::Evaluator evaluator(config, {.count = 48});
    const auto actor = evaluator.fly({config.actor, nullptr}, rollout::Detail::full).flights;
    const auto header = evaluator.fly({nullptr, policy.get()}, rollout::Detail::full).flights;
    ASSERT_EQ(actor.size(), 48u);
    for (std::size_t i = 0; i < actor.size(); ++i) {
      EXPECT_EQ(actor[i].hash, header[i].hash) << i;
      EXPECT_EQ(actor[i].captured_s, header[i].captured_s) << i;
      EXPECT_EQ(actor[i].energy_J, header[i].energy_J) << i;
      EXPECT_EQ(actor[i].success(), header[i].success()) << i;
    }
    // flights that know nothing of each other
    EXPECT_NE(actor[0].hash, actor[1].hash);
  }
}

TEST(PolicyHeader, IsTheSameBytesForAnyThreads) {
  const auto export_with = [](const std::string& threads) {
    const rollout::FlyConfig config = escape({16}, Activation::relu, {"flight.threads=" + threads});
    return header_of(config, network_of(config), roll_out(config, 0, 40));
  };
  EXPECT_EQ(export_with("1"), export_with("3"));
}

TEST(PolicyHeader, MayBeIncludedTwiceAndInSeveralFiles) {
  const Folder folder;
  const rollout::FlyConfig config = escape({8}, Activation::tanh);
  folder.write("p.h", header_of(config, network_of(config), roll_out(config, 0, 4)));
  folder.write("other.c", "#include \"p.h\"\nint other(void);\nint other(void) { return flappy_policy_selftest(); }\n");
  folder.write("main.c",
               "#include \"p.h\"\n#include \"p.h\"\n#include <stdio.h>\nint other(void);\nint main(void) {\n"
               "  printf(\"%d %d %d %s %s %s\", flappy_policy_selftest(), other(), FLAPPY_POLICY_DIRTY, "
               "flappy_policy_observation[11].name, flappy_policy_observation[11].unit, FLAPPY_POLICY_COMMIT);\n"
               "  return 0;\n}\n");
  EXPECT_EQ(compiled(folder, {"-O2"}, {"main.c", "other.c"}), "0 0 1 added_amplitude V 0123456789ab");
}

TEST(PolicyHeader, RefusesArithmeticThatIsNotItsOwn) {
  const Folder folder;
  const rollout::FlyConfig config = escape({8}, Activation::relu);
  folder.write("p.h", header_of(config, network_of(config), roll_out(config, 0, 4)));
  folder.write("main.c", "#include \"p.h\"\nint main(void) { return 0; }\n");
  for (const char* option : {"-ffast-math", "-Ofast", "-ffinite-math-only"})
    EXPECT_NE(compiled(folder, {"-O2", option}, {"main.c"}).find("leave it away"), std::string::npos) << option;
  EXPECT_NE(compiled(folder, {"-mfpmath=387"}, {"main.c"}).find("wider type"), std::string::npos);
  EXPECT_EQ(compiled(folder, {"-O2"}, {"main.c"}), "");
}

/// A program that turns over every bit of every number and counts what the self-test lets pass; `arrays`: name and count.
std::string mutations(const std::vector<std::pair<std::string, std::string>>& arrays) {
  std::string text =
      "#include \"p.h\"\n#include <stdio.h>\nint main(void) {\n  unsigned long flips = 0, missed = 0;\n"
      "  if (flappy_policy_selftest() != 0) return 1;\n";
  for (const auto& [name, count] : arrays)
    text += "  for (unsigned i = 0; i < " + count + "; ++i)\n    for (unsigned bit = 0; bit < 8 * sizeof " + name +
            "[0]; ++bit) {\n      unsigned char *byte = (unsigned char *)&" + name +
            "[i] + bit / 8;\n      *byte = (unsigned char)(*byte ^ 1U << bit % 8);\n"
            "      missed += flappy_policy_selftest() == 0;\n"
            "      *byte = (unsigned char)(*byte ^ 1U << bit % 8);\n      ++flips;\n    }\n";
  return text + "  printf(\"%lu flips, %lu missed\", flips, missed);\n  return 0;\n}\n";
}

TEST(PolicyHeader, CatchesEveryFlippedBit) {
  const Folder folder;
  const int width = test::full() ? 32 : 8;
  const rollout::FlyConfig config = escape({width, width}, Activation::relu);
  const policy::PolicyNetwork network = network_of(config);
  const policy::PolicyVectors flown = roll_out(config, 0, 8);
  const std::vector<std::pair<std::string, std::string>> common = {{"flappy_policy_mean", "FLAPPY_POLICY_OBS"},
                                                                   {"flappy_policy_scale", "FLAPPY_POLICY_OBS"},
                                                                   {"flappy_policy_middle", "FLAPPY_POLICY_ACT"},
                                                                   {"flappy_policy_half", "FLAPPY_POLICY_ACT"},
                                                                   {"flappy_policy_weights", "FLAPPY_POLICY_WEIGHTS"}};
  folder.write("p.h", header_of(config, network, flown));
  folder.write("main.c", mutations(common));
  const std::size_t numbers = network.weights.size() + 2 * network.mean.size() + 2 * network.half.size();
  const Words writable = {"-O2", "-Dconst=", "-Wno-unused-variable"};
  EXPECT_EQ(compiled(folder, writable, {"main.c"}), std::to_string(32 * numbers) + " flips, 0 missed");

  // without the CRC the vectors miss some, as a mean error does: the count above can fail
  std::string blind = header_of(config, network, flown);
  const std::string check = "flappy_policy_crc32() != FLAPPY_POLICY_CRC32";
  blind.replace(blind.find(check), check.size(), "0");
  folder.write("p.h", blind);
  EXPECT_EQ(compiled(folder, writable, {"main.c"}).find(" flips, 0 missed"), std::string::npos);

  const QuantisedNetwork whole = quantise(network, flown.observation);
  folder.write("p.h", header_of(config, whole, flown));
  auto all = common;
  all.insert(all.end(),
             {{"flappy_policy_multiplier", "FLAPPY_POLICY_NEURONS"}, {"flappy_policy_bias", "FLAPPY_POLICY_NEURONS"}});
  folder.write("main.c", mutations(all));
  const std::size_t flips = 8 * whole.weights.size() + 64 * whole.bias.size() + 64 * (whole.mean.size() + 4);
  EXPECT_EQ(compiled(folder, writable, {"main.c"}), std::to_string(flips) + " flips, 0 missed");
}

TEST(PolicyHeader, AddsNothingUponNaN) {
  const Folder folder;
  for (const bool recurrent : {false, true}) {
    const rollout::FlyConfig config = escape({8, 6}, Activation::relu, {}, false, "escape", recurrent);
    const policy::PolicyNetwork network = network_of(config);
    const policy::PolicyVectors flown = roll_out(config, 0, 4);
    folder.write("p.h", header_of(config, network, flown));
    folder.write("q.h", header_of(config, quantise(network, flown.observation), flown));
    Words files = {"p.h", "q.h"};
#ifdef FLAPPY_HAVE_TORCH
    folder.write("p.pt", torch_script(network, ""));
    files.emplace_back("p.pt");
#endif
    for (const std::string& file : files) {
      const auto policy = policy::load_policy(folder / file, network.observations(), network.actions());
      for (std::size_t i = 0; i < network.mean.size(); ++i) {
        std::vector<float> seen(flown.observation.end() - network.inputs(), flown.observation.end());
        seen[i] = std::nanf("");
        std::vector<float> wanted(4, 0);  // and the memory as it was
        wanted.insert(wanted.end(), seen.begin() + network.observations(), seen.end());
        EXPECT_EQ(acts(*policy, seen), wanted) << file << ", input " << i;
        seen[i] = -INFINITY;
        for (const float x : acts(*policy, seen)) EXPECT_TRUE(std::isfinite(x)) << file << ", input " << i;
      }
    }
    // a header that lets NaN pass fails its own test
    std::string blind = header_of(config, network, flown);
    const std::string check = "refused |= flappy_is_nan(x);";
    blind.replace(blind.find(check), check.size(), "");
    folder.write("b.h", blind);
    EXPECT_NE(
        flight::message([&] { policy::load_policy(folder / "b.h", network.observations(), 4); }).find("self-test: 3"),
        std::string::npos);
  }
}

/// Inputs, weights and activations are rounded by 1/(127 sqrt 12) = 0.23 % of their largest, rms. In a sum of 30 terms of random
/// sign errors and terms grow alike, so each of three layers adds its three times 0.23 % of the largest term over the usual
/// one, a factor of 2 or 3: 1 to 2 % in all.
TEST(QuantisedPolicy, StaysNearTheActor) {
  const rollout::FlyConfig config = escape({32, 32}, Activation::relu);
  const policy::PolicyNetwork network = network_of(config);
  const policy::PolicyVectors fit = roll_out(config, 0, 64), unseen = roll_out(config, 64, 64);
  const QuantisedNetwork whole = quantise(network, fit.observation);
  const std::vector<float> action = evaluate(whole, unseen.observation);
  double sum = 0;
  for (std::size_t i = 0; i < action.size(); ++i)
    sum += std::pow((action[i] - unseen.action[i]) / (2 * network.half[i % 4]), 2);
  EXPECT_LT(std::sqrt(sum / static_cast<double>(action.size())), 0.02);
  EXPECT_GT(sum, 0);
}

#ifdef FLAPPY_HAVE_TORCH
TEST(TorchScriptExport, ActsAsTheLanesWithinRounding) {
  const Folder folder;
  for (const Activation hidden : {Activation::relu, Activation::tanh, Activation::elu, Activation::silu}) {
    const bool recurrent = hidden == Activation::tanh;
    const rollout::FlyConfig config = escape({32, 32}, hidden, {}, hidden == Activation::silu, "escape", recurrent);
    const policy::PolicyNetwork network = network_of(config);
    policy::PolicyVectors all = roll_out(config, 0, 40);
    append(all, corners(network, config.fleet.task.observation()));
    const std::string bytes = torch_script(network, "a contract");
    EXPECT_EQ(bytes, torch_script(network, "a contract"));
    EXPECT_NE(bytes.find("a contract"), std::string::npos);
    folder.write("p.pt", bytes);
    const auto action = acts(*policy::load_policy(folder / "p.pt", network.observations(), 4), all.observation);
    for (std::size_t i = 0; i < action.size(); ++i)
      ASSERT_NEAR(action[i], all.action[i],
                  1e-5 * 2 * network.output_half()[i % static_cast<std::size_t>(network.outputs())])
          << i;
  }
}
#endif

/// Acts as a network does.
class OfNetwork : public policy::Policy {
 public:
  explicit OfNetwork(policy::PolicyNetwork n) : Policy(n.inputs(), n.outputs()), network_(std::move(n)) {}
  void act(std::size_t count, const float* observation, float* action) const override {
    const std::vector<float> seen(observation, observation + count * static_cast<std::size_t>(observations()));
    std::ranges::copy(evaluate(network_, seen), action);
  }

 private:
  policy::PolicyNetwork network_;
};

TEST(FileProof, CountsFloatsBetween) {
  EXPECT_EQ(ulp_between(1, 1), 0);
  EXPECT_EQ(ulp_between(1, std::nextafter(1.0F, 2.0F)), 1);
  EXPECT_EQ(ulp_between(-0.0F, 0), 0);
  EXPECT_EQ(ulp_between(-1e-45F, 1e-45F), 2);  // the smallest floats on both sides of 0
  EXPECT_EQ(ulp_between(1, 2), 1 << 23);
  EXPECT_EQ(ulp_between(NAN, 1), INFINITY);
}

/// The same network flies the same to the bit; with its first output off by a hundredth of the range, it does not.
TEST(FileProof, ComparesOutputsAndFlights) {
  const rollout::FlyConfig config = escape({8}, Activation::relu);
  const policy::PolicyNetwork network = network_of(config);
  const policy::PolicyVectors vectors = some_of(roll_out(config, 0, 8), 100);
  const Agreement same = compare("p", "r", OfNetwork(network), network.half, vectors);
  const BesideActor same_flights = fly_beside(config, OfNetwork(network), 8);
  EXPECT_EQ(same.outputs, 400u);
  EXPECT_EQ(same.differing, 0u);
  EXPECT_EQ(same.largest_ulp + same.largest_ulp_of_range + same_flights.largest_distance_m, 0);
  EXPECT_EQ(same_flights.ended_alike, 8u);
  policy::PolicyNetwork off = network;
  off.middle[0] += 0.02F * off.half[0];
  const Agreement other = compare("p", "r", OfNetwork(off), network.half, vectors);
  EXPECT_EQ(other.differing, 100u);
  EXPECT_EQ(other.median_ulp, 0);  // of all four outputs
  EXPECT_GT(other.percentile_99_ulp, 1000);
  // 1 % of the range are 2 % of its half, which are up to 2^24 ulp
  EXPECT_GT(other.largest_ulp_of_range, 0.02 * (1 << 23));
  EXPECT_LT(other.largest_ulp_of_range, 0.0201 * (1 << 24));
  EXPECT_GT(fly_beside(config, OfNetwork(off), 8).largest_distance_m, 1e-4);
}

TEST(FileProof, FindsWhatLeavesTheRange) {
  const rollout::FlyConfig config = escape({8}, Activation::relu);
  const policy::PolicyNetwork network = network_of(config);
  const policy::PolicyVectors far_out = saturating(network, roll_out(config, 0, 8));
  Agreement same, beyond;
  ask_far_out(same, OfNetwork(network), network, far_out);
  EXPECT_GT(same.saturated, 100u);
  EXPECT_EQ(same.beyond_range, 0u);
  const policy::PolicyNetwork loud = louder(network);
  Agreement louder_one;
  ask_far_out(louder_one, OfNetwork(loud), loud, saturating(loud, roll_out(config, 0, 8)));
  EXPECT_GT(louder_one.saturated, same.saturated);
  EXPECT_EQ(louder_one.beyond_range, 0u);
  policy::PolicyNetwork wider = network;  // by a millionth, at one output
  wider.half[0] *= 1 + 0x1p-20F;
  ask_far_out(beyond, OfNetwork(wider), network, far_out);
  EXPECT_EQ(beyond.saturated, same.saturated);
  EXPECT_GT(beyond.beyond_range, 10u);
  EXPECT_LT(beyond.beyond_range, same.saturated);
}

/// Two outputs that are voltages: in 32 bits to the bit, in 8 bits near, in TorchScript within rounding.
TEST(PolicyHeader, SetsVoltagesAsTheLanesDo) {
  const Folder folder;
  const rollout::FlyConfig config = escape({12}, Activation::relu, {}, false, "hover_voltages");
  const policy::PolicyNetwork network = network_of(config);
  ASSERT_EQ(network.outputs(), 2);
  const policy::PolicyVectors flown = roll_out(config, 0, 40);
  ASSERT_GT(flown.rows(), 400u);
  EXPECT_EQ(bits(evaluate(network, flown.observation)), bits(flown.action));
  const std::string header = header_of(config, network, flown);
  EXPECT_NE(header.find("It is the voltage of the left and of the right motor."), std::string::npos);
  EXPECT_NE(header.find("right_voltage          V       -18 to 18"), std::string::npos);
  EXPECT_EQ(header.find("The action is added to"), std::string::npos);
  folder.write("p.h", header);
  const auto policy = policy::load_policy(folder / "p.h", network.inputs(), 2);
  EXPECT_EQ(bits(acts(*policy, flown.observation)), bits(flown.action));
  const QuantisedNetwork whole = quantise(network, flown.observation);
  folder.write("q.h", header_of(config, whole, flown));
  EXPECT_EQ(bits(acts(*policy::load_policy(folder / "q.h", network.inputs(), 2), flown.observation)),
            bits(evaluate(whole, flown.observation)));
#ifdef FLAPPY_HAVE_TORCH
  folder.write("p.pt", torch_script(network, "a contract"));
  const auto action = acts(*policy::load_policy(folder / "p.pt", network.inputs(), 2), flown.observation);
  for (std::size_t i = 0; i < action.size(); ++i) ASSERT_NEAR(action[i], flown.action[i], 1e-5 * 36) << i;
#endif
  // a policy from elsewhere flies as the actor does
  const auto flight = [&](bool by_header) {
    rollout::FlyConfig c = config;
    c.duration_s = 0.1;
    if (by_header) c.actor.reset();
    rollout::Rollout<float> all(c, 3, by_header ? policy.get() : nullptr);
    while (!all.over()) all.step();
    return all.fleet().batch().hash();
  };
  EXPECT_EQ(flight(true), flight(false));
  EXPECT_EQ(no_controller(config), "the policy sets the motors' voltages by itself");
  EXPECT_EQ(no_controller(escape({8}, Activation::relu)), "");
}

TEST(PolicyHeader, SaysWhatARobotThatIsKnownByTheBeatMixes) {
  const rollout::FlyConfig config = rollout::read_fly_config(test::source_path("configs/fly/flapper_dash.toml"));
  const std::string text = contract_text(config, {});
  EXPECT_TRUE(text.find("It is all that flies the robot: no controller adds to it.\n") != std::string::npos) << text;
  EXPECT_TRUE(text.find("left_flap = 0 + 1 amplitude + 1 difference, within 0 to 1\n") != std::string::npos) << text;
  EXPECT_TRUE(text.find("pitch_servo = 0.5 + -1 bias, within 0 to 1\n") != std::string::npos) << text;
  EXPECT_TRUE(text.find("amplitude              1       0.2 to 1") != std::string::npos) << text;  // it has no unit
  EXPECT_TRUE(contract_macros("P_", config, {}).find("#define P_FLAPPING_HZ 0x1.d66666p+3") != std::string::npos);
  EXPECT_EQ(no_controller(config), "");
}

TEST(PolicyHeader, SaysWhatItCannotExport) {
  rollout::FlyConfig config = escape({8}, Activation::relu);
  config.vehicle.driver.hold_s = 1e-3 / 3;
  EXPECT_NE(flight::message([&] { contract_crc32(config); }).find("no whole number of microseconds"),
            std::string::npos);
}

TEST(Contract, ChangesWithWhatHeadersMustShare) {
  const rollout::FlyConfig config = escape({8}, Activation::relu);
  const std::uint32_t own = contract_crc32(config);
  rollout::FlyConfig other = config;
  EXPECT_EQ(contract_crc32(other), own);
  other.fleet.task.action_repeat = 1;
  EXPECT_NE(contract_crc32(other), own);
  other = config;
  other.fleet.control_hz = 250;
  EXPECT_NE(contract_crc32(other), own);
  other = config;
  other.fleet.task.parts &= ~1U << static_cast<int>(flight::Part::time);
  EXPECT_NE(contract_crc32(other), own);
  other = config;
  other.fleet.task.constants.holds_trim = 0;
  EXPECT_NE(contract_crc32(other), own);
}

}  // namespace
}  // namespace flappy::deploy
