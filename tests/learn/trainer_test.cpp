// A run from its start to its end: the same bytes for any number of threads and instruction set, and through any stop.
#include "learn/trainer.hpp"

#include <gtest/gtest.h>

#include <cstring>
#include <fstream>
#include <nlohmann/json.hpp>

#include "learn/checkpoint.hpp"
#include "learn/metrics.hpp"
#include "learn/training.hpp"
#include "refusal.hpp"
#include "rollout/rollout.hpp"

namespace flappy::learn {
namespace {

namespace fs = std::filesystem;

fs::path fresh(const std::string& name) {
  const fs::path folder = fs::path(testing::TempDir()) / ("trainer_test_" + name);
  fs::remove_all(folder);
  return folder;
}

TrainSummary train_in(const fs::path& folder, const TrainConfig& config,
                      const std::function<bool(const TrainProgress&)>& keep_going = {},
                      const std::optional<fs::path>& from = {}) {
  TrainOptions o;
  o.folder = folder;
  o.keep_going = keep_going;
  o.from = from;
  o.commit = "test";
  return train(config, o);
}

/// Policies, metrics, and the payload of the last checkpoint.
std::string left_in(const fs::path& folder) {
  std::string all = newest_checkpoint(folder).payload_sha256();
  for (const char* name : {"best.json", "last.json", "metrics.jsonl", "metrics.csv"})
    all += "\n" + io::read_text(folder / name);
  return all;
}

TEST(Trainer, LeavesTheSameBytesWhateverTheThreadsAndTheInstructionSet) {
  const fs::path folder = fresh("one");
  const TrainSummary s = train_in(folder, small_training());
  EXPECT_EQ(s.updates, 24u);
  EXPECT_FALSE(s.stopped);
  EXPECT_EQ(s.payload_sha256, newest_checkpoint(folder).payload_sha256());
  const std::string expected = left_in(folder);
  for (const int threads : {1, 2, 3}) {
    const fs::path other = fresh("threads");
    train_in(other, small_training({"threads=" + std::to_string(threads)}));
    EXPECT_TRUE(left_in(other) == expected) << threads << " threads";
  }
  for (const std::string& set : sim::instruction_sets()) {
    const fs::path other = fresh("set");
    TrainConfig c = small_training();
    c.fly.fleet.batch.instruction_set = c.learner.instruction_set = set;
    train_in(other, c);
    EXPECT_TRUE(left_in(other) == expected) << set;
  }
  const fs::path seeded = fresh("seed");
  train_in(seeded, small_training({"seed=4"}));
  EXPECT_FALSE(left_in(seeded) == expected);
}

/// Two actions instead of four: on either engine, through a stop, to a policy that is evaluated and flies.
TEST(Trainer, TrainsVoltages) {
  for (const char* engine : {"lanes", "libtorch"}) {
    if (std::string(engine) == "libtorch" && !has_libtorch()) continue;
    const TrainConfig c =
        small_training({std::string("learn.engine=") + engine, "collect.flappers=17", "learn.updates=8",
                        "evaluate.every=8", "evaluate.vehicles=4", "flight.duration_s=0.2",
                        "task.success.keep.from_s=0.1", "task.success.keep.until_s=0.2"},
                       "hover_voltages");
    const fs::path whole = fresh("voltages"), stopped = fresh("voltages_stopped");
    EXPECT_EQ(train_in(whole, c).updates, 8u);
    train_in(stopped, c, [](const TrainProgress& p) { return p.update < 4; });
    const auto from = unfinished_run_in(stopped);
    ASSERT_TRUE(from);
    train_in(stopped, c, {}, from);
    EXPECT_TRUE(left_in(stopped) == left_in(whole)) << engine;
    const policy::Actor best = policy::read_actor(whole / "best.json");
    EXPECT_EQ(best.action, (std::vector<std::string>{"left_voltage", "right_voltage"}));
    EXPECT_EQ(best.widths, (std::vector<int>{22, 16, 2}));
    rollout::Rollout<float> flight(rollout::read_fly_config(whole / "config" / "fly.toml", {"flight.duration_s=0.02"}),
                                   1);
    while (!flight.over()) flight.step();
    EXPECT_GT(std::abs(flight.fleet().adds(0)[1]), 0);
    EXPECT_GT(std::abs(flight.fleet().batch().state(0).stroke_rate_rad_s[1]), 0);
  }
}

TEST(Trainer, GoesOnFromAnyStopAsIfNothingHadBeen) {
  const fs::path whole = fresh("whole"), stopped = fresh("stopped");
  const TrainConfig c = small_training({"threads=2"});
  train_in(whole, c);
  const std::string expected = left_in(whole);
  // after every step, warm-up included
  std::uint64_t at = 0;
  int stops = 0;
  std::optional<fs::path> from;
  while (at < c.updates) {
    const TrainSummary s = train_in(
        stopped, c, [&](const TrainProgress&) { return false; }, from);
    EXPECT_EQ(s.stopped, s.updates < c.updates);
    at = s.updates;
    from = newest_checkpoint(stopped).path();
    ASSERT_LT(++stops, 30);
  }
  EXPECT_GT(stops, 15);
  EXPECT_TRUE(left_in(stopped) == expected);
}

/// Flappers meet effects that none of the first episodes had: their memory has to be there from the start.
TEST(Trainer, GoesOnWithEffectsThatAreDrawn) {
  const Overrides drawn = {"drawn_effects.none=0.5", "drawn_effects.most=1",    "drawn_effects.magnitude=2",
                           "collect.flappers=16",    "collect.vehicles=48",     "learn.updates=16",
                           "evaluate.every=16",      "collect.steps_before=45", "flight.duration_s=2"};
  for (const std::string name : {"escape", "flapper_dash"}) {
    const fs::path whole = fresh("drawn_whole_" + name), stopped = fresh("drawn_stopped_" + name);
    const TrainConfig c = small_training(drawn, name);
    train_in(whole, c);
    train_in(stopped, c, [](const TrainProgress& p) { return p.update < 8; });
    train_in(stopped, c, {}, newest_checkpoint(stopped).path());
    EXPECT_TRUE(left_in(stopped) == left_in(whole)) << name;
  }
}

TEST(Trainer, SumsWhatItsPartsTook) {
  const fs::path folder = fresh("parts");
  const TrainConfig c = small_training();
  const TrainSummary first = train_in(folder, c, [](const TrainProgress& p) { return p.update < 16; });
  EXPECT_TRUE(finished_run_in(folder).is_null());
  const TrainSummary both = train_in(folder, c, {}, unfinished_run_in(folder));
  EXPECT_GT(both.wall_s, first.wall_s);
  EXPECT_GT(both.evaluation_s, first.evaluation_s);
  EXPECT_GT(both.share_simulation * both.wall_s, first.share_simulation * first.wall_s);
  const std::vector<double> evaluation_s = read_metrics(folder / "timing.jsonl").column("evaluation_s");
  EXPECT_TRUE(std::ranges::is_sorted(evaluation_s));
  EXPECT_EQ(finished_run_in(folder), json_of(both));
  EXPECT_FALSE(unfinished_run_in(folder));
  // of one that was killed after its last checkpoint, nothing is left to do
  const TrainSummary again = train_in(folder, c, {}, newest_checkpoint(folder).path());
  EXPECT_EQ(again.evaluation_s, both.evaluation_s);
  const double simulation_s = both.share_simulation * both.wall_s;  // four roundings
  EXPECT_NEAR(again.share_simulation * again.wall_s, simulation_s, 1e-14 * simulation_s);
  EXPECT_GE(again.share_learning * again.wall_s, (1 - 1e-14) * both.share_learning * both.wall_s);
}

TEST(Trainer, KeepsOneKindOfRunsInAFolder) {
  const TrainConfig c = small_training({"learn.updates=8"});
  const fs::path alone = fresh("alone"), seeds = fresh("seeds");
  train_in(alone, c);
  train_in(seed_folder(seeds, 3), c);
  EXPECT_EQ(test::refusal([&] { train_in(seeds, c); }),
            seeds.string() + ": holds runs of several seeds; accepted: a new folder, or --seeds");
  EXPECT_EQ(test::refusal([&] { refuse_run_beside_seeds(alone); }),
            alone.string() + ": holds a run of its own; accepted with --seeds: a new folder, or one of --seeds");
  EXPECT_EQ(test::refusal([&] { refuse_run_beside_seeds(seeds); }), "accepted");
}

/// A killed process leaves metrics behind its checkpoint, which the run that goes on cuts off.
TEST(Trainer, ForgetsWhatCameAfterTheCheckpoint) {
  const fs::path whole = fresh("kept"), resumed = fresh("resumed");
  const TrainConfig c = small_training({"checkpoint.keep=9"});
  train_in(whole, c);
  const std::string expected = left_in(whole);
  fs::copy(whole, resumed, fs::copy_options::recursive);
  const TrainSummary s = train_in(resumed, c, {}, resumed / checkpoint_name(8));
  EXPECT_EQ(s.updates, 24u);
  EXPECT_TRUE(left_in(resumed) == expected);
  EXPECT_EQ(read_metrics(resumed / "metrics.jsonl").column("update"), (std::vector<double>{8, 16, 24}));
  EXPECT_EQ(read_metrics(resumed / "timing.jsonl").column("update").size(), 3u);
}

/// Nor does anything of that future stand in the way when it is stopped again: checkpoints, half a line of a power cut.
TEST(Trainer, GoesOnAfterAnOlderCheckpointAndAStop) {
  const fs::path whole = fresh("old_whole"), resumed = fresh("old_resumed");
  const TrainConfig c = small_training({"checkpoint.keep=2", "learn.updates_per_step=1", "learn.policy_delay=3"});
  train_in(whole, c);
  const std::string expected = left_in(whole);
  fs::copy(whole, resumed, fs::copy_options::recursive);
  const auto paths = checkpoints_in(resumed);
  ASSERT_EQ(paths.size(), 2u);
  {
    std::ofstream torn(resumed / "timing.jsonl", std::ios::app);
    torn << "{\"upd";
  }
  fs::remove(resumed / "run.json");
  int steps = 0;
  train_in(
      resumed, c, [&](const TrainProgress&) { return ++steps < 4; }, paths.back());
  EXPECT_TRUE(fs::exists(resumed / "run.json"));
  EXPECT_EQ(newest_checkpoint(resumed).header().update, 20u);
  train_in(resumed, c, {}, newest_checkpoint(resumed).path());
  EXPECT_TRUE(left_in(resumed) == expected);
}

TEST(Trainer, LeavesARunFolder) {
  const fs::path folder = fresh("folder");
  const TrainConfig c = small_training({"checkpoint.every=4", "checkpoint.keep=2"});
  std::vector<std::uint64_t> evaluated;
  train_in(folder, c, [&](const TrainProgress& p) {
    if (p.evaluated) evaluated.push_back(p.update);
    return true;
  });
  EXPECT_EQ(evaluated, (std::vector<std::uint64_t>{8, 16, 24}));
  for (const char* name :
       {"config/train.toml", "config/fly.toml", "config/task.toml", "config/vehicle.toml", "run.json", "metrics.jsonl",
        "metrics.csv", "timing.jsonl", "events.out.tfevents.flappy", "best.json", "last.json", "summary.json"})
    EXPECT_TRUE(fs::is_regular_file(folder / name)) << name;
  EXPECT_EQ(checkpoints_in(folder).size(), 2u);
  const auto json = nlohmann::json::parse(io::read_text(folder / "summary.json"));
  for (const char* key : {"seed", "wall_s", "env_steps", "updates", "time_to_50_s", "time_to_80_s", "time_to_90_s",
                          "time_to_95_s", "share_simulation", "share_learning"})
    EXPECT_TRUE(json.contains(key)) << key;
  EXPECT_TRUE(json["time_to_90_s"].is_null());
  EXPECT_EQ(json["seed"], 3);
  const double simulation = json["share_simulation"], learning = json["share_learning"];
  EXPECT_GT(simulation, 0);
  EXPECT_GT(learning, 0);
  EXPECT_LE(simulation + learning, 1.001);
  // the configuration it leaves is the one it had, and flies the best policy
  const TrainConfig again = read_train_config(folder / "config" / "train.toml");
  EXPECT_EQ(again.sha256, c.sha256);
  EXPECT_EQ(again.resolved, c.resolved);
  ASSERT_TRUE(again.fly.actor);
  EXPECT_EQ(again.fly.actor->weights, policy::read_actor(folder / "best.json").weights);
  // and what it costs is what was said
  const TrainCosts costs = costs_of(c);
  std::uintmax_t bytes = 0;
  for (const auto& entry : fs::recursive_directory_iterator(folder))
    if (entry.is_regular_file()) bytes += entry.file_size();
  EXPECT_LT(bytes, costs.disk_bytes);
}

TEST(Trainer, StartsFromATrainedActor) {
  const fs::path first = fresh("first"), second = fresh("second");
  const TrainConfig c = small_training({"learn.policy_averaging=1"});
  train_in(first, c);
  TrainOptions o;
  o.folder = second;
  o.init = read_train_init(first / "last.json");
  o.keep_going = [](const TrainProgress&) { return false; };  // before it learns
  EXPECT_GE(train(c, o).best_success.value_or(-1), 0);        // later evaluations have to do better than this
  EXPECT_EQ(policy::read_actor(second / "last.json").weights, o.init->actor.weights);

  // what it knows is not lost to critics that know nothing yet
  const auto learnt = [&](const std::string& actor_after) {
    const TrainConfig alone = small_training({"learn.policy_averaging=1", actor_after});
    o.folder = fresh("after");
    o.keep_going = {};
    EXPECT_EQ(train(alone, o).updates, alone.updates);
    return policy::read_actor(o.folder / "last.json").weights;
  };
  EXPECT_EQ(learnt("learn.actor_after=1000000"), o.init->actor.weights);
  EXPECT_NE(learnt("learn.actor_after=" + std::to_string(c.updates - 2)), o.init->actor.weights);

  const auto refused = [&](const policy::Actor& init, const char* why) {
    o.folder = fresh("refused");
    o.init = std::make_shared<TrainInit>(TrainInit{init, std::nullopt, "", network_keys(init)});
    try {
      train(c, o);
      ADD_FAILURE() << why;
    } catch (const io::InputError& e) {
      EXPECT_NE(std::string(e.what()).find(why), std::string::npos) << e.what();
    }
  };
  policy::Actor other = o.init->actor;
  other.scale[0] *= 2;
  refused(other, "scales its observations in another way");
  other.observation[0] = "something";
  refused(other, "--init: the policy observes or does something else");
  const TrainConfig wide = small_training({"networks.actor=[8]"});
  const fs::path third = fresh("third");
  train_in(third, wide, [](const TrainProgress&) { return false; });
  refused(policy::read_actor(third / "last.json"),
          "--init: networks.actor is [8] there, [16] in this configuration; accepted: the same networks, as by --set "
          "'networks.actor=[8]'");
  EXPECT_FALSE(fs::exists(o.folder));
  const auto kind = [&](const fs::path& file) {
    const std::string line = test::refusal([&] { read_train_init(file); });
    return line.substr(file.string().size());
  };
  const std::string accepted =
      "; accepted: a run folder (its best actor and its critics), or an actor, as best.json of a run";
  EXPECT_EQ(kind(newest_checkpoint(first).path()), ": is a checkpoint" + accepted);
  std::ofstream(first / "policy.onnx") << "\x08\x08\x12\x06";
  EXPECT_EQ(kind(first / "policy.onnx"), ": is an ONNX model" + accepted);
  std::ofstream(first / "empty.json");
  EXPECT_EQ(kind(first / "empty.json"), ": is no actor" + accepted);
}

TEST(Trainer, StartsFromARunWithItsCritics) {
  const fs::path first = fresh("first");
  const TrainConfig c = small_training();
  train_in(first, c);
  const auto numbers = [](const fs::path& folder) {
    std::string bytes = newest_checkpoint(folder).text("numbers");
    std::vector<float> values(bytes.size() / sizeof(float));
    std::memcpy(values.data(), bytes.data(), bytes.size());
    return values;
  };
  const std::vector<float> learnt = numbers(first);
  const auto differing = [&](const fs::path& from) {
    TrainOptions o;
    o.folder = fresh("second");
    o.init = read_train_init(from);
    o.keep_going = [](const TrainProgress&) { return false; };
    train(c, o);
    const std::vector<float> own = numbers(o.folder);
    std::size_t n = 0;
    for (std::size_t i = 0; i < own.size(); ++i) n += own[i] != learnt.at(i);
    return n;
  };
  const std::size_t of_actor = 2 * policy::read_actor(first / "best.json").weights.size();  // and of its target
  EXPECT_LE(differing(first), of_actor);
  EXPECT_GT(differing(first / "best.json"), 2 * of_actor);

  TrainOptions o;
  o.folder = fresh("wide");
  o.init = read_train_init(first);
  try {
    train(small_training({"networks.critic=[8]"}), o);
    ADD_FAILURE() << "other critics";
  } catch (const io::InputError& e) {
    EXPECT_NE(std::string(e.what()).find("--init: networks.critic is "), std::string::npos) << e.what();
    EXPECT_NE(std::string(e.what()).find(" there, [8] in this configuration; "), std::string::npos) << e.what();
  }
}

TEST(Trainer, RefusesWhatDoesNotFit) {
  const fs::path folder = fresh("refusing");
  const TrainConfig c = small_training();
  train_in(folder, c, [](const TrainProgress&) { return false; });
  const auto refused = [&](const TrainConfig& config, const std::optional<fs::path>& from, const char* why) {
    try {
      train_in(folder, config, {}, from);
      ADD_FAILURE() << why;
    } catch (const io::InputError& e) {
      EXPECT_NE(std::string(e.what()).find(why), std::string::npos) << e.what();
    }
  };
  refused(c, {}, "holds a run; accepted: a new folder, or --resume");
  refused(small_training({"reward.scale=2.0"}), newest_checkpoint(folder).path(), "is of another configuration");
  EXPECT_TRUE(fs::exists(folder / "summary.json")) << "what is refused removes nothing";
  const fs::path brief = fresh("brief");  // flies too short for its task: nothing has begun
  EXPECT_THROW(train_in(brief, small_training({"flight.duration_s=0.3"})), io::InputError);
  EXPECT_FALSE(fs::exists(brief / "config"));
  TrainConfig wild = small_training();
  wild.reward_scale = 1e30;
  try {
    train_in(fresh("wild"), wild);
    ADD_FAILURE() << "no divergence";
  } catch (const io::InputError& e) {
    EXPECT_NE(std::string(e.what()).find("the critics diverged at update"), std::string::npos) << e.what();
  }
}

TEST(TrainConfig, SaysWhatIsWrong) {
  const auto refused = [](const Overrides& overrides, const std::string& why) {
    try {
      small_training(overrides);
      ADD_FAILURE() << why;
    } catch (const io::InputError& e) {
      EXPECT_NE(std::string(e.what()).find(why), std::string::npos) << e.what();
    }
  };
  refused({"learn.batch=100"}, "learn.batch: is no multiple of 64");
  refused({"networks.actor=[32, 5000]"}, "networks.actor");
  refused({"networks.activation=silu"},
          "networks.activation: is what the lanes do not learn; accepted: \"relu\", \"tanh\", or learn.engine = "
          "\"libtorch\"");
  refused({"networks.layer_norm=true"}, "networks.layer_norm: is what the lanes do not learn");
  refused({"learn.weight_decay=0.1"}, "learn.weight_decay: is what the lanes do not learn");
  refused({"learn.gradient_clip=1"}, "learn.gradient_clip: is what the lanes do not learn");
  refused({"learn.device=cuda"}, "learn.device: is what the lanes do not learn");
  refused({"learn.engine=torch"}, "learn.engine");
  refused({"task.history=9"}, "history: 9 is out of range; accepted: an integer from 1 to 8");
  refused({"networks.actor=[]"}, "networks.actor: is no list of hidden layers");
  refused({"learn.replay=1024", "collect.flappers=2000"}, "learn.replay: is less than one step adds");
  refused({"learn.replay=2048", "learn.batch=4096"}, "learn.replay: is less than a batch");
  refused({"collect.noise_low=0.4", "collect.noise_high=0"}, "collect.noise_high: is below noise_low");
  refused({"observation.time=[1, 2]"}, "observation.time");
  refused({"observation.colour=[1]"}, "observation.colour: unknown key");
  refused({"learn.speed=3"}, "learn.speed: unknown key");
  refused({"task.reward.gaol=3"}, "--set task.reward.gaol=3: reward.gaol: unknown key");
  refused({"precision=double"}, "flies in double");
  refused({"flight.support=welded", "task.start.kind=flying"}, "holds its vehicle on a stand");
  try {
    read_train_config(test::source_path("configs/train/escape.toml"), {"task=../tasks/hover.toml"});
    ADD_FAILURE() << "no success to train for";
  } catch (const io::InputError& e) {
    EXPECT_NE(std::string(e.what()).find("says no success"), std::string::npos) << e.what();
  }
}

TEST(TrainConfig, SchedulesItsRates) {
  const Overrides all = {"learn.updates=1000", "learn.updates_per_step=1", "learn.last_rate=0.2"};
  const auto with = [&](Overrides more) {
    more.insert(more.end(), all.begin(), all.end());
    return small_training(more);
  };
  const TrainConfig line = with({}), cosine = with({"learn.schedule=cosine", "learn.warm_up=100"});
  EXPECT_DOUBLE_EQ(line.rate_share(0), 1);
  EXPECT_DOUBLE_EQ(line.rate_share(250), 0.8);
  EXPECT_DOUBLE_EQ(cosine.rate_share(0), 0.01 * line.rate_share(0));
  EXPECT_NEAR(cosine.rate_share(500), 0.6, 1e-12);
  EXPECT_NEAR(cosine.rate_share(250), 1 - 0.8 * (1 - std::sqrt(0.5)) / 2, 1e-12);
  EXPECT_NEAR(cosine.rate_share(1000), 0.2, 1e-12);
}

TEST(TrainConfig, SeesItsHistory) {
  const TrainConfig one = small_training(), three = small_training({"task.history=3"});
  const auto seen = three.blank_actor().observation;
  const std::size_t now = one.blank_actor().observation.size();
  ASSERT_EQ(seen.size(), 3 * now);
  EXPECT_EQ(seen[now], seen[0] + "_1_ago");
  EXPECT_EQ(three.learner.input.scale[2 * now + 4], one.learner.input.scale[4]);
}

TEST(TrainConfig, CountsInWholeSteps) {
  const TrainConfig c = small_training({"learn.updates=25", "learn.updates_per_step=4", "evaluate.every=1"});
  EXPECT_EQ(c.updates, 28u);
  EXPECT_EQ(c.evaluate_every, 4u);
  EXPECT_EQ(c.checkpoint_every, 8u);
}

TEST(TrainConfig, ScalesObservationsByTheirRangeUnlessTold) {
  const TrainConfig c = small_training();
  const auto signals = c.fly.fleet.task.observation();
  for (std::size_t k = 0; k < signals.size(); ++k) {
    EXPECT_EQ(c.learner.input.mean[k], (signals[k].low + signals[k].high) / 2);
    if (signals[k].name == "x_error") EXPECT_EQ(c.learner.input.scale[k], 5);
    if (signals[k].name == "added_bias") EXPECT_EQ(c.learner.input.scale[k], 1 / 3.5);
  }
  for (const double scale : small_training({"task.action.split_cycle=[0, 0]"}).learner.input.scale)
    EXPECT_LT(scale, 100);  // of an action that may not change, too
}

}  // namespace
}  // namespace flappy::learn
