// What a plan expects, beside what screening finds in flights of a robot that has the effect.
#include "gap/next/plan.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "full.hpp"
#include "gap/flown_flights.hpp"
#include "gap/next/next_experiment.hpp"
#include "gap/next/separation.hpp"
#include "io/temporary_folder.hpp"
#include "io/text.hpp"
#include "model/effects/registry.hpp"
#include "refusal.hpp"
#include "rollout/simulated_flight.hpp"

namespace flappy::gap {
namespace {

const std::string kVehicle = kTestConfigs + "vehicles/hummingbird_nominal.toml";

/// One flight of the manoeuvre tour, 5 s.
Flights tour(const model::Vehicle& vehicle) {
  std::vector<Manoeuvre> all = read_manoeuvres(kTestConfigs + "gap/experiments");
  rollout::FlyConfig config = std::ranges::find(all, "tour", &Manoeuvre::name)->config;
  config.duration_s = config.settle_s + 5;
  auto flown = simulate(config, vehicle, 1, config.settle_s);
  return {{}, {std::make_shared<ResetPrediction>(Recording("tour", std::move(*flown[0].log), nominal_vehicle()))}};
}

model::Vehicle with(const std::string& effect, double times) {
  model::Vehicle v = nominal_vehicle();
  const model::CatalogueEffect& e = *model::find_effect(v, effect);
  for (std::size_t k = 0; k < e.parameters.size(); ++k)
    v.effects[effect][e.parameters[k].name] =
        e.parameters[k].typical * (static_cast<int>(k) < e.info.magnitudes ? times : 1);
  return v;
}

class SeparationOfTour : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    flights_ = new Flights(tour(nominal_vehicle()));
    prior_ = new sim::Randomisation(shipped_priors());
    robot_ = new RobotFit(RobotFit::planned(question_of(*flights_), *flights_, *prior_, read_model_discrepancy(), 2));
  }
  static void TearDownTestSuite() { delete robot_, delete prior_, delete flights_; }
  static Separation of(const std::map<std::string, double>& asked) {
    return separation_of(*flights_, *robot_, asked, read_verdict_rule(), 2);
  }
  static std::size_t place(const Separation& s, const std::string& effect) {
    return static_cast<std::size_t>(std::ranges::find(s.effects, effect) - s.effects.begin());
  }
  static inline Flights* flights_;
  static inline sim::Randomisation* prior_;
  static inline RobotFit* robot_;
};

// Noise alone lets a gain of N nats vary by sqrt(2 N); the flight of a robot with the effect takes another path.
TEST_F(SeparationOfTour, ExpectsWhatScreeningFinds) {
  if (!test::full()) GTEST_SKIP() << "takes seconds: with --full";
  const Separation s = of({{"spring_hardening", 1}, {"mocap_delay", 1}});
  for (const std::string effect : {"spring_hardening", "mocap_delay"}) {
    const Flights flown = tour(with(effect, 1));
    const RobotFit there = RobotFit::planned(question_of(flown), flown, *prior_, read_model_discrepancy(), 2);
    const std::vector<ScreenedEffect> found = screen(there.fitter(), there.parameters(), there.magnitudes());
    EXPECT_EQ(found.front().effect, effect);
    const std::size_t at = place(s, effect);
    const double expected = s.nats(static_cast<Eigen::Index>(at), s.nats.cols() - 1);
    EXPECT_NEAR(found.front().gain, expected, 3 * std::sqrt(2 * expected) + 0.3 * expected) << effect;
    EXPECT_GT(expected, 10) << effect;
    const auto own = std::ranges::find(s.rivals, effect) - s.rivals.begin();
    EXPECT_EQ(s.nats(static_cast<Eigen::Index>(at), own), 0);
  }
}

TEST_F(SeparationOfTour, IsSureFromTheMagnitudeThatItSays) {
  const Separation s = of({{"wind", 1}, {"com_offset", 1}});
  for (const std::string effect : {"wind", "com_offset"}) {
    const std::size_t at = place(s, effect);
    ASSERT_TRUE(s.sure_from[at]) << effect;
    const Separation there = of({{effect, *s.sure_from[at]}});
    EXPECT_NEAR(there.probability[0], kSure, 0.09) << effect;
  }
}

