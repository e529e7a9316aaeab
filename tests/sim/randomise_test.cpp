// Randomised vehicles: the laws of their draws, what a draw depends on, and the random numbers beneath.
#include "sim/randomise.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numeric>

#include "vehicles.hpp"

namespace flappy::sim::randomise_test {
namespace {

constexpr std::size_t kDraws = 20'000;
// Estimates are allowed this many of their standard errors: by chance one in 16,000 is farther off.
constexpr double kErrors = 4;

Randomisation randomisation(const std::string& tables, const model::Vehicle& nominal = test::nominal()) {
  const io::Table root = io::Config::parse(tables, "r.toml").root();
  Randomisation r(nominal, root);
  root.finish();
  return r;
}

std::string table(const std::string& parameters, const std::string& law) {
  return "[[randomise]]\nparameters = [" + parameters + "]\n" + law + "\n";
}

/// kDraws values of one figure, each from the vehicle of another flapper.
std::vector<double> draw(const Randomisation& r, double (*figure)(const model::Vehicle&)) {
  std::vector<double> values;
  for (std::uint32_t i = 0; i < kDraws; ++i) values.push_back(figure(r.sample({.seed = 5, .flapper = i})));
  return values;
}

struct Moments {
  double mean, sd, low, high;
};
Moments moments(const std::vector<double>& x) {
  const double n = static_cast<double>(x.size()), mean = std::accumulate(x.begin(), x.end(), 0.0) / n;
  double square = 0;
  for (const double v : x) square += (v - mean) * (v - mean);
  return {mean, std::sqrt(square / n), *std::ranges::min_element(x), *std::ranges::max_element(x)};
}

/// Mean and sd within their standard errors; that of an sd is sd/sqrt(2n) for a normal and less for flatter
/// laws.
void expect_moments(const std::vector<double>& x, double mean, double sd) {
  const double n = static_cast<double>(x.size());
  const Moments m = moments(x);
  EXPECT_NEAR(m.mean, mean, kErrors * sd / std::sqrt(n));
  EXPECT_NEAR(m.sd, sd, kErrors * sd / std::sqrt(2 * n));
}

/// Share of `x` that `counts`, within its standard error.
template <class Counts>
void expect_share(const std::vector<double>& x, double share, const Counts& counts) {
  const double n = static_cast<double>(x.size());
  EXPECT_NEAR(static_cast<double>(std::ranges::count_if(x, counts)) / n, share,
              kErrors * std::sqrt(share * (1 - share) / n));
}

double correlation(const std::vector<double>& x, const std::vector<double>& y) {
  const Moments a = moments(x), b = moments(y);
  double sum = 0;
  for (std::size_t i = 0; i < x.size(); ++i) sum += (x[i] - a.mean) * (y[i] - b.mean);
  return sum / (static_cast<double>(x.size()) * a.sd * b.sd);
}

// A standard normal cut at 3: its sd is sqrt(1 - 6 phi(3) / (2 Phi(3) - 1)), and 0.68453 of it lies within 1.
constexpr double kCutSd = 0.986579;
constexpr double kCutWithinOne = 0.684537;
// Its magnitude has mean 2 (phi(0) - phi(3)) / (2 Phi(3) - 1).
constexpr double kCutMagnitude = 0.791156;

double torso_mass(const model::Vehicle& v) { return v.torso.mass_kg; }
double resistance(const model::Vehicle& v) { return v.left.motor.resistance_ohm; }
double rest_angle(const model::Vehicle& v) { return v.right.spring.rest_angle_rad; }

TEST(Laws, ScaleNormal) {
  const auto r = randomisation(table("\"torso.mass_kg\"", "law = \"scale_normal\"\nsd = 0.1"));
  const double nominal = r.nominal().torso.mass_kg;
  const std::vector<double> x = draw(r, torso_mass);
  expect_moments(x, nominal, 0.1 * kCutSd * nominal);
  expect_share(x, kCutWithinOne, [&](double m) { return std::abs(m - nominal) < 0.1 * nominal; });
  // cut at 3 sd; of 20,000 draws 10 are expected in the last 0.1 sd on each side
  EXPECT_GE(moments(x).low, 0.7 * nominal);
  EXPECT_LE(moments(x).high, 1.3 * nominal);
  EXPECT_LT(moments(x).low, 0.71 * nominal);
  EXPECT_GT(moments(x).high, 1.29 * nominal);
}

TEST(Laws, ScaleHalfNormalNeverFallsBelowNominal) {
  const auto r = randomisation(table("\"left.motor.resistance_ohm\"", "law = \"scale_half_normal\"\nsd = 0.1"));
  const std::vector<double> x = draw(r, resistance);
  const double sd = std::sqrt(kCutSd * kCutSd - kCutMagnitude * kCutMagnitude);
  expect_moments(x, 12.4 * (1 + 0.1 * kCutMagnitude), 12.4 * 0.1 * sd);
  EXPECT_GE(moments(x).low, 12.4);
  EXPECT_LE(moments(x).high, 12.4 * 1.3);
  EXPECT_EQ(r.sample({}).right.motor.resistance_ohm, 12.4) << "the other side has a draw of its own";
}

TEST(Laws, ReplaceAndAddNormal) {
  const model::Vehicle nominal = test::identified();
  const auto replace = randomisation(
      table("\"right.spring.rest_angle_rad\"", "law = \"replace_normal\"\nmean = 0.01\nsd = 0.05"), nominal);
  expect_moments(draw(replace, rest_angle), 0.01, 0.05 * kCutSd);
  const auto add = randomisation(table("\"right.spring.rest_angle_rad\"", "law = \"add_normal\"\nsd = 0.05"), nominal);
  expect_moments(draw(add, rest_angle), nominal.right.spring.rest_angle_rad, 0.05 * kCutSd);
}

TEST(Laws, Uniform) {
  const auto replace =
      randomisation(table("\"right.spring.rest_angle_rad\"", "law = \"replace_uniform\"\nlow = -0.1\nhigh = 0.3"));
  const std::vector<double> x = draw(replace, rest_angle);
  expect_moments(x, 0.1, 0.4 / std::sqrt(12));
  EXPECT_GE(moments(x).low, -0.1);
  EXPECT_LE(moments(x).high, 0.3);
  expect_share(x, 0.25, [](double a) { return a < 0; });
  const auto scale = randomisation(table("\"torso.mass_kg\"", "law = \"scale_uniform\"\nlow = 0.8\nhigh = 1.2"));
  const double nominal = scale.nominal().torso.mass_kg;
  expect_moments(draw(scale, torso_mass), nominal, 0.4 / std::sqrt(12) * nominal);
}

TEST(Laws, AreCutWhereTheTableSays) {
  const auto r = randomisation(table("\"torso.mass_kg\"", "law = \"scale_normal\"\nsd = 0.1\ncut_sd = 1.0"));
  const double nominal = r.nominal().torso.mass_kg;
  const std::vector<double> x = draw(r, torso_mass);
  // drawn again, not moved onto the cut; the sd of a normal cut at 1 is 0.539560
  expect_moments(x, nominal, 0.1 * 0.539560 * nominal);
  EXPECT_GE(moments(x).low, 0.9 * nominal);
  EXPECT_LE(moments(x).high, 1.1 * nominal);
}

TEST(Laws, NarrowByPartsOfNames) {
  auto r = randomisation(table("\"torso.mass_kg\"", "law = \"scale_normal\"\nsd = 0.1") +
                         table("\"right.spring.rest_angle_rad\"", "law = \"replace_uniform\"\nlow = -0.1\nhigh = 0.3"));
  auto both = r;
  r.narrow({"mass_kg", "com_m"}, 0.1);
  both.narrow({"rest_angle", "mass"}, 0.1);
  const double nominal = r.nominal().torso.mass_kg;
  expect_moments(draw(r, torso_mass), nominal, 0.01 * kCutSd * nominal);
  expect_moments(draw(r, rest_angle), 0.1, 0.4 / std::sqrt(12));
  expect_moments(draw(both, rest_angle), 0.1, 0.04 / std::sqrt(12));
}

// ---- the posterior of a vehicle file

using Rows = std::vector<std::vector<double>>;

/// A mass and a pair of stiffnesses that vary together, and the size of an effect.
model::Vehicle with_posterior() {
  model::Vehicle v = test::nominal();
  v.effects["ground_effect"] = {{"gain", 0.9}, {"length_m", 0.05}};
  const double m = 4e-4, k = 1e-3, g = 0.05, mk = 0.6 * m * k;
  v.posterior = {{"effects.ground_effect.gain", "torso.mass_kg", "left.spring.stiffness_positive_Nm_rad",
                  "left.spring.stiffness_negative_Nm_rad"},
                 {0.5, 0.012, 0.013, 0.013},
                 {{g * g, 0, 0, 0}, {0, m * m, mk, mk}, {0, mk, k * k, k * k}, {0, mk, k * k, k * k}}};
  return v;
}
std::vector<double> drawn(const model::Vehicle& v) {
  return {v.effects.at("ground_effect").at("gain"), v.torso.mass_kg, v.left.spring.stiffness_positive_Nm_rad,
          v.left.spring.stiffness_negative_Nm_rad};
}

TEST(Posterior, IsWhatIsDrawn) {
  const model::Vehicle v = with_posterior();
  const Randomisation r = Randomisation::of_posterior(v);
  const std::size_t n = v.posterior->names.size();
  std::vector<double> sum(n);
  Rows products(n, std::vector<double>(n));
  for (std::uint32_t i = 0; i < kDraws; ++i) {
    const model::Vehicle one = r.sample({.seed = 5, .flapper = i});
    const std::vector<double> x = drawn(one);
    EXPECT_DOUBLE_EQ(x[2], x[3]) << "one cause moves both";
    for (std::size_t a = 0; a < n; ++a) {
      sum[a] += x[a] - v.posterior->means[a];
      for (std::size_t b = 0; b < n; ++b)
        products[a][b] += (x[a] - v.posterior->means[a]) * (x[b] - v.posterior->means[b]);
    }
  }
  // standard errors of normal draws: sqrt(c_aa / n) of a mean, sqrt((c_aa c_bb + c_ab^2) / n) of a covariance
  const Rows& c = v.posterior->covariance;
  const double count = static_cast<double>(kDraws);
  for (std::size_t a = 0; a < n; ++a) {
    EXPECT_NEAR(sum[a] / count, 0, kErrors * std::sqrt(c[a][a] / count));
    for (std::size_t b = 0; b < n; ++b)
      EXPECT_NEAR(products[a][b] / count, c[a][b],
                  kErrors * std::sqrt((c[a][a] * c[b][b] + c[a][b] * c[a][b]) / count));
  }
}

TEST(Posterior, HasOneVariateForEachParameter) {
  const model::Vehicle v = with_posterior();
  const Randomisation r = Randomisation::of_posterior(v);
  ASSERT_EQ(r.draws(), 4u);
  for (std::size_t d = 0; d < 4; ++d) {
    EXPECT_EQ(r.name(d), v.posterior->names[d]);
    EXPECT_FALSE(r.is_uniform(d));
  }
  EXPECT_EQ(drawn(r.at({0, 0, 0, 0})), v.posterior->means) << "not the nominal ones";
  const std::vector<double> heavy = drawn(r.at({0, 1, 0, 0}));
  EXPECT_DOUBLE_EQ(heavy[1], 0.0124);
  EXPECT_DOUBLE_EQ(heavy[2], 0.013 + 0.6e-3);
  EXPECT_EQ(drawn(r.at({11, 0, 0, 9}))[0], 1) << "the end of the accepted range";
  EXPECT_EQ(r.at({0, 0, 0, 9}).left.motor.resistance_ohm, v.left.motor.resistance_ohm);
  EXPECT_FALSE(r.at({0, 0, 0, 0}).posterior) << "a vehicle that was drawn is certain";
  const RandomKey key{.seed = 1, .flapper = 2, .episode = 3};
  EXPECT_EQ(drawn(r.sample(key)), drawn(Randomisation::of_posterior(v).sample(key)));
  EXPECT_NE(drawn(r.sample(key)), drawn(r.sample({.seed = 1, .flapper = 3, .episode = 3})));
}

// Of an inertia so uncertain that one draw in three is of no body, every draw is of one.
TEST(Posterior, DrawsBodiesThatCanBe) {
  model::Vehicle v = test::nominal();
  const double xx = v.torso.inertia_kg_m2.xx;
  v.posterior = {{"torso.inertia_kg_m2.xx"}, {xx}, {{xx * xx}}};
  const Randomisation r = Randomisation::of_posterior(v);
  bool differ = false;
  for (std::uint32_t i = 0; i < 1000; ++i) {
    const model::Vehicle one = r.sample({.seed = 5, .flapper = i});
    EXPECT_FALSE(model::physical_fault(one));
    differ |= one.torso.inertia_kg_m2.xx > 1.3 * xx;
  }
  EXPECT_TRUE(differ);
}

// ---- what a draw depends on

const std::string kMass = table("\"torso.mass_kg\"", "law = \"scale_normal\"\nsd = 0.1");
const std::string kAngle = table("\"right.spring.rest_angle_rad\"", "law = \"replace_normal\"\nmean = 0.0\nsd = 0.05");

void expect_same(model::Vehicle a, model::Vehicle b) {
  const auto p = model::parameters(a), q = model::parameters(b);
  for (std::size_t i = 0; i < p.size(); ++i) EXPECT_EQ(*p[i].value, *q[i].value) << p[i].path;
}

TEST(Sample, IsTheNominalVehicleWithoutATable) {
  expect_same(Randomisation(test::identified()).sample({.seed = 3}), test::identified());
  expect_same(randomisation("", test::identified()).sample({.seed = 3}), test::identified());
}

TEST(Sample, DependsOnItsKeyAlone) {
  const auto r = randomisation(kMass + kAngle);
  const RandomKey key{.seed = 1, .flapper = 2, .episode = 3};
  const model::Vehicle first = r.sample(key);
  for (std::uint32_t i = 0; i < 10; ++i) r.sample({.seed = 9, .flapper = i});
  expect_same(r.sample(key), first);
  expect_same(r.sample({.seed = 1, .flapper = 2, .episode = 3, .stream = static_cast<Stream>(77)}), first);
  const RandomKey others[] = {{2, 2, 3}, {1, 3, 3}, {1, 2, 4}, {1 | std::uint64_t{1} << 32, 2, 3}, {1, 3, 2}};
  for (const RandomKey& other : others) EXPECT_NE(r.sample(other).torso.mass_kg, first.torso.mass_kg);
}

TEST(Sample, KeepsItsDrawsWhenOthersAreAppendedOrChanged) {
  const auto one = randomisation(kMass), two = randomisation(kMass + kAngle);
  const auto other =
      randomisation(table("\"torso.mass_kg\"", "law = \"scale_uniform\"\nlow = 0.9\nhigh = 1.1") + kAngle);
  const auto redrawn =
      randomisation(table("\"torso.mass_kg\"", "law = \"scale_normal\"\nsd = 0.1\ncut_sd = 1.0") + kAngle);
  for (std::uint32_t i = 0; i < 100; ++i) {
    const RandomKey key{.seed = 1, .flapper = i};
    EXPECT_EQ(torso_mass(one.sample(key)), torso_mass(two.sample(key)));
    EXPECT_EQ(rest_angle(two.sample(key)), rest_angle(other.sample(key)));
    EXPECT_EQ(rest_angle(two.sample(key)), rest_angle(redrawn.sample(key)));
  }
}

TEST(Sample, SharesNoRandomNumberBetweenDrawsThatAreDrawnAgain) {
  const std::string cut = "\nsd = 0.1\ncut_sd = 1.0";  // a third of them
  const auto r = randomisation(table("\"torso.mass_kg\"", "law = \"scale_normal\"" + cut) +
                               table("\"right.spring.rest_angle_rad\"", "law = \"replace_normal\"\nmean = 0.0" + cut));
  EXPECT_LT(std::abs(correlation(draw(r, torso_mass), draw(r, rest_angle))), kErrors / std::sqrt(kDraws));
}

TEST(Sample, ScalesMassAndInertiaOfABodyByOneFactor) {
  const auto r =
      randomisation(table("\"left.wing.mass_kg\", \"left.wing.inertia_kg_m2\"", "law = \"scale_normal\"\nsd = 0.1"));
  const model::RigidBody nominal = r.nominal().left.wing;
  const model::Vehicle v = r.sample({.seed = 4});
  const double factor = v.left.wing.mass_kg / nominal.mass_kg;
  EXPECT_GT(std::abs(factor - 1), 1e-3);
  using I = model::InertiaTensor;
  for (double I::*element : {&I::xx, &I::yy, &I::zz, &I::xy, &I::yz, &I::xz})
    EXPECT_DOUBLE_EQ(v.left.wing.inertia_kg_m2.*element, factor * nominal.inertia_kg_m2.*element);
  EXPECT_EQ(v.left.wing.com_m.y, nominal.com_m.y);
  EXPECT_EQ(v.right.wing.mass_kg, r.nominal().right.wing.mass_kg);
}

TEST(Sample, OfTheShippedTableIsPhysicalAndUncorrelated) {
  const auto config = io::Config::load(test::source_path("configs/randomisation/published.toml"));
  const Randomisation r(test::nominal(), config.root());
  std::vector<std::vector<double>> x(6);
  for (std::uint32_t i = 0; i < kDraws / 4; ++i) {
    const model::Vehicle v = r.sample({.seed = 5, .flapper = i});
    EXPECT_FALSE(model::physical_fault(v).has_value());
    const double figures[] = {
        v.torso.mass_kg,           v.left.wing.mass_kg,           v.left.spring.stiffness_positive_Nm_rad,
        v.left.rotation.lower_rad, v.right.spring.rest_angle_rad, v.right.motor.resistance_ohm};
    for (std::size_t k = 0; k < x.size(); ++k) x[k].push_back(figures[k]);
  }
  // the standard error of the correlation of n independent pairs is 1/sqrt(n)
  const double limit = kErrors / std::sqrt(static_cast<double>(x[0].size()));
  for (std::size_t a = 0; a < x.size(); ++a)
    for (std::size_t b = 0; b < a; ++b) EXPECT_LT(std::abs(correlation(x[a], x[b])), limit) << a << " " << b;
}

// Moments that are possible one by one, and together not in some vehicles: these are drawn again, the others are not.
TEST(Sample, DrawsBodiesThatCanBeTogether) {
  const std::string law = "law = \"scale_uniform\"\nlow = 0.7\nhigh = 1.45";
  const std::string xx = table("\"torso.inertia_kg_m2.xx\"", law), zz = table("\"torso.inertia_kg_m2.zz\"", law);
  const auto one = randomisation(xx), two = randomisation(xx + zz);
  int again = 0;
  for (std::uint32_t i = 0; i < 1000; ++i) {
    const RandomKey key{.seed = 5, .flapper = i};
    const model::Vehicle v = two.sample(key);
    EXPECT_FALSE(model::physical_fault(v)) << i;
    again += v.torso.inertia_kg_m2.xx != one.sample(key).torso.inertia_kg_m2.xx;
  }
  // xx = 4.24 x > yy + zz = 3.97 + 2.44 z, roughly: where x > 0.94 + 0.58 z, in 0.75^2: z < 0.88, x from 1.35 on
  EXPECT_GT(again, 10);
  EXPECT_LT(again, 100);
}

// ---- what is refused

std::string message(const std::string& tables) {
  try {
    randomisation(tables);
    return "accepted";
  } catch (const io::InputError& e) {
    return e.what();
  }
}
std::string mass(const std::string& law) { return message(table("\"torso.mass_kg\"", law)); }

TEST(Sample, DrawsTheParametersOfAnEffect) {
  model::Vehicle v = test::nominal();
  v.effects["ground_effect"] = {{"gain", 0.1}, {"length_m", 0.06}};
  const Randomisation r =
      randomisation(table("\"effects.ground_effect.gain\"", "law = \"replace_uniform\"\nlow = 0\nhigh = 0.2"), v);
  const auto gain = [](const model::Vehicle& x) { return x.effects.at("ground_effect").at("gain"); };
  expect_moments(draw(r, gain), 0.1, 0.2 / std::sqrt(12));
  EXPECT_EQ(r.sample({}).effects.at("ground_effect").at("length_m"), 0.06);
}

TEST(RandomisationTable, RefusesWhatItCannotDraw) {
  EXPECT_EQ(message(table("\"torso.mass\"", "law = \"scale_normal\"\nsd = 0.1")),
            "r.toml:2:14: randomise[0].parameters: no parameter \"torso.mass\"; accepted: paths of the vehicle "
            "file; did you mean \"torso.mass_kg\"?");
  EXPECT_EQ(message(table("\"torso.mass_k\", \"elephant\"", "law = \"scale_normal\"\nsd = 0.1")),
            "r.toml:2:14: randomise[0].parameters: no parameter \"torso.mass_k\"; accepted: paths of the vehicle "
            "file; did you mean \"torso.mass_kg\"?");
  EXPECT_EQ(message(table("\"elephant\"", "law = \"scale_normal\"\nsd = 0.1")),
            "r.toml:2:14: randomise[0].parameters: no parameter \"elephant\"; accepted: paths of the vehicle file");
  EXPECT_EQ(message(table("", "law = \"scale_normal\"\nsd = 0.1")),
            "r.toml:2:14: randomise[0].parameters: is empty; accepted: paths of the vehicle file");
  EXPECT_EQ(message(table("\"torso\", \"torso.mass_kg\"", "law = \"scale_uniform\"\nlow = 1.0\nhigh = 1.1")),
            "r.toml:2:14: randomise[0].parameters: torso.mass_kg is given twice; accepted: each parameter once");
  EXPECT_EQ(message(table("\"driver\"", "law = \"scale_normal\"\nsd = 0.01")),
            "r.toml:2:14: randomise[0].parameters: driver.hold_s is the same for a whole batch; accepted: what may "
            "differ from flapper to flapper");
  EXPECT_EQ(message("[[randomise]]\nlaw = \"scale_normal\"\nsd = 0.1\n"),
            "r.toml:1:1: randomise[0].parameters: is missing; accepted: an array of strings");
}

// They are there for whoever fits a vehicle.
TEST(RandomisationTable, MinorDrawsAreMovedAndNeverDrawn) {
  const std::string minor = "law = \"scale_normal\"\nsd = 0.1\nminor = true",
                    major = table("\"torso.mass_kg\"", "law = \"scale_normal\"\nsd = 0.1");
  // flat wings: their largest moment is the sum of the others, and none smaller
  const std::string flat = table("\"left.wing.inertia_kg_m2.yy\"", minor);
  Randomisation r = randomisation(major + flat);
  EXPECT_EQ(r.draws(), 2u);
  EXPECT_EQ(r.majors(), 1u);
  const double inertia = r.nominal().left.wing.inertia_kg_m2.yy;
  EXPECT_EQ(r.sample({.seed = 5, .flapper = 1}).left.wing.inertia_kg_m2.yy, inertia);
  EXPECT_DOUBLE_EQ(r.at({0, 1}).left.wing.inertia_kg_m2.yy, 1.1 * inertia);
  EXPECT_DOUBLE_EQ(r.at({1}).torso.mass_kg, 1.1 * r.nominal().torso.mass_kg);
  r.set_minors({2});
  EXPECT_DOUBLE_EQ(r.at({0}).left.wing.inertia_kg_m2.yy, 1.2 * inertia);
  r.set_minors({-2});
  EXPECT_GT(r.at({0}).left.wing.inertia_kg_m2.yy, 0.99 * inertia) << "drawn in until the body is one";
  EXPECT_EQ(message(table("\"left.wing.inertia_kg_m2.yy\"", minor) + major),
            "r.toml:6:1: randomise[1].minor: a draw before this one is minor; accepted: minor draws behind all others");
}

TEST(RandomisationTable, RefusesLawsThatDoNotExistOrFit) {
  EXPECT_EQ(mass("law = \"scale_norml\"\nsd = 0.1"),
            "r.toml:3:7: randomise[0].law: \"scale_norml\" is not known; accepted: \"scale_normal\", "
            "\"scale_half_normal\", \"replace_normal\", \"add_normal\", \"scale_uniform\", "
            "\"replace_uniform\"; did "
            "you mean \"scale_normal\"?");
  EXPECT_EQ(mass("law = \"scale_normal\"\nsd = -0.1"),
            "r.toml:4:6: randomise[0].sd: -0.1 is out of range; accepted: a number of at least 0");
  EXPECT_EQ(mass("law = \"scale_normal\"\nsd = 0.1\ncut_sd = 0.5"),
            "r.toml:5:10: randomise[0].cut_sd: 0.5 is out of range; accepted: a number from 1 to 8");
  EXPECT_EQ(mass("law = \"scale_uniform\"\nlow = 1.1\nhigh = 0.9"),
            "r.toml:5:8: randomise[0].high: 0.9 is out of range; accepted: a number from 1.1 to 1e+12");
  EXPECT_EQ(mass("law = \"replace_normal\"\nsd = 0.1"),
            "r.toml:1:1: randomise[0].mean: is missing; accepted: a number");
  EXPECT_EQ(mass("law = \"scale_normal\"\nsd = 0.1\nmean = 1.0"),
            "r.toml:5:1: randomise[0].mean: unknown key; accepted: cut_sd, each, law, minor, parameters, sd");
  EXPECT_EQ(mass("law = \"scale_uniform\"\nlow = 0.9\nhigh = 1.1\nsd = 0.1"),
            "r.toml:6:1: randomise[0].sd: unknown key; accepted: each, high, law, low, minor, parameters");
}

TEST(RandomisationTable, RefusesDrawsThatCouldLeaveTheAcceptedRange) {
  EXPECT_EQ(mass("law = \"scale_normal\"\nsd = 0.4"),
            "r.toml:2:14: randomise[0].parameters: torso.mass_kg could become -0.00218134; accepted: draws between "
            "1e-09 and 10");
  EXPECT_EQ(mass("law = \"scale_normal\"\nsd = 0.4\ncut_sd = 2.0"), "accepted");
  EXPECT_EQ(message(table("\"left.motor.efficiency\"", "law = \"scale_half_normal\"\nsd = 0.05")),
            "r.toml:2:14: randomise[0].parameters: left.motor.efficiency could become 1.035; accepted: draws "
            "between 0.001 and 1");
  EXPECT_EQ(message(kAngle + table("\"left.wing.inertia_kg_m2.yy\"",
                                   "law = \"replace_uniform\"\nlow = 0.0\nhigh = "
                                   "1e-9")),
            "r.toml:7:14: randomise[1].parameters: left.wing.inertia_kg_m2.yy could become 0; accepted: "
            "draws between "
            "1e-18 and 1");
}

TEST(RandomisationTable, FollowsAParameterThroughAllItsDraws) {
  const std::string half = table("\"left.motor.efficiency\"", "law = \"scale_half_normal\"\nsd = 0.02");
  EXPECT_EQ(message(half), "accepted");
  EXPECT_EQ(message(half + half),
            "r.toml:6:14: randomise[1].parameters: left.motor.efficiency could become 1.01124; accepted: draws "
            "between 0.001 and 1");
}

TEST(RandomisationTable, RefusesDrawsThatMakeAnInertiaOfNoBody) {
  EXPECT_EQ(message(table("\"left.wing.inertia_kg_m2.xx\"", "law = \"scale_normal\"\nsd = 0.1")),
            "r.toml:2:14: randomise[0].parameters: left.wing.inertia_kg_m2: no rigid body has this inertia: its "
            "largest principal moment exceeds the sum of the other two by 10.4 % of it; accepted: positive principal "
            "moments, none above the sum of the other two, but for 0.01 % of rounding");
  EXPECT_EQ(message(table("\"left.wing.inertia_kg_m2\"", "law = \"scale_normal\"\nsd = 0.1")), "accepted");
  // possible alone, and hardly ever together: 4.24 x < 3.97 y + 2.44
  const std::string far = "law = \"scale_uniform\"\nlow = ";
  EXPECT_EQ(message(table("\"torso.inertia_kg_m2.xx\"", far + "1.4\nhigh = 1.5") +
                    table("\"torso.inertia_kg_m2.yy\"", far + "0.6\nhigh = 0.7")),
            "r.toml:6:1: randomise[1]: with all draws before it, hardly ever makes a body that can be: "
            "torso.inertia_kg_m2; accepted: draws that make a possible inertia together, as one draw for all of its "
            "moments");
}

// ---- the random numbers beneath

/// The key whose Philox counter is `c` and key `k`.
RandomKey key_of(const std::uint32_t (&c)[4], const std::uint32_t (&k)[2]) {
  return {std::uint64_t{k[1]} << 32 | k[0], c[2], c[3], static_cast<Stream>(c[1])};
}

double unit(std::uint32_t high, std::uint32_t low) {
  // the uppermost of 2^53 numbers would be rounded up to 1 when its half is added
  return std::min(std::ldexp(static_cast<double>(std::uint64_t{high} << 21 ^ low >> 11) + 0.5, -53), 1 - 0x1p-53);
}

TEST(Random, IsPhiloxOfThePublishedAnswers) {
  // philox4x32 with 10 rounds in Random123's file of known answers: counter, key, result
  const struct {
    std::uint32_t counter[4], key[2], result[4];
  } known[] = {
      {{0, 0, 0, 0}, {0, 0}, {0x6627e8d5, 0xe169c58d, 0xbc57ac4c, 0x9b00dbd8}},
      {{0xffffffff, 0xffffffff, 0xffffffff, 0xffffffff},
       {0xffffffff, 0xffffffff},
       {0x408f276d, 0x41c83b0e, 0xa20bc7c6, 0x6d5451fd}},
      {{0x243f6a88, 0x85a308d3, 0x13198a2e, 0x03707344},
       {0xa4093822, 0x299f31d0},
       {0xd16cfe09, 0x94fdcceb, 0x5001e420, 0x24126ea1}},
  };
  for (const auto& k : known) {
    const UniformPair u = uniform_pair(key_of(k.counter, k.key), k.counter[0]);
    EXPECT_EQ(u.first, unit(k.result[0], k.result[1]));
    EXPECT_EQ(u.second, unit(k.result[2], k.result[3]));
  }
}

/// The counter that Philox with key 0 turns into `r`: its rounds are invertible because its multipliers are
/// odd.
void unphilox(std::uint32_t (&r)[4]) {
  constexpr std::uint32_t kMultiplier[2] = {0xD2511F53, 0xCD9E8D57}, kWeyl[2] = {0x9E3779B9, 0xBB67AE85};
  const auto inverse = [](std::uint32_t odd) {
    std::uint32_t x = odd;  // right in 3 bits, and in twice as many after each turn of Newton's
    for (int i = 0; i < 4; ++i) x *= 2 - odd * x;
    return x;
  };
  for (std::uint32_t round = 10; round-- > 0;) {
    const std::uint32_t c0 = r[3] * inverse(kMultiplier[0]), c2 = r[1] * inverse(kMultiplier[1]);
    const auto high = [](std::uint32_t a, std::uint32_t b) {
      return static_cast<std::uint32_t>(std::uint64_t{a} * b >> 32);
    };
    const std::uint32_t c1 = r[0] ^ high(kMultiplier[1], c2) ^ kWeyl[0] * round;
    const std::uint32_t c3 = r[2] ^ high(kMultiplier[0], c0) ^ kWeyl[1] * round;
    r[0] = c0, r[1] = c1, r[2] = c2, r[3] = c3;
  }
}

TEST(Random, StaysWithinItsIntervalAtTheEnds) {
  for (const std::uint32_t end : {0u, 0xffffffffu})
    for (std::uint32_t nearly = 0; nearly < 64; ++nearly) {
      const std::uint32_t low = end ^ nearly << 11, last = end ^ nearly << 26;
      std::uint32_t c[4] = {end, low, end, last};
      unphilox(c);
      const RandomKey key = key_of(c, {0, 0});
      const UniformPair u = uniform_pair(key, c[0]);
      ASSERT_EQ(u.first, unit(end, low));
      ASSERT_EQ(u.second, unit(end, last));
      EXPECT_GT(std::min(u.first, u.second), 0);
      EXPECT_TRUE(std::isfinite(normal(key, c[0])));
    }
}

TEST(Random, StaysBelowOne) {
  std::uint32_t c[4] = {0xffffffff, 0xffffffff, 0xffffffff, 0xffffffff};
  unphilox(c);
  EXPECT_LT(uniform_pair(key_of(c, {0, 0}), c[0]).first, 1);
}

TEST(Random, IsUniformAndUncorrelatedBetweenStreamsAndNeighbours) {
  const auto stream = [](const RandomKey& key) {
    std::vector<double> x;
    for (std::uint32_t i = 0; i < kDraws; ++i) x.push_back(normal(key, i));
    return x;
  };
  const RandomKey key{.seed = 1, .flapper = 2, .episode = 3};
  std::vector<double> first, second;
  for (std::uint32_t i = 0; i < kDraws; ++i) {
    const UniformPair u = uniform_pair(key, i);
    first.push_back(u.first), second.push_back(u.second);
  }
  const double limit = kErrors / std::sqrt(static_cast<double>(kDraws));
  for (const auto& x : {first, second}) expect_moments(x, 0.5, 1 / std::sqrt(12));
  EXPECT_LT(std::abs(correlation(first, second)), limit);
  const std::vector<double> x = stream(key);
  expect_moments(x, 0, 1);
  expect_share(x, 0.682689, [](double n) { return std::abs(n) < 1; });
  expect_share(x, 0.022750, [](double n) { return n > 2; });
  for (const RandomKey& other :
       {RandomKey{1, 2, 3, static_cast<Stream>(2)}, RandomKey{1, 2, 4}, RandomKey{1, 3, 3}, RandomKey{2, 2, 3}})
    EXPECT_LT(std::abs(correlation(x, stream(other))), limit);
  const std::vector<double> next(x.begin() + 1, x.end());
  EXPECT_LT(std::abs(correlation({x.begin(), x.end() - 1}, next)), limit);
}

}  // namespace
}  // namespace flappy::sim::randomise_test
