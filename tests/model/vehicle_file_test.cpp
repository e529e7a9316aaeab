// The shipped vehicles hold the published figures, text and vehicle are one, and a broken file is refused by
// name and place.
#include "flappy/vehicle_file.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>

#include "io/files.hpp"
#include "model/derive.hpp"
#include "model/effects/registry.hpp"
#include "model/posterior.hpp"
#include "vehicles.hpp"

namespace flappy::model::vehicle_file_test {
namespace {

using Figures = std::map<std::string, double>;

std::string known_effects() {
  std::string list;
  for (const CatalogueEffect& e : effects()) list += (list.empty() ? "" : ", ") + std::string(e.info.id);
  return list;
}

// ---- the published figures, typed from the paper, the URDF and the configuration of the published simulator

void body(Figures& f, const std::string& path, double mass_g, Triple com_mm, InertiaTensor g_mm2) {
  f[path + ".mass_kg"] = mass_g * 1e-3;
  f[path + ".com_m.x"] = com_mm.x * 1e-3, f[path + ".com_m.y"] = com_mm.y * 1e-3;
  f[path + ".com_m.z"] = com_mm.z * 1e-3;
  const std::string inertia = path + ".inertia_kg_m2.";
  f[inertia + "xx"] = g_mm2.xx * 1e-9, f[inertia + "yy"] = g_mm2.yy * 1e-9, f[inertia + "zz"] = g_mm2.zz * 1e-9;
  f[inertia + "xy"] = g_mm2.xy * 1e-9, f[inertia + "yz"] = g_mm2.yz * 1e-9, f[inertia + "xz"] = g_mm2.xz * 1e-9;
}

Figures published() {
  Figures f = {{"air.density_kg_m3", 1.18009482370369},
               {"driver.flapping_Hz", 34},
               {"driver.hold_s", 1e-3},
               {"driver.amplitude_limit_V", 18},
               {"driver.difference_limit_V", 3},
               {"driver.bias_limit_V", 3.5},
               {"driver.split_cycle_limit", 0.15},
               {"extent.below_m", 0},
               {"extent.above_m", 18.9913e-3},   // the stroke plane
               {"extent.around_m", 0.168 / 2}};  // half of the span
  body(f, "torso", 10.9067, {0.1797, 0.0008, -1.3998}, {4238.1285, 3970.1646, 2440.9505, -76.8896, 0.3011, 16.5500});
  // the right leading edge is the left one mirrored in y, the right wing the left one turned by 180 deg about
  // z
  body(f, "left.leading_edge", 0.7081, {-0.2837, 3.3023, -6.3984},
       {132.8411, 47.7258, 90.6904, -0.0416, 12.5149, -0.4990});
  body(f, "right.leading_edge", 0.7081, {-0.2837, -3.3023, -6.3984},
       {132.8411, 47.7258, 90.6904, 0.0416, -12.5149, -0.4990});
  body(f, "left.wing", 0.0626, {0.0024, 37.3242, -9.8917}, {21.4402, 2.2204, 19.2209, 0, 0.1968, -0.0001});
  body(f, "right.wing", 0.0626, {-0.0024, -37.3242, -9.8917}, {21.4402, 2.2204, 19.2209, 0, -0.1968, 0.0001});
  const Figures either = {{"shoulder_m.x", 0},
                          {"shoulder_m.z", 18.9913e-3},
                          {"stroke.lower_rad", -1.63},
                          {"stroke.upper_rad", 1.63},
                          {"stroke.damping_Nm_s", 8e-9},
                          {"stroke.friction_Nm", 1e-9},
                          {"rotation.lower_rad", -0.7854},
                          {"rotation.upper_rad", 0.7854},
                          {"rotation.damping_Nm_s", 1e-9},
                          {"rotation.friction_Nm", 1e-8},
                          {"motor.resistance_ohm", 12.4},
                          {"motor.torque_constant_Nm_A", 1.75e-3},
                          {"motor.gear_ratio", 10},
                          {"motor.efficiency", 0.9},
                          {"motor.friction_Nm", 2e-5},
                          {"motor.damping_Nm_s", 9.74e-9},
                          {"motor.rotor_inertia_kg_m2", 7.03e-10},
                          {"motor.rotor_spin_sense", 0},
                          {"motor.voltage_limit_V", 18},
                          {"spring.stiffness_positive_Nm_rad", 0.013384289},
                          {"spring.stiffness_negative_Nm_rad", 0.013384289},
                          {"spring.rest_angle_rad", 0},
                          {"planform.wing_length_m", 0.07},
                          {"planform.mean_chord_m", 0.021212121212121},
                          {"planform.r33", 0.205833311654341},
                          {"planform.r22", 0.284203623407408},
                          {"planform.r11", 0.450820740740741},
                          {"planform.r00", 0.999407407407407},
                          {"planform.z_cp2", 0.246352600140835},
                          {"planform.z_cp1", 0.415846717980795},
                          {"planform.z_cp0", 1.028078968449933},
                          {"planform.z_rd", 1.174547978303502},
                          {"planform.rotational_damping_coefficient", 5}};
  for (const auto& [path, value] : either) f["left." + path] = f["right." + path] = value;
  f["left.shoulder_m.y"] = 13.95e-3;
  f["right.shoulder_m.y"] = -13.95e-3;
  return f;
}

Figures published_identified() {
  Figures f = published();
  const Figures trim = {{"left.motor.resistance_ohm", 14.780065776},
                        {"right.motor.resistance_ohm", 13.763265084},
                        {"left.spring.stiffness_positive_Nm_rad", 0.0133599752},
                        {"left.spring.stiffness_negative_Nm_rad", 0.0133599752},
                        {"right.spring.stiffness_positive_Nm_rad", 0.0133},
                        {"right.spring.stiffness_negative_Nm_rad", 0.0133},
                        {"left.spring.rest_angle_rad", 0.0403463879},
                        {"right.spring.rest_angle_rad", 0.0319281979},
                        {"left.rotation.lower_rad", -0.844856704},
                        {"left.rotation.upper_rad", 0.765164977},
                        {"right.rotation.lower_rad", -0.854799666},
                        {"right.rotation.upper_rad", 0.814000120}};
  for (const auto& [path, value] : trim) f.at(path) = value;
  return f;
}

void expect_figures(Vehicle vehicle, const Figures& figures) {
  const std::vector<Parameter> list = parameters(vehicle);
  EXPECT_EQ(list.size(), figures.size());
  for (const Parameter& p : list) {
    ASSERT_TRUE(figures.contains(p.path)) << p.path;
    EXPECT_DOUBLE_EQ(*p.value, figures.at(p.path)) << p.path;
  }
}

TEST(ShippedVehicles, HoldThePublishedFigures) {
  EXPECT_EQ(test::nominal().name, "hummingbird_nominal");
  EXPECT_EQ(test::identified().name, "hummingbird_identified");
  expect_figures(test::nominal(), published());
  expect_figures(test::identified(), published_identified());
  EXPECT_TRUE(test::nominal().effects.empty());
  EXPECT_TRUE(test::identified().effects.empty());
}

TEST(ShippedVehicles, WeighWhatIsPublished) {
  EXPECT_NEAR(total_mass_kg(test::nominal()), 12.448e-3, 0.5e-6);  // published to the milligram
  EXPECT_EQ(total_mass_kg(test::identified()), total_mass_kg(test::nominal()));
}

TEST(ShippedVehicles, AreMirrorImagesWhereNominal) {
  Vehicle v = test::nominal();
  std::map<std::string, double*> at;
  for (const Parameter& p : parameters(v)) at[p.path] = p.value;
  for (const auto& [path, value] : at) {
    if (!path.starts_with("left.")) continue;
    const bool wing = path.starts_with("left.wing.");
    const auto ends = [&path = path](const char* end) { return path.ends_with(end); };
    const bool flips = wing ? ends("com_m.x") || ends("com_m.y") || ends(".yz") || ends(".xz")
                            : ends("_m.y") || ends(".xy") || ends(".yz");
    EXPECT_EQ(*value, (flips ? -1 : 1) * *at.at("right" + path.substr(4))) << path;
  }
}

// ---- text and vehicle

/// A file of its own for each process, gone with the test.
class VehicleFile : public testing::Test {
 protected:
  VehicleFile() { std::filesystem::create_directories(folder_); }
  ~VehicleFile() override { std::filesystem::remove_all(folder_); }

