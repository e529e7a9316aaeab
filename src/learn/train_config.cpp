#include "learn/train_config.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "io/parallel.hpp"
#include "io/sha256.hpp"
#include "io/toml_writer.hpp"

namespace flappy::learn {
namespace {

using Overrides = std::vector<std::string>;

/// Keys of the training configuration itself; overrides of other keys apply to the configuration of its flights.
const Overrides kOwn = {"schema", "fly",   "seed",     "threads",    "observation", "networks", "collect",
                        "reward", "learn", "evaluate", "checkpoint", "student",     "dds"};

std::pair<Overrides, Overrides> routed(const Overrides& overrides) {
  std::pair<Overrides, Overrides> own_and_flown;
  for (const std::string& text : overrides) {
    const std::size_t begin = std::min(text.find_first_not_of(" \t"), text.size());
    const std::string first = text.substr(begin, text.find_first_of(".= \t", begin) - begin);
    (std::ranges::count(kOwn, first) > 0 ? own_and_flown.first : own_and_flown.second).push_back(text);
  }
  return own_and_flown;
}

std::vector<int> widths(const io::Table& t, const char* key) {
  std::vector<int> list;
  for (const double width : t.numbers(key, {1, policy::kMaxWidth})) {
    if (width != std::floor(width)) t.fail(key, "is no list of whole numbers", "[32, 32]");
    list.push_back(static_cast<int>(width));
  }
  if (list.empty() || list.size() >= policy::kMaxLayers)
    t.fail(key, "is no list of hidden layers", "1 to " + std::to_string(policy::kMaxLayers - 1) + " widths");
  return list;
}

std::string widths_text(const std::vector<int>& widths) {
  std::vector<std::string> words;
  for (const int width : widths) words.push_back(std::to_string(width));
  return "[" + io::joined(words) + "]";
}

class Reader {
 public:
  Reader(const std::filesystem::path& path, const Overrides& own, const Overrides& flown)
      : main_(io::Config::load(path, own)), root_(main_.root()) {
    root_.schema(1);
    root_.accept({"schema", "fly", "seed", "threads", "networks", "observation", "collect", "reward", "learn",
                  "evaluate", "checkpoint", "student", "dds"});
    c_.fly = rollout::read_fly_config(root_.file("fly"), flown);
  }

  TrainConfig read() {
    c_.seed = static_cast<std::uint64_t>(root_.integer_or("seed", 0, 0, INT32_MAX));
    c_.threads = io::thread_count(static_cast<int>(root_.integer_or("threads", 0, 0, 1024)));
    if (c_.fly.precision != "float") root_.fail("fly", "flies in double", "precision = \"float\"");
    if (c_.fly.fleet.task.constants.success.by_s <= 0)
      root_.fail("fly", "has a task that says no success", "a task with [success.capture] and [success.keep]");
    if (c_.fly.welded) root_.fail("fly", "holds its vehicle on a stand", "flight.support = \"task\"");
    read_networks();
    read_collection();
    read_learning();
    if (const auto student = root_.optional_table("student")) read_student(*student);
    if (root_.has("dds")) c_.fly.dds = io::read_dds_config(root_);
    root_.finish();
    c_.fly.fleet.batch.threads = c_.threads;
    c_.learner.seed = c_.seed;
    c_.learner.threads = c_.threads;
    keep_texts();
    return std::move(c_);
  }

 private:
  void read_networks() {
    LearnerOptions& l = c_.learner;
    const io::Table t = root_.table("networks");
    l.actor_hidden = widths(t, "actor");
    l.critic_hidden = widths(t, "critic");
    const std::string activation = t.choice("activation", {"relu", "tanh", "elu", "silu"});
    const auto* const known = std::ranges::find(policy::kActivationNames, activation);
    l.actor_activation = l.critic_activation = static_cast<policy::Activation>(known - policy::kActivationNames);
    l.layer_norm = t.boolean_or("layer_norm", false);
    l.last_layer_scale = t.number_or("last_layer_scale", 0.1, {0, 1});

    std::vector<std::string> parts;
    const auto scales = root_.optional_table("observation");
    for (const auto& [part, signals] : c_.fly.fleet.task.observed_parts()) {
      parts.push_back(part);
      std::vector<double> given;
      if (scales && scales->has(part)) given = scales->numbers(part, signals.size(), io::positive(1e6));
      for (std::size_t i = 0; i < signals.size(); ++i) {
        l.input.mean.push_back((signals[i].low + signals[i].high) / 2);
        const double range = signals[i].high - signals[i].low;  // 0 for an action element that may not change
        l.input.scale.push_back(!given.empty() ? given[i] : range > 0 ? 2 / range : 1);
      }
    }
    for (std::vector<double>* list : {&l.input.mean, &l.input.scale}) {
      const std::vector<double> now = *list;  // repeated for each earlier observation of the history
      for (std::uint32_t ago = 1; ago < c_.fly.fleet.task.history; ++ago)
        list->insert(list->end(), now.begin(), now.end());
    }
    l.shape = {static_cast<int>(l.input.mean.size()), c_.fly.fleet.task.actions()};
  }

