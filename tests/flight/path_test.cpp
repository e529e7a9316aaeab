// Paths: from rest to rest, splines through points of a file, and lanes that are each at a place of their own.
#include "flight/path.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <fstream>

#include "flight/fleets.hpp"
#include "sim/lanes.hpp"

namespace flappy::flight::path_test {
namespace {

constexpr double kTick_s = 0.002;
using One = model::Lanes<double, 1>;

struct Point {
  double value[4], rate[4], bend[4];
};

/// Value and derivatives of a path's polynomials at any time, not only at ticks.
Point at(const std::vector<Segment<double>>& path, double t_s, std::size_t segment) {
  Point p{};
  const double t = t_s - kTick_s * path[segment].start_tick;
  for (int c = 0; c < 4; ++c)
    for (int n = 0; n < 6; ++n) {
      const double a = path[segment].coefficients[c][n];
      p.value[c] += a * std::pow(t, n);
      if (n > 0) p.rate[c] += n * a * std::pow(t, n - 1);
      if (n > 1) p.bend[c] += n * (n - 1) * a * std::pow(t, n - 2);
    }
  return p;
}

Setpoint<One> setpoint(const std::vector<Segment<double>>& path, std::uint32_t tick) {
  const PathView<double> view{path.data(), static_cast<std::uint32_t>(path.size()), kTick_s};
  std::uint32_t segment = 0;
  return setpoint_at<One>(view, &tick, &segment);
}

TEST(Waypoints, GoFromRestToRest) {
  const Task t =
      task(along(waypoint(0, 0.1, 0.2, 0.3, -1) + waypoint(1.5, 0.4, -0.2, 0.9, 2) + waypoint(2.5, 0.4, 1, 0, 2)));
  ASSERT_EQ(t.path.size(), 3u);
  const double places[3][4] = {{0.1, 0.2, 0.3, -1}, {0.4, -0.2, 0.9, 2}, {0.4, 1, 0, 2}};
  const double times[3] = {0, 1.5, 2.5};
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(t.path[i].start_tick, static_cast<std::uint32_t>(std::lround(times[i] / kTick_s)));
    // a segment's beginning, and the end of the one before: values of size 1 and terms of size 10 x it
    for (std::size_t segment = i == 0 ? 0 : i - 1; segment <= i; ++segment) {
      const Point p = at(t.path, times[i], segment);
      for (int c = 0; c < 4; ++c) {
        EXPECT_NEAR(p.value[c], places[i][c], 1e-13) << i << segment << c;
        EXPECT_NEAR(p.rate[c], 0, 1e-12) << i << segment << c;
        EXPECT_NEAR(p.bend[c], 0, 1e-11) << i << segment << c;
      }
    }
  }
  // minimum jerk: half-way in half the time, at 15/8 of the mean speed, without acceleration
  const Point middle = at(t.path, 0.75, 0);
  for (int c = 0; c < 4; ++c) {
    EXPECT_NEAR(middle.value[c], (places[0][c] + places[1][c]) / 2, 1e-13);
    EXPECT_NEAR(middle.rate[c], 15.0 / 8 * (places[1][c] - places[0][c]) / 1.5, 1e-12);
    EXPECT_NEAR(middle.bend[c], 0, 1e-11);
  }
  const Setpoint<One> end = setpoint(t.path, 100000);  // it stays there
  EXPECT_NEAR(end.position_m.y.raw[0], 1, 1e-13);
  EXPECT_EQ(end.velocity_m_s.y.raw[0], 0);
}

TEST(Setpoint, IsThePolynomialAndItsDerivatives) {
  const Task t =
      task(along(waypoint(0, 0.1, 0.2, 0.3, -1) + waypoint(1.5, 0.4, -0.2, 0.9, 2) + waypoint(2.5, 0.4, 1, 0, 2)));
  for (const std::uint32_t tick : {0u, 1u, 333u, 749u, 750u, 751u, 1249u, 1250u, 5000u}) {
    const Point p = at(t.path, tick * kTick_s, tick < 750 ? 0 : tick < 1250 ? 1 : 2);
    const Setpoint<One> s = setpoint(t.path, tick);
    const One* position = &s.position_m.x;
    const One* velocity = &s.velocity_m_s.x;
    const One* acceleration = &s.acceleration_m_s2.x;
    for (int c = 0; c < 3; ++c) {
      EXPECT_NEAR(position[c].raw[0], p.value[c], 1e-13) << tick;
      EXPECT_NEAR(velocity[c].raw[0], p.rate[c], 1e-12) << tick;
      EXPECT_NEAR(acceleration[c].raw[0], p.bend[c], 1e-11) << tick;
    }
    EXPECT_NEAR(s.heading.cos.raw[0], std::cos(p.value[3]), 1e-13) << tick;
    EXPECT_NEAR(s.heading.sin.raw[0], std::sin(p.value[3]), 1e-13) << tick;
    EXPECT_NEAR(s.heading_rate_rad_s.raw[0], p.rate[3], 1e-12) << tick;
  }
}

TEST(Setpoint, EachLaneIsWhereItIsAlone) {
  using Four = model::Lanes<float, 4>;
  const Task t = task(
      along(waypoint(0, 0, 0, 0) + waypoint(0.2, 1, 2, 3, 1) + waypoint(0.3, 2, 1, 0, -1) + waypoint(0.9, 0, 0, 1)));
  std::vector<Segment<float>> path;
  for (const Segment<double>& s : t.path) {
    Segment<float> f{s.start_tick, {}};
    for (int c = 0; c < 4; ++c)
      for (int n = 0; n < 6; ++n) f.coefficients[c][n] = static_cast<float>(s.coefficients[c][n]);
    path.push_back(f);
  }
  const PathView<float> view{path.data(), static_cast<std::uint32_t>(path.size()), static_cast<float>(kTick_s)};
  std::uint32_t tick[4] = {0, 90, 140, 700}, segment[4] = {0, 0, 0, 0};
  for (int step = 0; step < 500; ++step) {
    const Setpoint<Four> s = setpoint_at<Four>(view, tick, segment);
    for (int i = 0; i < 4; ++i) {
      std::uint32_t alone = 0;
      const auto one = setpoint_at<model::Lanes<float, 1>>(view, tick + i, &alone);
      ASSERT_EQ(segment[i], alone);
      for (std::size_t k = 0; k < sizeof s / sizeof(Four); ++k)
        ASSERT_EQ(reinterpret_cast<const Four*>(&s)[k].raw[i],
                  (reinterpret_cast<const model::Lanes<float, 1>*>(&one)[k].raw[0]))
            << "tick " << tick[i] << ", number " << k;
    }
    for (std::uint32_t& t_i : tick) ++t_i;
  }
}

std::string spline_task(const std::string& csv) {
  const std::string file = testing::TempDir() + "path_test.csv";
  std::ofstream(file) << csv;
  std::string text = staying();
  const auto from = text.find("kind = \"waypoints\""), to = text.find("[action]");
  return text.replace(from, to - from, "kind = \"file\"\nfile = \"" + file + "\"\n");
}

TEST(Spline, IsTheClampedCubicSplineThroughItsPoints) {
  const double t[6] = {0, 0.2, 0.5, 0.52, 1.4, 2}, x[6] = {0, 1, -0.5, -0.6, 2, 1.5}, y[6] = {3, 3, 3, 3, 3, 3},
               z[6] = {0, 0.1, 0.2, 0.3, 0.4, 0.5}, h[6] = {0, 1, 2, 3, 4, 5};
  std::string csv = "t_s,x_m,y_m,z_m,heading_rad\n";
  const double* columns[5] = {t, x, y, z, h};
  for (int i = 0; i < 6; ++i)
    for (int c = 0; c < 5; ++c) csv += std::to_string(columns[c][i]) + (c < 4 ? "," : "\n");
  const std::vector<Segment<double>> path = task(spline_task(csv)).path;
  ASSERT_EQ(path.size(), 6u);
  for (int c = 0; c < 4; ++c) {
    // another way to the same spline: all 20 coefficients at once from what defines them
    Eigen::MatrixXd a = Eigen::MatrixXd::Zero(20, 20);
    Eigen::VectorXd b = Eigen::VectorXd::Zero(20);
    int row = 0;
    const auto term = [&](int segment, int n, double time, int derivative) {
      double factor = 1;
      for (int k = 0; k < derivative; ++k) factor *= n - k;
      return n < derivative ? 0.0 : factor * std::pow(time - t[segment], n - derivative);
    };
    for (int i = 0; i < 5; ++i)
      for (const int end : {i, i + 1}) {
        for (int n = 0; n < 4; ++n) a(row, 4 * i + n) = term(i, n, t[end], 0);
        b(row++) = columns[c + 1][end];
      }
    for (int i = 0; i < 4; ++i)
      for (const int derivative : {1, 2}) {
        for (int n = 0; n < 4; ++n) {
          a(row, 4 * i + n) = term(i, n, t[i + 1], derivative);
          a(row, 4 * i + 4 + n) = -term(i + 1, n, t[i + 1], derivative);
        }
        ++row;
      }
    for (int n = 0; n < 4; ++n) a(row, n) = term(0, n, t[0], 1), a(row + 1, 16 + n) = term(4, n, t[5], 1);
    const Eigen::VectorXd expected = a.fullPivLu().solve(b);
    const double scale = expected.cwiseAbs().maxCoeff() + 1;
    for (int i = 0; i < 5; ++i)
      for (int n = 0; n < 6; ++n)  // the intervals differ by 44, the cubes in the system by 1e5: digits for them
        EXPECT_NEAR(path[static_cast<std::size_t>(i)].coefficients[c][n], n < 4 ? expected(4 * i + n) : 0, 1e-9 * scale)
            << c << i << n;
  }
  for (std::size_t i = 1; i < 5; ++i) {  // no jump of value, velocity and acceleration
    const Point left = at(path, t[i], i - 1), right = at(path, t[i], i);
    for (int c = 0; c < 4; ++c) {
      EXPECT_NEAR(left.value[c], right.value[c], 1e-12);
      EXPECT_NEAR(left.rate[c], right.rate[c], 1e-10);
      EXPECT_NEAR(left.bend[c], right.bend[c], 1e-8);
    }
  }
}

TEST(Spline, RefusesWhatIsNoPath) {
  const std::string head = "t_s,x_m,y_m,z_m,heading_rad\n";
  EXPECT_THROW(task(spline_task(head + "0,0,0,0,0\n")), io::InputError);
  EXPECT_THROW(task(spline_task(head + "0.5,0,0,0,0\n1,0,0,0,0\n")), io::InputError);
  EXPECT_THROW(task(spline_task(head + "-1,0,0,0,0\n1,0,0,0,0\n")), io::InputError);
  EXPECT_THROW(task(spline_task(head + "0,0,0,0,0\n0.0005,0,0,0,0\n")), io::InputError);
  EXPECT_THROW(task(spline_task(head + "0,0,0,0,0\n-2,0,0,0,0\n1,0,0,0,0\n")), io::InputError);
  EXPECT_THROW(task(spline_task(head + "0,0,0,0,0\n1e6,0,0,0,0\n")), io::InputError);
  EXPECT_THROW(task(spline_task(head + "0,0,0,0,0\n1,2e4,0,0,0\n")), io::InputError);
  EXPECT_THROW(task(spline_task(head + "0,0,0,0,0\n1,0,0,0,200\n")), io::InputError);
  EXPECT_NO_THROW(task(spline_task(head + "0,0,0,0,0\n0.002,0,0,0,0\n")));
  EXPECT_THROW(task(along(waypoint(0.5, 0, 0, 0))), io::InputError);
  EXPECT_THROW(task(along(waypoint(0, 0, 0, 0) + waypoint(0.0005, 1, 0, 0))), io::InputError);
  EXPECT_THROW(task(along("")), io::InputError);
}

}  // namespace
}  // namespace flappy::flight::path_test
