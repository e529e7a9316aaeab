#include "identify/kinematics.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "refusal.hpp"
#include "vehicles.hpp"

namespace flappy::identify {
namespace {

const sim::Input kInput{10, 0, 0, 0};

/// Wings of the identified vehicle at 5,000 frames/s, on a camera whose clock started `late_s` after the beat did.
WingSamples filmed(double late_s, int frames) {
  const model::Vehicle v = test::identified();
  auto batch = welded_batch<double>(std::span(&v, 1), std::span(&kInput, 1), {.threads = 1});
  batch.step(5000);
  WingSamples s{"wings", {}, {}, {}};
  for (int i = 1; i <= frames; ++i) {
    batch.step(2);
    const sim::FlapperState x = batch.state(0);
    s.t_s.push_back((5000 + 2 * i) * kStep_s - late_s);
    const std::array<double, 4> now = {x.stroke_rad[0], x.rotation_rad[0], x.stroke_rad[1], x.rotation_rad[1]};
    for (std::size_t a = 0; a < 4; ++a) s.angles_rad[a].push_back(now[a]);
  }
  return s;
}

TEST(Kinematics, FindsThePhaseOfTheCamera) {
  const double late_s = 0.0071;
  const WingComparison c = compare_wings(test::identified(), kInput, filmed(late_s, 2500));
  const double expected = std::remainder(2 * std::numbers::pi * 34 * late_s, 2 * std::numbers::pi);
  EXPECT_NEAR(c.shift_rad, expected, 1e-6);
  for (const AngleComparison& a : c.angles) {
    EXPECT_NEAR(a.measured.amplitude_rad, a.simulated.amplitude_rad, 1e-4);
    EXPECT_NEAR(a.phase_rad, 0, 1e-4);
    // beats at 1 ms holds differ from each other, rotations have corners: twenty harmonics leave 0.01 rad at most
    EXPECT_LT(a.rms_rad, 0.01);
  }
  // DART: 64.4 deg at 10 V for the nominal vehicle, 2 % lower in amplitude at 100 us than converged (65.97 deg)
  const WingComparison nominal = compare_wings(test::nominal(), kInput, filmed(0, 2500));
  EXPECT_NEAR(nominal.angles[0].simulated.amplitude_rad * 180 / std::numbers::pi, 65.97, 0.3);
}

TEST(Kinematics, MeasuresWhatDiffers) {
  WingSamples s = filmed(0, 2500);
  for (double& x : s.angles_rad[0]) x = 0.9 * x + 0.05;
  const WingComparison c = compare_wings(test::identified(), kInput, s);
  const AngleComparison& left = c.angles[0];
  EXPECT_NEAR(left.measured.amplitude_rad, 0.9 * left.simulated.amplitude_rad, 1e-4);
  EXPECT_NEAR(left.measured.bias_rad, 0.9 * left.simulated.bias_rad + 0.05, 1e-4);
  // a tenth of a stroke that is nearly a sine, and the shift
  EXPECT_NEAR(left.rms_rad, std::hypot(0.1 * left.simulated.amplitude_rad / std::sqrt(2.0), 0.05), 0.01);
  EXPECT_LT(left.scatter_rad, 0.01);
  EXPECT_LT(c.angles[2].rms_rad, 0.01);
}

TEST(Kinematics, Refuses) {
  const auto refused = [](const WingSamples& s) {
    return test::refusal([&] { compare_wings(test::identified(), kInput, s); });
  };
  EXPECT_EQ(refused(filmed(0, 100)), "wings: lasts 19.8 ms; accepted: at least one beat, 29.4 ms");
  WingSamples half = filmed(0, 2500), gap{"wings", {}, {}, {}};
  for (std::size_t i = 0; i < half.t_s.size(); ++i)
    if (std::fmod(half.t_s[i] * 34, 1) < 0.5) {
      gap.t_s.push_back(half.t_s[i]);
      for (std::size_t a = 0; a < 4; ++a) gap.angles_rad[a].push_back(half.angles_rad[a][i]);
    }
  EXPECT_EQ(refused(gap),
            "wings: leaves parts of the beat without samples; accepted: at least 12 samples all over the beat");
  model::Vehicle apart = test::identified();
  apart.left.spring.stiffness_positive_Nm_rad = apart.left.spring.stiffness_negative_Nm_rad = 1e5;
  EXPECT_TRUE(test::refusal([&] {
                compare_wings(apart, kInput, half);
              }).starts_with(apart.name + ": the vehicle comes apart at ("));
}

}  // namespace
}  // namespace flappy::identify