  Vehicle read(const std::string& text, const std::vector<std::string>& overrides = {}) {
    std::ofstream(folder_ / "v.toml") << text;
    return read_vehicle(folder_ / "v.toml", overrides);
  }
  /// What a person sees, "accepted" where nothing is wrong. A ^ in the text, which the file does not get,
  /// marks a place: its file, line and column become ^ in the message.
  std::string message(std::string text, const std::vector<std::string>& overrides = {}) {
    const std::string file = (folder_ / "v.toml").string();
    std::string place = file;
    if (const std::size_t mark = text.find('^'); mark != std::string::npos) {
      text.erase(mark, 1);
      const auto line = 1 + std::count(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(mark), '\n');
      const std::size_t before = mark == 0 ? std::string::npos : text.rfind('\n', mark - 1);
      place += ":" + std::to_string(line) + ":" + std::to_string(mark - before);  // npos counts as -1
    }
    try {
      read(text, overrides);
      return "accepted";
    } catch (const io::InputError& e) {
      std::string line = e.what();
      const std::size_t at = line.find(place + ": ");
      return at == std::string::npos ? line : line.replace(at, place.size(), "^");
    }
  }
  /// The message for the nominal vehicle's file with `old` replaced where it first stands in `section`.
  std::string edited(const std::string& section, const std::string& old, const std::string& replacement) {
    std::string text = nominal_text();
    const std::size_t from = text.find(section), place = text.find(old, from);
    EXPECT_NE(place, std::string::npos) << section << " " << old;
    return message(text.replace(place, old.size(), replacement));
  }
  std::string with(const std::string& lines) { return message(nominal_text() + lines); }

