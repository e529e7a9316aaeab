// Forces of somebody's own simulator: the rows are those of the equations that they were made from, whatever a candidate changes; and what is
// no prediction of the flight is refused by its line.
#include "gap/replay/predicted_loads.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <numbers>

#include "gap/replay/beat_averaged_prediction.hpp"
#include "io/csv.hpp"
#include "refusal.hpp"
#include "vehicles.hpp"

namespace flappy::gap {
namespace {

using model::BeatAveraged;

constexpr double kHz = 100, kEnd_s = 10, kArm_m = 0.08, kFull_Hz = 25;

/// What the inputs do.
std::array<double, 4> inputs_at(double t) {
  return {0.6 + 0.1 * std::sin(3 * t), 0.58 + 0.1 * std::sin(4 * t + 1), 0.5 + 0.1 * std::sin(5 * t),
          0.5 + 0.1 * std::cos(2 * t)};
}

flightlog::FlightLog log_of() {
  flightlog::FlightLog log;
  log.header.vehicle = "own.toml";
  log.header.gravity_m_s2 = 9.81;
  log.header.inputs = {"left_flap", "right_flap", "pitch_servo", "yaw_servo"};
  log.header.mocap = {kHz, 0, 2e-4, 2e-3};
  log.command.declared.resize(4);
  for (int i = 0; i <= static_cast<int>(kEnd_s * kHz); ++i) {
    const double t = i / kHz;
    const Eigen::Quaterniond q(Eigen::AngleAxisd(0.3 * std::sin(2 * t), Eigen::Vector3d(0.6, 0.8, 0)));
    flightlog::MocapStream& m = log.mocap;
    m.t_s.push_back(t), log.command.t_s.push_back(t);
    m.x_m.push_back(std::sin(t)), m.y_m.push_back(std::cos(1.3 * t)), m.z_m.push_back(2 + 0.3 * std::sin(1.7 * t));
    m.qw.push_back(q.w()), m.qx.push_back(q.x()), m.qy.push_back(q.y()), m.qz.push_back(q.z());
    for (std::size_t k = 0; k < 4; ++k) log.command.declared[k].push_back(inputs_at(t)[k]);
  }
  return log;
}

/// Equations whose load is in proportion to what the inputs do, so that a filter before them is one behind them.
model::Vehicle by_equations() {
  model::Vehicle v = model::read_any_vehicle(test::source_path("configs/vehicles/flapper_nimble.toml"));
  BeatAveraged& b = *v.beat_averaged;
  b.compares_moments = true;
  for (BeatAveraged::Actuator& a : b.actuators) a.lag_s = 0;
  std::erase_if(b.coefficients,
                [](const BeatAveraged::Coefficient& c) { return c.name.find("damping") != std::string::npos; });
  b.wrenches = {{"left", {0, kArm_m, 0}, {"", "", "0.5 * lift_N + thrust_N_Hz * left_Hz", "", "", ""}},
                {"right", {0, -kArm_m, 0}, {"", "", "0.5 * lift_N + thrust_N_Hz * right_Hz", "", "", ""}},
                {"both", {}, {"forward_N", "left_N", "", "", "dihedral_arm_m * dihedral", "yaw_Nm * yaw_throw"}}};
  return v;
}

model::Vehicle by_file() {
  model::Vehicle v = by_equations();
  v.beat_averaged->predicted = true;
  v.beat_averaged->wrenches.clear();
  for (BeatAveraged::Coefficient& c : v.beat_averaged->coefficients) c.predicted_at = c.value;
  return v;
}

struct Table {
  std::vector<std::string> names;
  std::vector<std::vector<double>> columns;
  std::vector<double>& at(const std::string& name) {
    return columns[static_cast<std::size_t>(std::ranges::find(names, name) - names.begin())];
  }
};

/// The equations above, by hand. `beat_N`: besides, at 99 Hz, which a sampling of 100 Hz would show at 1 Hz.
Table predicted(const model::Vehicle& v, double hz = kHz, double beat_N = 0) {
  const auto c = [&](const std::string& name) {
    return std::ranges::find(v.beat_averaged->coefficients, name, &BeatAveraged::Coefficient::name)->predicted_at;
  };
  Table table{{"t_s", "force_x_N", "force_y_N", "force_z_N", "moment_x_Nm", "moment_y_Nm", "moment_z_Nm",
               "d_thrust_N_Hz_force_z_N", "d_thrust_N_Hz_moment_x_Nm", "d_lift_N_force_z_N", "d_forward_N_force_x_N",
               "d_left_N_force_y_N", "d_dihedral_arm_m_moment_y_Nm", "d_yaw_Nm_moment_z_Nm"},
              {}};
  table.columns.resize(table.names.size());
  for (int i = 0; i <= static_cast<int>(std::lround(kEnd_s * hz)); ++i) {
    const double t = i / hz;
    const auto [left, right, servo, yaw] = inputs_at(t);
    const double both_Hz = kFull_Hz * (left + right), apart_Hz = kFull_Hz * (left - right);
    const double row[] = {t,
                          c("forward_N"),
                          c("left_N"),
                          c("lift_N") + c("thrust_N_Hz") * both_Hz + beat_N * std::sin(2 * std::numbers::pi * 99 * t),
                          kArm_m * c("thrust_N_Hz") * apart_Hz,
                          c("dihedral_arm_m") * (servo - 0.5),
                          c("yaw_Nm") * (yaw - 0.5),
                          both_Hz,
                          kArm_m * apart_Hz,
                          1,
                          1,
                          1,
                          servo - 0.5,
                          yaw - 0.5};
    for (std::size_t k = 0; k < table.columns.size(); ++k) table.columns[k].push_back(row[k]);
  }
  return table;
}

std::filesystem::path folder() {
  const std::filesystem::path path = testing::TempDir() + "/predicted";
  std::filesystem::create_directories(path);
  return path;
}

BeatAveragedPrediction flight(const model::Vehicle& v, const std::string& csv) {
  std::ofstream(folder() / "predicted.csv") << csv;
  return {folder(), log_of(), v};
}
std::string csv_of(const Table& t) { return io::csv_text(t.names, t.columns); }

double difference(const Rows& a, const Rows& b) {
  EXPECT_EQ(a.size(), b.size());
  double most = 0;
  for (std::size_t i = 0; i < std::min(a.size(), b.size()); ++i) most = std::max(most, std::abs(a[i] - b[i]));
  return most;
}

/// What a diagnosis tries of a vehicle.
std::vector<VehicleHypothesis> candidates(const model::Vehicle& v) {
  std::vector<VehicleHypothesis> all(8, {v, 0, {}});
  for (BeatAveraged::Coefficient& c : all[1].vehicle.beat_averaged->coefficients) c.value = 1.2 * c.value + 0.01;
  all[2].vehicle.torso.mass_kg *= 1.1;
  all[2].vehicle.torso.com_m = {0.01, -0.02, 0.03};
  all[3].lag_s = 0.013;
  all[4].vehicle.effects["flapping_counter_force"] = {{"x_per_s", 3}, {"y_per_s", 2}, {"z_per_s", 1}};
  all[5].vehicle.effects["stroke_plane_actuation"] = {{"shift_m_s2", 20}};
  all[6].vehicle.effects["thrust_axis_tilt"] = {{"x_rad", 0.1}, {"y_rad", 0.05}};
  all[7].vehicle.effects["body_drag"] = {};
  return all;
}

TEST(PredictedLoads, ShowTheRowsOfTheEquationsTheyWereMadeFrom) {
  const BeatAveragedPrediction equations(folder(), log_of(), by_equations());
  const BeatAveragedPrediction file = flight(by_file(), csv_of(predicted(by_file())));
  const std::vector<VehicleHypothesis> a = candidates(by_equations()), b = candidates(by_file());
  const Rows plain = file.predict({&b[0]})[0];
  for (std::size_t i = 0; i < a.size(); ++i) {
    SCOPED_TRACE(i);
    const Rows rows = file.predict({&b[i]})[0];
    EXPECT_LT(difference(equations.predict({&a[i]})[0], rows), 1e-9);
    if (i > 0) EXPECT_GT(difference(plain, rows), 1e-3);
  }
  for (int channel = kAngularAccelerationX; channel <= kSpecificForceZ; ++channel)
    EXPECT_TRUE(file.has_rows(channel, 0)) << channel;
}

TEST(PredictedLoads, MayBeMadeAtOtherCoefficientsThanTheVehiclesFileHasNow) {
  model::Vehicle made = by_file();
  for (BeatAveraged::Coefficient& c : made.beat_averaged->coefficients) c.predicted_at = 0.8 * c.value - 0.02;
  const std::string file = testing::TempDir() + "/corrected.toml";
  std::ofstream(file) << model::vehicle_text(made);
  const model::Vehicle again = model::read_any_vehicle(file);
  EXPECT_TRUE(again.beat_averaged->predicted);
  const BeatAveragedPrediction equations(folder(), log_of(), by_equations());
  const VehicleHypothesis a{by_equations(), 0, {}}, b{again, 0, {}};
  EXPECT_LT(difference(equations.predict({&a})[0], flight(again, csv_of(predicted(made))).predict({&b})[0]), 1e-9);
}

TEST(PredictedLoads, MayHaveTheirOwnSampling) {
  const BeatAveragedPrediction same = flight(by_file(), csv_of(predicted(by_file())));
  const BeatAveragedPrediction rarer = flight(by_file(), csv_of(predicted(by_file(), 25)));
  const BeatAveragedPrediction finer = flight(by_file(), csv_of(predicted(by_file(), 1000, 0.2)));
  const VehicleHypothesis c{by_file(), 0, {}};
  const Rows rows = same.predict({&c})[0];
  EXPECT_LT(difference(rows, rarer.predict({&c})[0]), 0.1);
  EXPECT_LT(difference(rows, finer.predict({&c})[0]), 0.03);  // the wings' own 2 m/s^2 stay out
}

TEST(PredictedLoads, LetEffectsActOnlyByWhatIsKnown) {
  model::Vehicle bare = by_file();
  bare.beat_averaged->inputs.clear();
  bare.beat_averaged->actuators.clear();
  const std::string csv = csv_of(predicted(bare));
  const BeatAveragedPrediction with = flight(by_file(), csv), without = flight(bare, csv);
  const std::vector<VehicleHypothesis> a = candidates(by_file()), b = candidates(bare);
  const Rows plain = without.predict({&b[0]})[0];
  EXPECT_LT(difference(with.predict({&a[0]})[0], plain), 1e-12);
  EXPECT_EQ(difference(plain, without.predict({&b[4]})[0]), 0);
  EXPECT_EQ(difference(plain, without.predict({&b[5]})[0]), 0);
  EXPECT_GT(difference(plain, without.predict({&b[6]})[0]), 0.1);
  EXPECT_TRUE(without.inputs().empty());
  EXPECT_EQ(with.inputs().size(), 4U);
  // what is between inputs and wings is in the forces already
  VehicleHypothesis late = a[4];
  late.vehicle.effects["command_delay"] = {{"delay_s", 0.1}};
  EXPECT_EQ(difference(with.predict({&a[4]})[0], with.predict({&late})[0]), 0);
}

TEST(PredictedLoads, AreRefusedByTheirLine) {
  const auto refused = [](const std::function<void(Table&)>& change,
                          const std::function<void(model::Vehicle&)>& change_vehicle = {}) {
    model::Vehicle v = by_file();
    if (change_vehicle) change_vehicle(v);
    Table table = predicted(by_file());
    change(table);
    const std::string what = test::refusal([&] { flight(v, csv_of(table)); });
    const std::string file = (folder() / "predicted.csv").string();
    return what.starts_with(file) ? what.substr(file.size()) : what;
  };
  const auto renamed = [&](const std::string& from, const std::string& to) {
    return refused([&](Table& t) { *std::ranges::find(t.names, from) = to; });
  };
  EXPECT_EQ(refused([](Table&) {}), "accepted");
  EXPECT_EQ(
      renamed("d_yaw_Nm_moment_z_Nm", "d_yaw_moment_z_Nm"),
      ":1: d_yaw_moment_z_Nm: is neither a load nor its derivative by a coefficient of the vehicle's file; accepted: "
      "t_s, force_x_N, force_y_N, force_z_N, moment_x_Nm, moment_y_Nm, moment_z_Nm, or d_COEFFICIENT_ before one of "
      "these; did you mean \"d_yaw_Nm_moment_z_Nm\"?");
  EXPECT_EQ(
      renamed("d_yaw_Nm_moment_z_Nm", "d_lift_N_moment_z_Nm"),
      ":1: yaw_Nm: has no derivative by this coefficient of the vehicle's file, which cannot be fitted so; accepted: "
      "any of d_yaw_Nm_force_x_N to d_yaw_Nm_moment_z_Nm, or a vehicle's file without it");
  EXPECT_EQ(renamed("t_s", "force_x_mN").substr(0, 30), ": t_s: column is missing; colu");
  EXPECT_EQ(refused([](Table& t) { t.at("t_s")[5] = t.at("t_s")[4]; }),
            ":7: t_s: does not increase; accepted: more than 0.04");
  EXPECT_EQ(refused([](Table& t) {
              for (auto& c : t.columns) c.erase(c.begin() + 100, c.begin() + 119);
            }),
            ":102: t_s: is 0.2 s after the row before; accepted: rows at most 0.166667 s apart, for motion is "
            "compared up to 3 Hz");
  EXPECT_EQ(refused([](Table& t) { t.at("force_z_N")[7] = NAN; }),
            ":9:10: force_z_N: nan is not finite; accepted: a number");
  EXPECT_EQ(refused([](Table& t) {
              for (auto& c : t.columns) c.resize(900);
            }),
            ":901: t_s: is from 0 to 8.99 s, less than the flight; accepted: from 0 to 10 s");
  EXPECT_EQ(refused([](Table& t) {
              for (auto& c : t.columns) c.erase(c.begin(), c.begin() + 5);
            }),
            ":2: t_s: is from 0.05 to 10 s, less than the flight; accepted: from 0 to 10 s");
  EXPECT_EQ(refused([](Table& t) {
              for (auto& c : t.columns) c.resize(1);
            }),
            ": has 1 rows; accepted: 2 or more");
  const auto forces_alone = [](Table& t) {
    for (std::string& name : t.names)
      if (name.find("moment") != std::string::npos)
        name.replace(name.find("moment"), 6, "force"), name.erase(name.size() - 1);
    t.names.resize(4), t.columns.resize(4);
  };
  const auto without_coefficients = [](model::Vehicle& v) { v.beat_averaged->coefficients.clear(); };
  EXPECT_EQ(refused(forces_alone, without_coefficients).substr(0, 62),
            ":1: has no moment, but the vehicle's file compares moments; ac");
  EXPECT_EQ(refused(forces_alone,
                    [&](model::Vehicle& v) {
                      without_coefficients(v);
                      v.beat_averaged->compares_moments = false;
                    }),
            "accepted");
  EXPECT_EQ(refused([](Table& t) { t.names.resize(1), t.columns.resize(1); }, without_coefficients).substr(0, 24),
            ":1: has no load; accepte");
  std::filesystem::remove(folder() / "predicted.csv");
  EXPECT_EQ(test::refusal([] {
              BeatAveragedPrediction(folder(), log_of(), by_file());
            }).substr((folder() / "predicted.csv").string().size(), 65),
            ": is missing, but the vehicle's model is \"predicted\"; accepted: a");
}

}  // namespace
}  // namespace flappy::gap