  void read_collection() {
    const io::Table t = root_.table("collect");
    c_.flappers = static_cast<std::size_t>(t.integer("flappers", 1, 1 << 20));
    c_.vehicles = static_cast<std::size_t>(t.integer_or("vehicles", 1024, 1, 1 << 20));
    c_.steps_before = static_cast<std::size_t>(t.integer_or("steps_before", 20, 1, 1'000'000));
    c_.exploration = {t.number("noise_low", {0, 10}), t.number("noise_high", {0, 10}),
                      t.number("noise_kept", {0, 0.999})};
    if (c_.exploration.high < c_.exploration.low)
      t.fail("noise_high", "is below noise_low", "at least " + io::shortest_digits(c_.exploration.low));
    const io::Table r = root_.table("reward");
    c_.reward_scale = r.number("scale", io::positive(1e6));
    c_.discount = r.number("discount", {0, 1});
    c_.return_steps = static_cast<std::size_t>(r.integer("steps", 1, 100));
  }

  void read_learning() {
    LearnerOptions& l = c_.learner;
    const io::Table t = root_.table("learn");
    const bool on_libtorch = t.choice_or("engine", "lanes", {"lanes", "libtorch"}) == "libtorch";
    if (on_libtorch && !has_libtorch())
      t.fail("engine", "is libtorch, which this build has not",
             "\"lanes\", the package flappy-torch, or a build with libtorch-dev installed");
    c_.engine = on_libtorch ? EngineKind::libtorch : EngineKind::lanes;
    l.weight_decay = t.number_or("weight_decay", 0, {0, 1});
    l.gradient_clip = t.number_or("gradient_clip", 0, {0, 1e6});
    l.device = t.choice_or("device", "cpu", {"cpu", "cuda"});
    if (!on_libtorch) {  // options that the lanes do not implement
      const auto needs = [](const io::Table& of, const char* key, bool used, const char* accepted) {
        if (used)
          of.fail(key, "is what the lanes do not learn", std::string(accepted) + ", or learn.engine = \"libtorch\"");
      };
      const io::Table n = root_.table("networks");
      needs(n, "activation", l.actor_activation > policy::Activation::tanh, "\"relu\", \"tanh\"");
      needs(n, "layer_norm", l.layer_norm, "false");
      needs(t, "weight_decay", l.weight_decay > 0, "0");
      needs(t, "gradient_clip", l.gradient_clip > 0, "0");
      needs(t, "device", l.device != "cpu", "\"cpu\"");
    }
    c_.updates_per_step = static_cast<std::uint64_t>(t.integer("updates_per_step", 1, 10000));
    const auto whole_steps = [&](const io::Table& from, const char* key) {
      const auto n = static_cast<std::uint64_t>(from.integer(key, 1, 1'000'000'000));
      return (n + c_.updates_per_step - 1) / c_.updates_per_step * c_.updates_per_step;
    };
    c_.updates = whole_steps(t, "updates");
    l.batch = static_cast<std::size_t>(t.integer("batch", kChunk, 1 << 20));
    if (l.batch % kChunk != 0) t.fail("batch", "is no multiple of " + std::to_string(kChunk), "n x 64");
    c_.actor_rate = t.number("actor_rate", io::positive(1));
    c_.critic_rate = t.number("critic_rate", io::positive(1));
    c_.last_rate = t.number_or("last_rate", 1, {0, 1});
    c_.cosine = t.choice_or("schedule", "line", {"line", "cosine"}) == "cosine";
    c_.warm_up = static_cast<std::uint64_t>(t.integer_or("warm_up", 0, 0, 1'000'000'000));
    c_.actor_after = static_cast<std::uint64_t>(t.integer_or("actor_after", 0, 0, 1'000'000'000));
    c_.policy_averaging = t.number_or("policy_averaging", 1, io::positive(1));
    l.tau = t.number("averaging", io::positive(1));
    l.twin = t.boolean("twin");
    l.policy_delay = static_cast<int>(t.integer("policy_delay", 1, 1000));
    l.noise_sd = t.number("target_noise", {0, 10});
    l.noise_clip = t.number("target_noise_clip", {0, 10});
    l.huber = t.number_or("huber", 0, {0, 1e6});
    c_.replay = static_cast<std::size_t>(t.integer("replay", 1024, 100'000'000));
    const std::size_t most = c_.flappers * c_.return_steps;  // most transitions that a step may add
    if (c_.replay < most)
      t.fail("replay", "is less than one step adds", "at least " + std::to_string(most) + " transitions");
    if (c_.replay < l.batch)
      t.fail("replay", "is less than a batch", "at least " + std::to_string(l.batch) + " transitions");
    const io::Table e = root_.table("evaluate");
    c_.evaluate_every = whole_steps(e, "every");
    c_.evaluate_vehicles = static_cast<std::size_t>(e.integer("vehicles", 1, 1'000'000));
    const io::Table p = root_.table("checkpoint");
    c_.checkpoint_every = whole_steps(p, "every");
    c_.keep = static_cast<std::size_t>(p.integer_or("keep", 2, 1, 1000));
  }

  void read_student(const io::Table& t) {
    const auto whole = [&](const char* key, std::int64_t least, std::int64_t most) {
      return static_cast<std::size_t>(t.integer(key, least, most));
    };
    if (!c_.fly.drawn_effects)
      root_.fail("student", "has no effects to be taught, for none are drawn", "a flight with [drawn_effects]");
    const io::Table networks = root_.table("networks");
    if (c_.learner.actor_activation > policy::Activation::tanh)
      networks.fail("activation", "is what a student does not learn", "\"relu\", \"tanh\"");
    if (c_.learner.layer_norm) networks.fail("layer_norm", "is what a student does not learn", "false");
    StudentOptions s;
    s.teacher_updates = static_cast<std::uint64_t>(whole("teacher_updates", 1, 1'000'000'000));
    s.memory = static_cast<int>(whole("memory", 0, policy::kMaxMemory));
    s.hidden = widths(t, "hidden");
    if (s.memory > 0 && s.hidden.size() + 1 >= policy::kMaxLayers)
      t.fail("hidden", "has " + std::to_string(s.hidden.size()) + " layers behind a memory",
             "at most " + std::to_string(policy::kMaxLayers - 2));
    s.rounds = whole("rounds", 1, 1'000'000);
    s.flights = whole("flights", 1, 1 << 16);
    s.steps = whole("steps", 1, 1'000'000);
    s.batch = whole("batch", 1, 1 << 20);
    s.kept = whole("kept", 1, 1000);
    s.redraw = whole("redraw", 1, 1'000'000);
    s.led = whole("led", 0, 1'000'000);
    s.rate = t.number("rate", io::positive(1));
    s.last_rate = t.number_or("last_rate", 1, {0, 1});
    c_.student = s;
  }

  void keep_texts() {
    c_.resolved = c_.fly.resolved;
    const auto with = [](const std::string& text, const char* name, const Overrides& overrides) {
      return io::Config::parse(text, name, overrides).resolved();
    };
    c_.resolved["fly.toml"] = with(c_.resolved["fly.toml"], "fly.toml", {"actor=\"../best.json\""});
    std::string all;
    c_.resolved["train.toml"] = with(main_.resolved_without("dds"), "train.toml", {"fly=\"fly.toml\"", "threads=0"});
    for (const auto& [name, text] : c_.resolved) all += name + "\n" + text;
    c_.sha256 = io::sha256(all);
  }

  io::Config main_;
  io::Table root_;
  TrainConfig c_;
};

}  // namespace

double TrainConfig::rate_share(std::uint64_t update) const {
  const double done = static_cast<double>(update) / static_cast<double>(updates);
  const double way = cosine ? (1 - model::sin_cos_wide(std::numbers::pi * done).cos) / 2 : done;
  const double warm = update < warm_up ? static_cast<double>(update + 1) / static_cast<double>(warm_up) : 1;
  return warm * (1 + (last_rate - 1) * way);
}

policy::Actor TrainConfig::blank_actor() const {
  policy::Actor a;
  a.task = fly.fleet.task.name;
  for (const flight::Signal& s : fly.fleet.task.observation()) a.observation.push_back(s.name);
  for (const flight::Signal& s : fly.fleet.task.action()) a.action.push_back(s.name);
  return a;
}

NetworkKeys network_keys(const io::Table& root) {
  const io::Table networks = root.table("networks"), learn = root.table("learn");
  return {{"networks.actor", widths_text(widths(networks, "actor"))},
          {"networks.critic", widths_text(widths(networks, "critic"))},
          {"networks.activation", networks.string("activation")},
          {"networks.layer_norm", networks.boolean_or("layer_norm", false) ? "true" : "false"},
          {"learn.twin", learn.boolean("twin") ? "true" : "false"},
          {"learn.engine", learn.string_or("engine", "lanes")}};
}

NetworkKeys network_keys(const policy::Actor& actor) {
  return {{"networks.actor", widths_text({actor.widths.begin() + 1, actor.widths.end() - 1})},
          {"networks.activation", policy::name_of(actor.hidden)},
          {"networks.layer_norm", actor.layer_norm ? "true" : "false"}};
}

TrainConfig read_train_config(const std::filesystem::path& path, const std::vector<std::string>& overrides) {
  const auto [own, flown] = routed(overrides);
  return Reader(path, own, flown).read();
}

}  // namespace flappy::learn
