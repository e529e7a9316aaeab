#include "identify/gait_fit.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <numbers>

#include "refusal.hpp"

namespace flappy::identify::gait_fit_test {
namespace {

constexpr double kTurn = 2 * std::numbers::pi;

std::string file(const std::string& text) {
  const std::string path = testing::TempDir() + "gait.csv";
  std::ofstream(path) << text;
  return path;
}

/// `count` samples over `beats` beats from `from` on.
std::string beat(const std::string& header, int count, double beats, double from, const auto& row) {
  std::string text = header + "\n";
  char line[128];
  for (int i = 0; i < count; ++i) {
    const double t = from + beats * i / count;
    const auto [a, b] = row(t);
    std::snprintf(line, sizeof line, "%.12g,%.12g,%.12g\n", t, a, b);
    text += line;
  }
  return text;
}

std::pair<double, double> wing(double t) {
  return {0.1 + std::cos(kTurn * t) - 0.05 * std::sin(2 * kTurn * t),
          0.8 * std::sin(kTurn * t) + 0.1 * std::cos(3 * kTurn * t)};
}

std::string refused(const std::string& text, const GaitOptions& options = {}) {
  const std::string path = file(text), said = test::refusal([&] { fit_gait(path, options); });
  return said.substr(0, path.size()) == path ? said.substr(path.size()) : said;
}

TEST(GaitFit, FindsTheCoefficientsOfOneBeat) {
  GaitOptions o;
  o.harmonics = 3;
  const auto fitted = fit_gait(file(beat("beat,stroke_rad,right_rotation_rad", 50, 1, 0.3, wing)), o);
  ASSERT_EQ(fitted.size(), 2u);
  EXPECT_EQ(fitted[0].side + fitted[0].angle, "rightrotation");
  EXPECT_NEAR(fitted[0].sin_rad[0], 0.8, 1e-10);
  EXPECT_NEAR(fitted[0].cos_rad[2], 0.1, 1e-10);
  EXPECT_EQ(fitted[1].side + fitted[1].angle, "leftstroke");
  EXPECT_NEAR(fitted[1].mean_rad, 0.1, 1e-10);
  EXPECT_NEAR(fitted[1].cos_rad[0], 1, 1e-10);
  EXPECT_NEAR(fitted[1].sin_rad[1], -0.05, 1e-10);
  EXPECT_LT(fitted[1].rms_rad, 1e-10);
  EXPECT_EQ(
      gait_text({fitted[1]}),
      "[left.stroke]\nmode = \"driven\"\nmean_rad = 0.1\ncos_rad = [1.0, 0.0, 0.0]\nsin_rad = [0.0, -0.05, 0.0]\n\n");
}

TEST(GaitFit, TakesDegreesSecondsAndSeveralBeats) {
  GaitOptions o;
  o.harmonics = 3, o.frequency_Hz = 20;
  const auto in_degrees = [](double t) {
    const auto [a, b] = wing(20 * t);
    return std::pair(a * 360 / kTurn, b * 360 / kTurn);
  };
  const auto fitted = fit_gait(file(beat("t_s,stroke_deg,rotation_deg", 230, 0.21, 0, in_degrees)), o);
  EXPECT_NEAR(fitted[0].cos_rad[0], 1, 1e-10);
  EXPECT_NEAR(fitted[1].sin_rad[0], 0.8, 1e-10);
}

TEST(GaitFit, RefusesWhatIsNoGaitInOneLine) {
  const std::string names = "beat,stroke_rad,rotation_rad";
  EXPECT_EQ(refused(beat("t_s,stroke_rad,rotation_rad", 50, 1, 0, wing)),
            ": t_s: does not tell the beat's phase; accepted: --frequency-Hz, too, or a column beat");
  EXPECT_EQ(refused(beat(names, 50, 0.8, 0, wing)),
            ": a gap of 0.216 beats from 0.784 of the beat on; accepted: at most 0.0625 beats for 8 harmonics, or "
            "fewer of them");
  EXPECT_EQ(
      refused(beat(names, 60, 2, 0, [](double t) { return std::pair(std::cos(kTurn * 0.8 * t), 0.0); })).substr(0, 60),
      ": stroke_rad: does not repeat with the beat: 0.383 rad rms a");
  EXPECT_EQ(
      refused(beat(names, 50, 1, 0, [](double t) { return std::pair(70 * std::cos(kTurn * t), 0.0); })),
      ":2: stroke_rad: 70 rad (4.01e+03 degrees), the largest of the column, is beyond what a wing's angle may be; "
      "are these degrees?; accepted: at most 1.75 rad (100 degrees) either way, or a column ..._deg");
  EXPECT_EQ(refused(beat(names, 50, 1, 0, [](double t) { return std::pair(2 * std::cos(kTurn * t), 0.0); })),
            ":2: stroke_rad: 2 rad (115 degrees), the largest of the column, is beyond what a wing's angle may be; "
            "accepted: at most 1.75 rad (100 degrees) either way");
  // a stroke from 0 to -140 degrees, half a beat after its beginning
  EXPECT_EQ(refused(beat("beat,stroke_deg,rotation_deg", 1000, 1, 0,
                         [](double t) { return std::pair(-70 + 70 * std::cos(kTurn * t), 0.0); })),
            ":502: stroke_deg: -2.44 rad (-140 degrees), the largest of the column, is beyond what a wing's angle may "
            "be; accepted: at most 1.75 rad (100 degrees) either way");
  EXPECT_EQ(refused("beat,stroke_rad,rotation_rad\n0,0,0\n0.1,0,0\n0.05,0,0\n"),
            ":4: beat: does not increase; accepted: times in their order");
  EXPECT_EQ(refused(beat("beat,stroke_rad,speed_m_s", 50, 1, 0, wing)),
            ": speed_m_s: is no column of a gait; accepted: t_s, beat, and angles in _rad or _deg");
  EXPECT_EQ(refused(beat("beat,left_stroke_rad,rigth_stroke_rad", 50, 1, 0, wing)),
            ": rigth_stroke_rad: is no column of a gait; accepted: t_s, beat, and angles in _rad or _deg; did you mean "
            "\"right_stroke_rad\"?");
  EXPECT_EQ(refused(beat("beat,stroke_rad,left_stroke_rad", 50, 1, 0, wing)),
            ": stroke_rad: is of an angle that another column has; accepted: one column of an angle; without left_ or "
            "right_ it is left");
  GaitOptions many;
  many.harmonics = 17;
  EXPECT_EQ(refused("", many), "--harmonics: 17 of them; accepted: 1 to 16");
}

}  // namespace
}  // namespace flappy::identify::gait_fit_test
