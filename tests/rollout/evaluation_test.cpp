#include "rollout/evaluation.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "io/csv.hpp"
#include "rollout/fly.hpp"
#include "rollout/fly_fixture.hpp"
#include "sim/lanes.hpp"
#include "sim/storage.hpp"

namespace flappy::learn {
namespace {

using flight::Folder;
using flight::kMaxActions;
using flight::message;
using rollout::FlyConfig;

const std::string kEscape = test::source_path("configs/fly/escape.toml");

/// The escape, judged and flown for less long.
FlyConfig escape(const std::vector<std::string>& more = {}) {
  std::vector<std::string> overrides = {"flight.duration_s=0.7", "task.success.keep.until_s=0.7", "flight.threads=1"};
  overrides.insert(overrides.end(), more.begin(), more.end());
  return rollout::read_fly_config(kEscape, overrides);
}

/// Starts where it is to be: the controller alone captures and keeps it.
FlyConfig stay(const std::vector<std::string>& more = {}) {
  std::vector<std::string> overrides = {"task.start.position_m.x=0.0", "task.start.x_low_m=-1.0",
                                        "task.start.x_high_m=1.0", "task.start.rotation_rad.z=0.0"};
  for (const char* axis : {"x", "y", "z"})
    overrides.push_back(std::string("task.start.position_m.") + axis + "_half=0.0");
  overrides.insert(overrides.end(), more.begin(), more.end());
  return escape(overrides);
}

/// One layer; of random weights, or the same action always: tanh(+-30) is +-1.
std::shared_ptr<policy::Actor> actor_for(const flight::Task& task, double size, const double (&bias)[kMaxActions]) {
  auto a = std::make_shared<policy::Actor>();
  a->task = task.name;
  for (const flight::Signal& s : task.observation()) a->observation.push_back(s.name);
  for (const flight::Signal& s : task.action()) a->action.push_back(s.name);
  const std::size_t inputs = a->observation.size();
  a->widths = {static_cast<int>(inputs), kMaxActions};
  a->mean.assign(inputs, 0);
  a->scale.assign(inputs, 1);
  std::mt19937 engine(3);
  for (const double b : bias) {
    a->weights.push_back(b);
    for (std::size_t i = 0; i < inputs; ++i) a->weights.push_back(size * (static_cast<double>(engine()) / 0x1p31 - 1));
  }
  return a;
}
std::shared_ptr<policy::Actor> random_actor(const flight::Task& task) { return actor_for(task, 0.5, {0, 0, 0, 0}); }

/// The same actor from outside: raw observations in, volts and split cycle out.
class Outside : public policy::Policy {
 public:
  Outside(const policy::Actor& actor, const flight::Task& task)
      : Policy(actor.widths.front(), kMaxActions), task_(task), numbers_(actor.weights.begin(), actor.weights.end()) {
    view_.layers = 1;
    view_.widths[0] = actor.widths[0], view_.widths[1] = kMaxActions;
    numbers_.insert(numbers_.end(), actor.mean.begin(), actor.mean.end());
    numbers_.insert(numbers_.end(), actor.scale.begin(), actor.scale.end());
    view_.weights = numbers_.data();
    view_.mean = view_.weights + actor.weights.size();
    view_.scale = view_.mean + actor.mean.size();
    view_.clip = static_cast<float>(actor.clip);
  }
  void act(std::size_t count, const float* observation, float* action) const override {
    calls.push_back(count);
    using L = model::Lanes<float, 4>;
    for (std::size_t row = 0; row < count; ++row) {
      L in[flight::kMaxObservation], out[kMaxActions];
      for (int i = 0; i < observations(); ++i) in[i] = L(*observation++);
      policy::evaluate(view_, in, out);
      for (int k = 0; k < kMaxActions; ++k) {
        const double low = task_.constants.action_low[k], high = task_.constants.action_high[k];
        *action++ = static_cast<float>(low + (high - low) * (static_cast<double>(out[k].raw[0]) + 1) / 2);
      }
    }
  }
  mutable std::vector<std::size_t> calls;