// The verdict charges an effect of the surroundings fewer nats for chance than an effect of the robot.
TEST_F(SeparationOfTour, ChargesAnEffectWhatItGainsByChance) {
  VerdictRule rule = read_verdict_rule();
  ASSERT_TRUE(std::ranges::count(rule.gain.outside, "wind"));
  const double before = separation_of(*flights_, *robot_, {{"wind", 0.2}}, rule, 2, false).probability[0];
  rule.gain.outside.clear();
  const double after = separation_of(*flights_, *robot_, {{"wind", 0.2}}, rule, 2, false).probability[0];
  EXPECT_LT(after, before);
}

// A wing that lost area flies on the other side: predicted so, nothing is left but what was left before.
TEST(Changes, ArePredictedInTheFlightsBeforeWhichTheyWereMade) {
  std::vector<Manoeuvre> all = read_manoeuvres(kTestConfigs + "gap/experiments");
  rollout::FlyConfig config = std::ranges::find(all, "tour", &Manoeuvre::name)->config;
  config.duration_s = config.settle_s + 3;
  const model::Vehicle robot = with("wing_damage", 2);
  const auto left = [&](bool swapped, bool declared) {
    config.changes.swapped_wings = swapped;
    flightlog::FlightLog log = std::move(*simulate(config, robot, 1, config.settle_s)[0].log);
    EXPECT_EQ(log.header.changes.swapped_wings, swapped);
    log.header.changes.swapped_wings = declared;
    const Flights flight{{}, {std::make_shared<ResetPrediction>(Recording("tour", std::move(log), nominal_vehicle()))}};
    const std::vector<Residuals> r = residuals(flight, {VehicleHypothesis{.vehicle = robot}}, 1);
    return rms(*flight[0], r[0][0], kAngularAccelerationX * kCoefficients);
  };
  const double before = left(false, false);
  EXPECT_NEAR(left(true, true), before, 0.2 * before);
  EXPECT_GT(left(true, false), 2 * before);
}

TEST(Plan, RefusesWhatCannotBeFlown) {
  PlanSettings s;
  s.vehicle = kVehicle;
  const auto with_change = [&](const auto& change) {
    PlanSettings other = s;
    change(other);
    return test::refusal([&] { make_plan(other); });
  };
  EXPECT_EQ(with_change([](PlanSettings& o) { o.vehicle = kTestConfigs + "vehicles/flapper_nimble.toml"; }),
            kTestConfigs +
                "vehicles/flapper_nimble.toml: has no wings that motors drive; accepted: a vehicle with wings "
                "and motors");
  const std::string windy = testing::TempDir() + "windy.toml";
  io::write_atomically(windy, io::read_text(kVehicle) + "[effects.wind]\nx_m_s = 1.0\n");
  EXPECT_TRUE(
      with_change([&](PlanSettings& o) { o.vehicle = windy; }).ends_with("accepted: a vehicle without effects"));
  EXPECT_TRUE(with_change([](PlanSettings& o) { o.manoeuvre = "tuor"; }).ends_with("; did you mean \"tour\"?"));
  EXPECT_TRUE(with_change([](PlanSettings& o) { o.magnitudes = {{"wnd", 1}}; }).ends_with("did you mean \"wind\"?"));
  for (const double times : {0.0, 17.0})
    EXPECT_EQ(with_change([&](PlanSettings& o) { o.magnitudes["wind"] = times; }),
              io::format("--magnitude wind: is %g; accepted: a factor above 0, at most 16.666666666666668", times));
  const std::string work = testing::TempDir() + "work.toml";
  std::string hours = io::read_text(FLAPPY_SOURCE_DIR "/configs/gap/plan_work.toml");
  hours.replace(hours.find("film = 3.0"), 10, "film = -1.0");
  io::write_atomically(work, hours);
  const std::string refused = with_change([&](PlanSettings& o) { o.work = work; });
  EXPECT_TRUE(refused.starts_with(work + ":9:")) << refused;
  EXPECT_TRUE(refused.find("hours.film") != std::string::npos) << refused;
  EXPECT_TRUE(with_change([](PlanSettings& o) { o.sensors = "nowhere.toml"; }).find("nowhere.toml") !=
              std::string::npos);
}

}  // namespace
}  // namespace flappy::gap