  static std::string nominal_text() {
    return io::read_text(test::source_path("configs/vehicles/hummingbird_nominal.toml"));
  }

 private:
  std::filesystem::path folder_ = std::filesystem::temp_directory_path() / "flappy_vehicle";
};

void expect_same(Vehicle a, Vehicle b) {
  EXPECT_EQ(a.name, b.name);
  const std::vector<Parameter> p = parameters(a), q = parameters(b);
  for (std::size_t i = 0; i < p.size(); ++i) EXPECT_EQ(*p[i].value, *q[i].value) << p[i].path;
  EXPECT_EQ(a.effects, b.effects);
}

TEST_F(VehicleFile, TextReadsBackToTheSameVehicle) {
  expect_same(read(vehicle_text(test::nominal())), test::nominal());
  Vehicle odd = test::identified();
  odd.name = "a \"quoted\" back\\slash, a\ttab and a line\nbreak";
  odd.torso.mass_kg = 0.1 + 0.2;  // 17 digits
  odd.left.spring.rest_angle_rad = -5e-324;
  odd.right.motor.resistance_ohm = 1e4;
  odd.effects["body_drag"] = {{"drag_area_m2", 1.0 / 300}, {"centre_z_m", -0.01}};
  odd.effects["ground_effect"] = {{"gain", 0}, {"length_m", 0.05}};
  expect_same(read(vehicle_text(odd)), odd);
}

TEST_F(VehicleFile, TextKeepsAnEffectOfTypicalSize) {
  Vehicle v = test::nominal();
  v.effects["ground_effect"] = {};
  const Figures typical = {{"gain", 0.15}, {"length_m", 0.06}};
  EXPECT_EQ(read(vehicle_text(v)).effects.at("ground_effect"), typical);
}

TEST_F(VehicleFile, MayLeaveOutTheRotorsSpin) {
  EXPECT_EQ(nominal_text().find("rotor_spin_sense ="), std::string::npos);
  EXPECT_EQ(vehicle_text(test::nominal()).find("rotor_spin_sense"), std::string::npos);
  const Vehicle v = read(nominal_text(), {"right.motor.rotor_spin_sense=-1"});
  EXPECT_EQ(v.left.motor.rotor_spin_sense, 0);
  EXPECT_EQ(read(vehicle_text(v)).right.motor.rotor_spin_sense, -1);
  EXPECT_EQ(message(nominal_text(), {"left.motor.rotor_spin_sense=10"}),
            "--set left.motor.rotor_spin_sense=10: left.motor.rotor_spin_sense: 10 is out of range; "
            "accepted: a number from -1 to 1");
}

TEST_F(VehicleFile, TakesOverrides) {
  const Vehicle v = read(nominal_text(), {"left.motor.resistance_ohm=14", "effects.body_drag.centre_z_m=0.01"});
  EXPECT_EQ(v.left.motor.resistance_ohm, 14);
  EXPECT_EQ(v.right.motor.resistance_ohm, 12.4);
  EXPECT_EQ(v.effects.at("body_drag").at("centre_z_m"), 0.01);
  EXPECT_EQ(message(nominal_text(), {"left.motor.resistance_ohm=-1"}),
            "--set left.motor.resistance_ohm=-1: left.motor.resistance_ohm: -1 is out of range; "
            "accepted: a number from 0.001 to 10000");
  EXPECT_EQ(message(nominal_text(), {"left.motor.resistence_ohm=14"}),
            "--set left.motor.resistence_ohm=14: left.motor.resistence_ohm: unknown key; accepted: damping_Nm_s, "
            "efficiency, friction_Nm, gear_ratio, resistance_ohm, rotor_inertia_kg_m2, rotor_spin_sense, "
            "torque_constant_Nm_A, "
            "voltage_limit_V; did you mean \"resistance_ohm\"?");
}

// ---- the posterior

std::string posterior(const std::string& names, const std::string& means, const std::string& covariance) {
  return "\n[posterior]\nnames = " + names + "\nmeans = " + means + "\ncovariance = " + covariance + "\n";
}
const std::string kTwo = "[\"torso.mass_kg\", \"left.motor.resistance_ohm\"]";

TEST_F(VehicleFile, TextKeepsThePosterior) {
  Vehicle v = test::identified();
  v.effects["ground_effect"] = {{"gain", 0.2}, {"length_m", 0.05}};
  EXPECT_EQ(read(vehicle_text(v)).posterior, std::nullopt);
  v.posterior = {{"torso.mass_kg", "left.motor.resistance_ohm", "effects.ground_effect.gain"},
                 {0.0109, 0.1 + 12.2, 1.0 / 3},
                 {{1e-7 / 3, 1e-5, 0}, {1e-5, 0.1, -0.01}, {0, -0.01, 0.0025}}};
  const Vehicle back = read(vehicle_text(v));
  EXPECT_EQ(back.posterior, v.posterior);
  expect_same(back, v);
}

TEST_F(VehicleFile, TextKeepsPointsOfContact) {
  Vehicle v = test::nominal();
  v.contact = {{"foot", ContactPoint::Body::torso, {0.01, -0.02, -0.03}, 150, 0.5, 0.6, 0.3},
               {"tip", ContactPoint::Body::right_wing, {0, -0.07, -0.01}, 20, 0, 0.1, 0}};
  const Vehicle back = read(vehicle_text(v));
  ASSERT_EQ(back.contact.size(), 2u);
  EXPECT_EQ(back.contact[1].name, "tip");
  EXPECT_EQ(back.contact[1].on, ContactPoint::Body::right_wing);
  expect_same(back, v);
  EXPECT_EQ(vehicle_text(v).find("contact.tip.grasp_m_s"), std::string::npos);
}

TEST_F(VehicleFile, RefusesWhatIsNoPointOfContact) {
  const auto point = [](const std::string& name, const std::string& more = "") {
    return "\n[contact." + name +
           "]\non = \"torso\"\nposition_m = { x = 0.0, y = 0.0, z = 0.0 }\nstiffness_N_m = 100.0\n" +
           "damping_s_m = 0.5\n" + (more.empty() ? "friction = 0.6\n" : more);
  };
  EXPECT_EQ(with(point("foot")), "accepted");
  EXPECT_EQ(with(point("foot", "^friction_N = 0.6\n")).substr(0, 40), "^: contact.foot.friction_N: unknown key;");
  EXPECT_NE(with(point("\"left foot\"")).find("is no name of a point; accepted: letters"), std::string::npos);
  EXPECT_NE(with("\n[contact]\n").find("contact: has no point; accepted: 1 to 16 tables [contact.NAME]"),
            std::string::npos);
  std::string many;
  for (int i = 0; i < 17; ++i) many += point("p" + std::to_string(i));
  EXPECT_NE(with(many).find("contact: has too many points; accepted: 1 to 16"), std::string::npos);
  // of a robot that is known by the beat there is nothing to touch with
  std::string text = io::read_text(test::source_path("configs/vehicles/flapper_nimble.toml")) + point("foot");
  const std::filesystem::path file = std::filesystem::temp_directory_path() / "flappy_contact";
  std::ofstream(file) << text;
  try {
    read_any_vehicle(file);
    ADD_FAILURE() << "accepted";
  } catch (const std::runtime_error& e) {
    EXPECT_NE(std::string(e.what()).find("contact: is given, but only a vehicle of wings and motors"),
              std::string::npos)
        << e.what();
  }
  std::filesystem::remove(file);
}

TEST_F(VehicleFile, RefusesWhatIsNoPosterior) {
  const std::string means = "[0.011, 12.0]", fine = "[[1e-8, 1e-5], [1e-5, 0.04]]";
  EXPECT_EQ(with(posterior(kTwo, means, fine)), "accepted");
  EXPECT_EQ(
      with(posterior("^[\"torso.mass_kg\", \"left.motor.resistence_ohm\"]", means, fine)),
      "^: posterior.names: no parameter \"left.motor.resistence_ohm\"; accepted: paths of this file; did you mean "
      "\"left.motor.resistance_ohm\"?");
  EXPECT_EQ(with(posterior("^[\"torso.mass_kg\", \"effects.ground_effect.gain\"]", means, fine)).substr(0, 68),
            "^: posterior.names: no parameter \"effects.ground_effect.gain\"; accep");  // an effect it does not have
  EXPECT_EQ(with(posterior("^[\"torso.mass_kg\", \"torso.mass_kg\"]", "[0.011, 0.011]", fine)),
            "^: posterior.names: torso.mass_kg is given twice; accepted: each parameter once");
  EXPECT_EQ(
      with(posterior("^[\"driver.hold_s\"]", "[0.001]", "[[0.0]]")),
      "^: posterior.names: driver.hold_s is the same for a whole batch; accepted: what may differ from flapper to "
      "flapper");
  EXPECT_EQ(with(posterior("^[]", "[]", "[]")), "^: posterior.names: is empty; accepted: paths of this file");
  EXPECT_EQ(with(posterior(kTwo, "^[0.011]", fine)).substr(0, 20), "^: posterior.means: ");
  EXPECT_EQ(with(posterior(kTwo, "^[0.011, -12.0]", fine)),
            "^: posterior.means: left.motor.resistance_ohm: -12.0 is out of range; accepted: a number from 0.001 to "
            "10000.0");
  EXPECT_EQ(with(posterior(kTwo, means, "^[[1e-8, 1e-5]]")),
            "^: posterior.covariance: has 1 rows; accepted: 2 rows of 2 numbers, as many as names");
  EXPECT_NE(with(posterior(kTwo, means, "[[1e-8, 1e-5], [1e-5]]")), "accepted");
  EXPECT_EQ(
      with(posterior(kTwo, means, "^[[1e-8, 1e-5], [1.1e-5, 0.04]]")),
      "^: posterior.covariance: is not symmetric: of left.motor.resistance_ohm and torso.mass_kg; accepted: the same "
      "number on both sides of the diagonal");
  const std::string none =
      "^: posterior.covariance: is not positive semidefinite; accepted: variances of 0 or more, and correlations that "
      "can "
      "be together";
  EXPECT_EQ(with(posterior(kTwo, means, "^[[1e-8, 2.1e-5], [2.1e-5, 0.04]]")), none);   // a correlation of 1.05
  EXPECT_EQ(with(posterior(kTwo, means, "[[1e-8, 2e-5], [2e-5, 0.04]]")), "accepted");  // of 1
  EXPECT_EQ(with(posterior(kTwo, means, "^[[-1e-8, 0], [0, 0.04]]")), none);
  EXPECT_EQ(with(posterior(kTwo, means, "^[[0, 1e-5], [1e-5, 0.04]]")), none);
  EXPECT_EQ(with(posterior(kTwo, means, "[[0, 0], [0, 0.04]]")), "accepted");
  EXPECT_NE(with(posterior(kTwo, means, fine) + "sd = 1\n"), "accepted");
}

// Two springs that one coordinate moves together, a mass that another scales, and an effect at the end of its range.
TEST(Posterior, OfAFitIsThatOfItsParameters) {
  const Vehicle nominal = test::nominal();
  const double stiffness = nominal.left.spring.stiffness_positive_Nm_rad, mass = nominal.torso.mass_kg;
  const auto vehicle_of = [&](const std::vector<double>& x) {
    Vehicle v = nominal;
    v.left.spring.stiffness_positive_Nm_rad = v.left.spring.stiffness_negative_Nm_rad = stiffness * (1 + 0.1 * x[0]);
    v.torso.mass_kg = mass * (1 + 0.2 * x[1]);
    v.effects["ground_effect"] = {{"gain", std::max(0.0, 0.3 * x[2])}, {"length_m", 0.05}};
    return v;
  };
  const Posterior p =
      posterior_of(vehicle_of, {0.5, -1, 0, 7}, {{0.04, 0.03, 0, 0}, {0.03, 0.09, 0, 0}, {0, 0, 1, 0}, {0, 0, 0, 1}});
  EXPECT_EQ(p.names, (std::vector<std::string>{"torso.mass_kg", "left.spring.stiffness_positive_Nm_rad",
                                               "left.spring.stiffness_negative_Nm_rad", "effects.ground_effect.gain"}));
  EXPECT_EQ(p.means, (std::vector<double>{mass * 0.8, stiffness * 1.05, stiffness * 1.05, 0}));
  const double s[] = {0.2 * mass, 0.1 * stiffness, 0.1 * stiffness, 0.3};
  const double c[4][4] = {{0.09, 0.03, 0.03, 0}, {0.03, 0.04, 0.04, 0}, {0.03, 0.04, 0.04, 0}, {0, 0, 0, 1}};
  for (std::size_t i = 0; i < 4; ++i)
    for (std::size_t j = 0; j < 4; ++j)  // differences of numbers of this size, five times
      EXPECT_NEAR(p.covariance[i][j], s[i] * s[j] * c[i][j], 1e-13 * s[i] * s[j]);
  EXPECT_TRUE(lower_factor(p)) << "though two of its rows are one";
}

// ---- what is refused

TEST_F(VehicleFile, RefusesFiguresOutOfRange) {
  EXPECT_EQ(edited("[torso]", "10.9067e-3", "^-10.9067e-3"),
            "^: torso.mass_kg: -0.0109067 is out of range; accepted: a number from 1e-09 to 10");
  EXPECT_EQ(edited("[torso]", "10.9067e-3", "^0"),
            "^: torso.mass_kg: 0 is out of range; accepted: a number from 1e-09 to 10");
  EXPECT_EQ(edited("[torso]", "10.9067e-3", "^nan"),
            "^: torso.mass_kg: nan is not finite; accepted: a number from 1e-09 to 10");
  EXPECT_EQ(edited("[left.stroke]", "upper_rad = 1.63", "upper_rad = ^-1.7"),  // below its lower stop
            "^: left.stroke.upper_rad: -1.7 is out of range; accepted: a number from 0 to 1.75");
  EXPECT_EQ(edited("[left.stroke]", "lower_rad = -1.63", "lower_rad = ^0.1"),
            "^: left.stroke.lower_rad: 0.1 is out of range; accepted: a number from -1.75 to 0");
  EXPECT_EQ(edited("[right.motor]", "efficiency = 0.9", "efficiency = ^1.1"),
            "^: right.motor.efficiency: 1.1 is out of range; accepted: a number from 0.001 to 1");
}

TEST_F(VehicleFile, RefusesAnInertiaOfNoBody) {
  const auto refused = [](const std::string& body, const std::string& why) {
    return "^: " + body + ".inertia_kg_m2: no rigid body has this inertia: its " + why +
           "; accepted: positive principal moments, none above the sum of the other two, but for 0.01 % of rounding";
  };
  // a flat plate is at the limit: 2.2204 + 19.2209 and a little from its small product of inertia, and 1e-4 of it for rounding
  EXPECT_EQ(edited("[left.wing]", "{ xx = 21.4402e-9", "^{ xx = 21.4440e-9"),
            refused("left.wing", "largest principal moment exceeds the sum of the other two by 0.0126 % of it"));
  EXPECT_EQ(edited("[left.wing]", "{ xx = 21.4402e-9", "{ xx = 21.4430e-9"), "accepted");
  // a negative principal moment
  EXPECT_EQ(edited("[torso]", "{ xx = 4238.1285e-9", "^{ xx = 1e-15"),
            refused("torso", "smallest principal moment is -1.601e-09"));
}

// The slips of a right side that was copied from the left, and of g mm^2 in place of kg m^2.
TEST_F(VehicleFile, RefusesASideThatIsNoMirrorImage) {
  const std::string accepted =
      "; accepted: y to the left of B: on the right, shoulder_m.y and com_m.y, inertia xy and yz have the other sign";
  EXPECT_EQ(edited("[right]", "y = -13.95e-3", "y = ^13.96e-3"),
            "^: right.shoulder_m.y: the right shoulder is not right of the left one" + accepted);
  EXPECT_EQ(edited("[right]", "y = -13.95e-3", "y = ^13.95e-3"),
            "^: right.shoulder_m.y: the right shoulder is not right of the left one" + accepted);
  EXPECT_EQ(edited("[right.wing]", "y = -37.3242e-3", "y = ^37.3242e-3"),
            "^: right.wing.com_m.y: is on the other side of the hinge than the wing" + accepted);
  EXPECT_EQ(edited("[right.leading_edge]", "y = -3.3023e-3", "y = ^3.3023e-3"),
            "^: right.leading_edge.com_m.y: is on the same side of its hinge as on the left" + accepted);
  EXPECT_EQ(edited("[right.wing]", "yz = -0.1968e-9", "yz = ^0.1968e-9"),
            "^: right.wing.inertia_kg_m2.yz: is that of the left, not mirrored" + accepted);
}

TEST_F(VehicleFile, RefusesAnInertiaThatReachesOutOfTheVehicle) {
  // sqrt(0.0042381285 / 0.0109067) m; the extent is hypot(84, 18.9913) mm, and 0.0109067 times its square the limit
  EXPECT_EQ(
      edited("[torso]", "inertia_kg_m2 = { xx = 4238.1285e-9, yy = 3970.1646e-9, zz = 2440.9505e-9",
             "inertia_kg_m2 = ^{ xx = 4238.1285e-6, yy = 3970.1646e-6, zz = 2440.9505e-6"),
      "^: torso.inertia_kg_m2: needs mass 0.623 m from the centre of mass, and extent ends at 0.0861 m; is it in g "
      "mm^2, which are 1e-9 kg m^2?; accepted: moments of at most 8.09e-05 kg m^2, mass times that squared");
  EXPECT_EQ(
      edited("[left.wing]", "inertia_kg_m2 = { xx = 21.4402e-9, yy = 2.2204e-9, zz = 19.2209e-9",
             "inertia_kg_m2 = ^{ xx = 21.4402e-6, yy = 2.2204e-6, zz = 19.2209e-6"),
      "^: left.wing.inertia_kg_m2: needs mass 0.585 m from the centre of mass, and the wing ends at 0.07 m; is it "
      "in g mm^2, which are 1e-9 kg m^2?; accepted: moments of at most 3.07e-07 kg m^2, mass times that squared");
}

TEST_F(VehicleFile, RefusesWhatIsNoVehicle) {
  EXPECT_EQ(edited("", "schema = 1", "schema = ^2"),
            "^: schema: 2 is read by a newer flappy than this one; accepted: 1");
  EXPECT_EQ(edited("", "schema = 1\n", ""), "^: schema: is missing; accepted: 1");
  EXPECT_EQ(edited("", "name = \"hummingbird_nominal\"", ""), "^: name: is missing; accepted: a string");
  EXPECT_EQ(edited("[left.motor]", "resistance_ohm = 12.4", "resistance_ohm = ^\"12.4\""),
            "^: left.motor.resistance_ohm: is a string; accepted: a number from 0.001 to 10000");
  EXPECT_EQ(edited("", "[air]\ndensity_kg_m3 =", "^[air]\npressure_Pa ="),
            "^: air.density_kg_m3: is missing; accepted: a number from 0 to 100");
  EXPECT_EQ(edited("[torso]", "mass_kg = 10.9067e-3", "^mass_g = 10.9067"),
            "^: torso.mass_g: unknown key; accepted here with another unit: \"mass_kg\"");
  EXPECT_EQ(
      edited("", "[air]", "[^wind]\nspeed_m_s = 1.0\n\n[air]"),
      "^: wind: unknown key; accepted: air, contact, driver, effects, extent, left, model, name, posterior, right, "
      "schema, torso");
  EXPECT_EQ(edited("[left.motor]", "gear_ratio = 10.0", "gear_ratio = 10.0\ngear_ratio = ^10.0"),
            "^: not valid TOML: Error while parsing key-value pair: cannot redefine existing floating-point "
            "'gear_ratio'");
}

TEST_F(VehicleFile, RefusesTruncatedFiles) {
  const std::string text = nominal_text(), start = text.substr(0, text.find("[torso]"));
  EXPECT_EQ(message(start + "[torso^"), "^: not valid TOML: Error while parsing table header: encountered end-of-file");
  EXPECT_EQ(message(start), "^: torso.mass_kg: is missing; accepted: a number from 1e-09 to 10");
  // wherever it is cut, no figure is guessed: only the last line's end may go
  for (std::size_t length = 0; length + 2 < text.size(); length += 101)
    EXPECT_NE(message(text.substr(0, length)), "accepted") << length;
}

TEST_F(VehicleFile, FillsInEffects) {
  const Vehicle v = read(nominal_text() + "[effects.body_drag]\ndrag_area_m2 = 0.002\n[effects.ground_effect]\n");
  const std::map<std::string, Figures> expected = {{"body_drag", {{"drag_area_m2", 0.002}, {"centre_z_m", 0}}},
                                                   {"ground_effect", {{"gain", 0.15}, {"length_m", 0.06}}}};
  EXPECT_EQ(v.effects, expected);
  for (const CatalogueEffect& e : effects())
    for (const EffectParameter& p : e.parameters) {
      EXPECT_LE(p.low, p.typical) << p.name;
      EXPECT_LE(p.typical, p.high) << p.name;
    }
}

TEST_F(VehicleFile, RefusesEffectsThatDoNotExist) {
  EXPECT_EQ(with("^[effects.body_drug]\n"), "^: effects.body_drug: unknown effect; accepted: " + known_effects() +
                                                "; did you mean "
                                                "\"body_drag\"?");
  EXPECT_EQ(with("^[effects.wing_flutter]\n"), "^: effects.wing_flutter: unknown effect; accepted: " + known_effects());
  EXPECT_EQ(with("[effects.body_drag]\n^drag_area_cm2 = 15.0\n"),
            "^: effects.body_drag.drag_area_cm2: unknown key; accepted here with another unit: "
            "\"drag_area_m2\"");
  EXPECT_EQ(with("[effects.body_drag]\n^drag_aera_m2 = 0.002\n"),
            "^: effects.body_drag.drag_aera_m2: unknown key; accepted: centre_z_m, drag_area_m2; did you mean "
            "\"drag_area_m2\"?");
  EXPECT_EQ(with("[effects.ground_effect]\ngain = ^1.5\n"),
            "^: effects.ground_effect.gain: 1.5 is out of range; accepted: a number from 0 to 1");
  EXPECT_EQ(with("[effects]\nbody_drag = ^0.002\n"),
            "^: effects.body_drag: is a floating-point number; accepted: a table");
}

}  // namespace
}  // namespace flappy::model::vehicle_file_test