 private:
  flight::Task task_;
  std::vector<float> numbers_;
  policy::ActorView<float> view_;
};

std::uint64_t hash(const rollout::Evaluation& e) { return summarise(e.flights).hash; }

TEST(Evaluator, GivesTheSameBytesForAnyThreadsAndParts) {
  FlyConfig config = escape();
  const rollout::Agent agent{random_actor(config.fleet.task), nullptr};
  std::vector<std::uint64_t> hashes;
  // 200 flights, so that three threads have a share each
  for (const auto& [threads, part] :
       std::vector<std::pair<int, std::size_t>>{{1, 1000}, {2, 1000}, {3, 1000}, {2, 133}}) {
    config.fleet.batch.threads = threads;
    rollout::Evaluator evaluator(config, {.count = 200, .part = part});
    hashes.push_back(hash(evaluator.fly(agent, rollout::Detail::full)));
    if (part == 133) hashes.push_back(hash(evaluator.fly(agent, rollout::Detail::full)));  // again, from the same hover
  }
  for (const std::uint64_t h : hashes) EXPECT_EQ(h, hashes[0]);
  config.fleet.seed = 2;
  EXPECT_NE(hash(rollout::Evaluator(config, {.count = 200}).fly(agent, rollout::Detail::full)), hashes[0]);
}

TEST(Evaluator, FliesAFlapperByItsNumber) {
  const FlyConfig config = escape({"precision=double"});
  const rollout::Agent agent{random_actor(config.fleet.task), nullptr};
  const auto all = rollout::Evaluator(config, {.count = 9}).fly(agent, rollout::Detail::success).flights;
  const auto some = rollout::Evaluator(config, {.count = 3, .first_flapper = rollout::kTestFlappers + 5})
                        .fly(agent, rollout::Detail::success)
                        .flights;
  for (std::size_t i = 0; i < some.size(); ++i) EXPECT_EQ(some[i].hash, all[5 + i].hash);
  const auto others = rollout::Evaluator(config, {.count = 9, .first_flapper = rollout::kValidationFlappers})
                          .fly(agent, rollout::Detail::success);
  for (std::size_t i = 0; i < all.size(); ++i) EXPECT_NE(others.flights[i].hash, all[i].hash);
}

TEST(Evaluator, JudgesTheSameInBothDetails) {
  for (const bool starts_there : {false, true}) {
    rollout::Evaluator evaluator(starts_there ? stay() : escape(), {.count = 24});
    const rollout::Agent agent{random_actor(evaluator.config().fleet.task), nullptr};
    for (const rollout::Agent& p : {agent, rollout::Agent{}}) {
      const auto little = evaluator.fly(p, rollout::Detail::success).flights,
                 much = evaluator.fly(p, rollout::Detail::full).flights;
      ASSERT_EQ(little.size(), 24u);
      std::size_t successes = 0;
      for (std::size_t i = 0; i < little.size(); ++i) {
        EXPECT_EQ(little[i].hash, much[i].hash);
        EXPECT_EQ(little[i].captured_s, much[i].captured_s);
        EXPECT_EQ(little[i].success(), much[i].success());
        EXPECT_EQ(much[i].success(), much[i].failure == rollout::TaskFailure::none)
            << rollout::name_of(much[i].failure);
        successes += much[i].success();
      }
      // who starts at the goal has it in the first tick and keeps it unless disturbed
      if (starts_there && !p.actor) EXPECT_EQ(successes, 24u);
      if (starts_there) EXPECT_NEAR(much[0].captured_s, 0.002, 1e-12);
      if (!starts_there) EXPECT_LT(successes, 24u);
    }
  }
}

TEST(Evaluator, FliesThePolicyFromOutsideAsTheActor) {
  const FlyConfig config = escape({"task.action.repeat_s=0.004", "task.action.jitter_s=0.002"});
  const auto actor = random_actor(config.fleet.task);
  const Outside outside(*actor, config.fleet.task);
  rollout::Evaluator evaluator(config, {.count = 20, .part = 12});
  const auto inside = evaluator.fly({actor, nullptr}, rollout::Detail::full).flights;
  const auto beside = evaluator.fly({nullptr, &outside}, rollout::Detail::full).flights;
  const auto alone = evaluator.fly({}, rollout::Detail::full).flights;
  // volts as float and back: 1e-7 of the action, which a flight of 0.35 s amplifies 1e3 times at most
  for (std::size_t i = 0; i < inside.size(); ++i) {
    EXPECT_NEAR(beside[i].energy_J / inside[i].energy_J, 1, 1e-3) << i;
    EXPECT_GT(std::abs(alone[i].energy_J / inside[i].energy_J - 1), 1e-3) << i;
    EXPECT_EQ(beside[i].manoeuvre_s, inside[i].manoeuvre_s);
    EXPECT_NEAR(inside[i].manoeuvre_s, 0.35, 1e-9);  // nobody is handed back to before
  }
  // all at once, every other control period of the 175 until hand-back at 0.35 s
  ASSERT_EQ(outside.calls.size(), 2 * 88u);
  EXPECT_EQ(outside.calls.front(), 12u);
  EXPECT_EQ(outside.calls.back(), 8u);

  // what -1 and 1 stand for, to the bit
  const auto extreme = actor_for(config.fleet.task, 0, {30, -30, 30, -30});
  const Outside same(*extreme, config.fleet.task);
  const auto flown = [&](const rollout::Agent& agent) {
    rollout::Evaluation e = evaluator.fly(agent, rollout::Detail::full);
    for (rollout::Outcome& o : e.flights)
      o.hash = 0;  // the fleet adds up what an actor of its own earns with an action
    return hash(e);
  };
  EXPECT_EQ(flown({extreme, nullptr}), flown({nullptr, &same}));
}

TEST(Evaluator, RefusesAgentsOfAnotherTask) {
  const FlyConfig config = escape();
  const FlyConfig other = escape({"task.observation=[\"position_error\"]"});
  const auto actor = random_actor(other.fleet.task);
  const Outside outside(*actor, other.fleet.task);
  rollout::Evaluator evaluator(config, {.count = 1});
  EXPECT_THROW(evaluator.fly({actor, nullptr}, rollout::Detail::success), std::invalid_argument);
  EXPECT_THROW(evaluator.fly({nullptr, &outside}, rollout::Detail::success), std::invalid_argument);
}

TEST(Evaluator, LeavesTheControllerAlone) {
  const auto alone = [](const std::vector<std::string>& more) {
    return hash(rollout::Evaluator(escape(more), {.count = 4}).fly({}, rollout::Detail::full));
  };
  const std::uint64_t plain = alone({});
  EXPECT_EQ(alone({"task.base=controller"}), plain);
  EXPECT_EQ(alone({"task.action.amplitude_V=[1, 9]"}), plain);  // its middle would lift
  EXPECT_EQ(alone({"task.hand_back.at_s=0.1"}), plain);
  EXPECT_EQ(alone({"task.end.faced_by_s=0.05", "task.end.arrived_by_s=0.05", "task.end.arrived_x_m=0"}), plain);
  EXPECT_NE(alone({"controller=../controllers/arc.toml"}), plain);
  EXPECT_NE(alone({"task.end.distance_m=0.1"}), plain);  // that rule stays
  // a policy does fly by those rules
  const FlyConfig config = escape({"task.end.faced_by_s=0.05"});
  const rollout::Agent still{actor_for(config.fleet.task, 0, {0, 0, 0, 0}), nullptr};
  for (const rollout::Outcome& o : rollout::Evaluator(config, {.count = 3}).fly(still, rollout::Detail::full).flights)
    EXPECT_EQ(o.failure, rollout::TaskFailure::too_late);
}

TEST(Evaluator, CountsCrashes) {
  const FlyConfig config = escape({"world.ground_z_m=-0.2"});
  const rollout::Agent falls{actor_for(config.fleet.task, 0, {-30, 0, 0, 0}), nullptr};
  for (const rollout::Detail detail : {rollout::Detail::success, rollout::Detail::full})
    for (const rollout::Outcome& o : rollout::Evaluator(config, {.count = 5}).fly(falls, detail).flights) {
      EXPECT_FALSE(o.success());
      EXPECT_NE(o.status & sim::kTouchedGround, 0u);
      if (detail == rollout::Detail::full) EXPECT_EQ(o.failure, rollout::TaskFailure::crashed);
    }
}

TEST(Evaluator, AgreesWithAFlightAndItsLog) {
  const Folder folder;
  FlyConfig config = escape();
  config.fleet.first_flapper = 12;
  config.actor = random_actor(config.fleet.task);
  const rollout::FlyResult flown = rollout::fly(config, {.log_folder = folder / "log"});
  rollout::Evaluator evaluator(config, {.count = 1, .first_flapper = 12});
  const rollout::Outcome o = evaluator.fly({config.actor, nullptr}, rollout::Detail::full).flights[0];
  EXPECT_EQ(sim::mixed(0, o.hash), flown.hash);  // it is that flight
  EXPECT_EQ(o.captured_s > 0, !flown.capture_s.empty());
  EXPECT_EQ(o.success(), flown.successes == 1);

  // V^2 T - K N V (psi_end - psi_begin), over R, for each voltage of 1 ms: the log has strokes every 2 ms, of which the second half is
  // longer by psi'' T^2 = (psi'_end - psi'_begin) T/2; what psi'' changes within is of second order in that difference, which itself is
  // below a tenth of the stroke.
  const io::CsvTable truth = io::read_csv(folder / "log" / "truth.csv"),
                     command = io::read_csv(folder / "log" / "command.csv");
  const model::Vehicle vehicle = config.vehicle_of(12);
  double energy_J = 0;
  for (const auto& [side, motor] : {std::pair{"left", vehicle.left.motor}, std::pair{"right", vehicle.right.motor}}) {
    const auto &rate = truth.column(side + std::string("_stroke_rate_rad_s")),
               &stroke = truth.column(side + std::string("_stroke_rad")),
               &volt = command.column(side + std::string("_voltage_V"));
    for (std::size_t k = 0; k < 350; ++k) {  // 1 ms each
      ASSERT_NEAR(command.column("t_s")[k], 0.001 * static_cast<double>(k), 1e-9);
      const double more = 0.001 / 4 * (rate[k / 2 + 1] - rate[k / 2]);
      const double turned = (stroke[k / 2 + 1] - stroke[k / 2]) / 2 + (k % 2 == 0 ? -more : more);
      energy_J +=
          volt[k] * (volt[k] * 0.001 - motor.torque_constant_Nm_A * motor.gear_ratio * turned) / motor.resistance_ohm;
    }
  }
  EXPECT_GT(energy_J, 0.5);
  EXPECT_NEAR(o.energy_J / energy_J, 1, 1e-3);
}

TEST(Evaluator, FliesTheNominalVehicleFromTheMiddle) {
  const FlyConfig config = nominal(escape());
  const auto first = config.vehicle_of(1), second = config.vehicle_of(2);
  EXPECT_EQ(first.torso.mass_kg, config.vehicle.torso.mass_kg);
  EXPECT_EQ(second.left.motor.resistance_ohm, config.vehicle.left.motor.resistance_ohm);
  for (std::uint32_t i = 0; i < 4; ++i) {
    const sim::FlapperState s = config.fleet.task.sample_start({1, i, 0, sim::Stream::start});
    EXPECT_EQ(s.position_m[0], -0.21);
    EXPECT_EQ(s.position_m[1], 0);
    EXPECT_NEAR(s.attitude[3], 1, 1e-12);
  }
  const auto flights = rollout::Evaluator(config, {.count = 2}).fly({}, rollout::Detail::success).flights;
  EXPECT_NE(flights[0].hash, flights[1].hash);  // each with noise of its own
}

TEST(Evaluator, StartsWhereTasksDoNotStartSettled) {
  FlyConfig config = escape({"task.start.kind=flying"});
  const rollout::Agent agent{random_actor(config.fleet.task), nullptr};
  const rollout::Evaluation once =
      rollout::Evaluator(config, {.count = 70, .part = 64}).fly(agent, rollout::Detail::full);
  config.fleet.batch.threads = 2;
  rollout::Evaluator evaluator(config, {.count = 70});
  EXPECT_EQ(hash(evaluator.fly(agent, rollout::Detail::full)), hash(once));
  EXPECT_NE(hash(rollout::Evaluator(escape(), {.count = 70}).fly(agent, rollout::Detail::full)), hash(once));
  EXPECT_EQ(once.steps, 70 * 2800);
  config.randomisation.reset();
  const rollout::Evaluation alike = rollout::Evaluator(config, {.count = 70}).fly(agent, rollout::Detail::full);
  for (std::size_t i = 0; i < 70; ++i) EXPECT_NE(alike.flights[i].hash, once.flights[i].hash);
}

TEST(Evaluator, StopsWhenAsked) {
  rollout::Evaluator evaluator(escape(), {.count = 20, .part = 8});
  double last = 0;
  const auto until = [&](double share) {
    last = 0;
    return evaluator.fly({}, rollout::Detail::full, [&last, share](double done) {
      EXPECT_GT(done, last);
      return (last = done) < share;
    });
  };
  EXPECT_TRUE(until(0.01).stopped);
  EXPECT_EQ(until(0.01).flights.size(), 0u);
  const rollout::Evaluation most = until(0.98);  // amid the flight of the last part
  EXPECT_TRUE(most.stopped);
  EXPECT_EQ(most.flights.size(), 16u);  // whole parts
  const rollout::Evaluation all = until(2);
  EXPECT_FALSE(all.stopped);
  EXPECT_EQ(last, 1);
  EXPECT_EQ(all.flights.size(), 20u);
  for (std::size_t i = 0; i < most.flights.size(); ++i) EXPECT_EQ(most.flights[i].hash, all.flights[i].hash);
}

TEST(Evaluator, RefusesWhatItCannotJudge) {
  const auto refused = [](const FlyConfig& config) {
    return message([&] { rollout::Evaluator(config, {.count = 1}); });
  };
  EXPECT_EQ(refused(escape()), "accepted");
  EXPECT_EQ(
      refused(rollout::read_fly_config(flight::kHover)),
      "task \"hover\" does not say what a success is; accepted: a task with [success.capture] and [success.keep]");
  EXPECT_EQ(refused(escape({"flight.duration_s=0.698"})),
            "task \"escape\" is judged until 0.7 s, but flown for 0.698; accepted: flight.duration_s of 0.7 or more");
  FlyConfig config = escape();
  config.vehicle.effects["ground_effect"] = {};
  EXPECT_EQ(refused(config), "accepted");
}

}  // namespace
}  // namespace flappy::learn
