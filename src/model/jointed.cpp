#include "model/jointed.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "io/toml_writer.hpp"
#include "model/beat_averaged.hpp"
#include "model/math.hpp"

namespace flappy::model {
namespace {

constexpr const char* kModes[] = {"fixed", "driven", "free"};
constexpr double kMax = 100;  // largest change per unit of an input
constexpr double kShortestLag_s = 1e-5, kLongestLag_s = 1;
constexpr double kLargestCoefficient = 20;
constexpr double kFarthest_m = 1;
/// Points of a beat at which an angle is evaluated; between them the 16th harmonic is off by at most (pi 16 / 512)^2 /
/// 2, half a percent of it.
constexpr int kPoints = 512;
constexpr double kFullTurn_rad = 2 * std::numbers::pi;

Jointed::Angle read_angle(const io::Table& side, const std::string& name) {
  Jointed::Angle a;
  const io::Table t = side.table(name);
  const std::string mode = t.choice("mode", {std::begin(kModes), std::end(kModes)});
  a.mode = static_cast<Jointed::Mode>(std::ranges::find(kModes, mode) - std::begin(kModes));
  if (a.mode != Jointed::Mode::driven) return a;
  const auto series = [&](const char* key) {
    std::vector<double> list =
        t.has(key) ? t.numbers(key, {-kFullTurn_rad * 60, kFullTurn_rad * 60}) : std::vector<double>{};
    if (list.size() > kMaxHarmonics)
      t.fail(key, std::to_string(list.size()) + " harmonics", "at most " + std::to_string(kMaxHarmonics));
    for (const double x : list)
      if (std::abs(x) > kFullTurn_rad)
        t.fail(key, io::toml_number(x) + " rad is more than a turn; are these degrees?", "amplitudes in rad");
    return list;
  };
  a.cos_rad = series("cos_rad");
  a.sin_rad = series("sin_rad");
  if (a.cos_rad.empty() && a.sin_rad.empty())
    t.fail("", "is driven without a harmonic", "cos_rad, sin_rad, or mode = \"fixed\"");
  a.cos_rad.resize(std::max(a.cos_rad.size(), a.sin_rad.size()));
  a.sin_rad.resize(a.cos_rad.size());
  return a;
}

Jointed::Wing read_wing(const io::Table& side) {
  Jointed::Wing w;
  for (std::size_t k = 0; k < kAngles.size(); ++k) w.angles[k] = read_angle(side, kAngles[k]);
  const auto t = side.optional_table("aerodynamics");
  if (!t) return w;
  if (side.has("planform")) side.fail("planform", "has no use where strips are given", "[planform] or [aerodynamics]");
  for (const std::vector<double>& row : t->rows("strips_m", 4, {-kFarthest_m, kFarthest_m})) {
    if (!(row[0] > 0 && row[1] > 0 && row[2] > 0))
      t->fail("strips_m", "span, width or chord of a strip is not above 0", "[span, width, chord, leading edge]");
    w.strips.push_back({row[0], row[1], row[2], row[3]});
  }
  if (w.strips.empty() || w.strips.size() > kMaxStrips)
    t->fail("strips_m", std::to_string(w.strips.size()) + " strips", "1 to " + std::to_string(kMaxStrips));
  w.rotational_lift = t->number_or("rotational_lift", 0, {0, 5});
  w.added_mass = t->number_or("added_mass", 0, {0, 5});
  w.rotational_damping_coefficient = t->number_or("rotational_damping_coefficient", 0, {0, 100});
  const auto series = [&](const char* key, std::vector<double>& list) {
    if (!t->has(key)) return;
    list = t->numbers(key, {-kLargestCoefficient, kLargestCoefficient});
    if (list.empty() || list.size() > kMaxTerms)
      t->fail(key, std::to_string(list.size()) + " terms", "1 to " + std::to_string(kMaxTerms));
  };
  series("normal_sin", w.normal_sin);
  series("tangential_cos", w.tangential_cos);
  return w;
}

Jointed::Input read_modulation(const std::string& name, const io::Table& t) {
  Jointed::Input input{read_input(name, t)};
  const io::Range any{-kMax, kMax};
  input.lag_s = t.number("lag_s", {kShortestLag_s, kLongestLag_s});
  input.frequency = t.number_or("frequency", 0, any);
  input.timing = t.number_or("timing", 0, any);
  input.timing_opposed = t.number_or("timing_opposed", 0, any);
  const auto each = [&](const char* key, std::array<double, 4>& list) {
    const auto angles = t.optional_table(key);
    for (std::size_t k = 0; angles && k < list.size(); ++k) list[k] = angles->number_or(kAngles[k], 0, any);
  };
  each("scale", input.scale);
  each("scale_opposed", input.scale_opposed);
  each("offset_rad", input.offset_rad);
  each("offset_opposed_rad", input.offset_opposed_rad);
  return input;
}

double reach(const Jointed::Input& i) { return std::max(std::abs(i.low), std::abs(i.high)); }

double most(const Jointed& v, const auto& part) {
  double sum = 0;
  for (const Jointed::Input& i : v.inputs) sum += reach(i) * part(i);
  return sum;
}

double largest_swing(const Jointed::Angle& a) {
  double largest = 0;
  for (int i = 0; i < kPoints; ++i) {
    double sum = 0;
    for (std::size_t k = 0; k < a.cos_rad.size(); ++k) {
      const double x = kFullTurn_rad * static_cast<double>((i * static_cast<int>(k + 1)) % kPoints) / kPoints;
      sum += a.cos_rad[k] * std::cos(x) + a.sin_rad[k] * std::sin(x);
    }
    largest = std::max(largest, std::abs(sum));
  }
  return largest;
}

}  // namespace

bool is_symmetric(const io::Table& root) { return root.boolean_or("symmetric", false); }

Jointed read_jointed(const io::Table& root) {
  Jointed v;
  if (const auto inputs = root.optional_table("input"))
    for (const std::string& name : inputs->keys()) v.inputs.push_back(read_modulation(name, inputs->table(name)));
  if (v.inputs.size() > kMaxInputs) root.fail("input", "there are too many", "at most " + std::to_string(kMaxInputs));
  v.left = read_wing(root.table("left"));
  if (is_symmetric(root)) {
    if (root.has("right")) root.fail("right", "is given with symmetric = true", "no such table, or symmetric = false");
    v.right = v.left;
  } else {
    v.right = read_wing(root.table("right"));
  }
  return v;
}

void mirror_left(Vehicle& v) {
  const auto mirrored = [](RigidBody b) {
    b.com_m.y = -b.com_m.y;
    b.inertia_kg_m2.xy = -b.inertia_kg_m2.xy;
    b.inertia_kg_m2.yz = -b.inertia_kg_m2.yz;
    return b;
  };
  v.right = v.left;
  v.right.shoulder_m.y = -v.right.shoulder_m.y;
  v.right.leading_edge = mirrored(v.left.leading_edge);
  v.right.wing = mirrored(v.left.wing);
  v.jointed->right = v.jointed->left;
}

/// Refuses an input that changes an angle which it cannot move.
void check_moved(const io::Table& root, const Jointed& v) {
  for (const Jointed::Input& i : v.inputs)
    for (std::size_t k = 0; k < kAngles.size(); ++k) {
      const auto any = [&](auto is) { return is(v.left.angles[k].mode) || is(v.right.angles[k].mode); };
      const auto check = [&](const std::string& key, double change, bool moves, const char* accepted) {
        if (change == 0 || moves) return;
        const std::string path = "input." + i.name + "." + key + "." + kAngles[k];
        root.fail(path, "changes an angle that it cannot move", accepted);
      };
      const bool driven = any([](Jointed::Mode m) { return m == Jointed::Mode::driven; });
      const bool held = any([](Jointed::Mode m) { return m != Jointed::Mode::free; });
      check("scale", i.scale[k], driven, "an angle that is driven");
      check("scale_opposed", i.scale_opposed[k], driven, "an angle that is driven");
      check("offset_rad", i.offset_rad[k], held, "an angle that is driven or fixed");
      check("offset_opposed_rad", i.offset_opposed_rad[k], held, "an angle that is driven or fixed");
    }
}

void check_gait(const io::Table& root, const Jointed& v) {
  check_moved(root, v);
  const auto limit = [](double x) { return "at most " + io::toml_number(x); };
  if (most(v, [](const auto& i) { return std::abs(i.timing) + std::abs(i.timing_opposed); }) > kLargestTiming)
    root.fail("input", "all timing together stops the phase", limit(kLargestTiming) + " of all inputs at their ends");
  if (most(v, [](const auto& i) { return std::abs(i.frequency); }) > 0.9)
    root.fail("input", "all together stop the beat", limit(0.9) + " of frequency of all inputs at their ends");
  for (const bool left : {true, false}) {
    if (!left && is_symmetric(root)) break;
    const Jointed::Wing& w = left ? v.left : v.right;
    for (std::size_t k = 0; k < kAngles.size(); ++k) {
      const Jointed::Angle& a = w.angles[k];
      if (a.mode == Jointed::Mode::free) {
        const std::string path = std::string(left ? "left." : "right.") + kAngles[k];
        if ((a.lower_rad != 0 || a.upper_rad != 0) && a.stop_stiffness_Nm_rad == 0 && a.stop_damping_Nm_s == 0)
          root.fail(path + (a.lower_rad != 0 ? ".lower_rad" : ".upper_rad"), "is a stop that nothing holds",
                    path + ".stop_stiffness_Nm_rad above 0, or no stop");
        continue;
      }
      const double scale =
          1 + most(v, [&](const auto& i) { return std::abs(i.scale[k]) + std::abs(i.scale_opposed[k]); });
      const double offset =
          most(v, [&](const auto& i) { return std::abs(i.offset_rad[k]) + std::abs(i.offset_opposed_rad[k]); });
      const double largest = std::abs(a.mean_rad) + scale * largest_swing(a) + offset;
      if (largest > kLargestAngle_rad)
        root.fail(std::string(left ? "left." : "right.") + kAngles[k],
                  "reaches " + io::toml_number(std::round(largest * 1e3) / 1e3) + " rad with all inputs at their ends",
                  limit(kLargestAngle_rad) + " rad either way");
    }
  }
}

std::vector<BeatAveraged::Input> mixed_inputs(const Vehicle& vehicle) {
  if (vehicle.beat_averaged) return vehicle.beat_averaged->inputs;
  if (vehicle.jointed) return {vehicle.jointed->inputs.begin(), vehicle.jointed->inputs.end()};
  return {};
}

namespace {

void add_wing(const std::string& side, const Jointed::Wing& w, const auto& line) {
  const auto list = [](const std::vector<double>& numbers) {
    std::string text = "[";
    for (const double x : numbers) text += (text.size() > 1 ? ", " : "") + io::toml_number(x);
    return text + "]";
  };
  for (std::size_t k = 0; k < kAngles.size(); ++k) {
    const std::string path = side + "." + kAngles[k] + ".";
    const Jointed::Angle& a = w.angles[k];
    line(path + "mode", io::toml_string(kModes[static_cast<int>(a.mode)]));
    if (a.mode != Jointed::Mode::driven) continue;
    line(path + "cos_rad", list(a.cos_rad));
    line(path + "sin_rad", list(a.sin_rad));
  }
  if (w.strips.empty()) return;
  const std::string path = side + ".aerodynamics.";
  std::string rows;
  for (const Jointed::Strip& s : w.strips)
    rows += (rows.empty() ? "" : ", ") + list({s.span_m, s.width_m, s.chord_m, s.leading_edge_m});
  line(path + "strips_m", "[" + rows + "]");
  line(path + "rotational_lift", io::toml_number(w.rotational_lift));
  line(path + "added_mass", io::toml_number(w.added_mass));
  line(path + "rotational_damping_coefficient", io::toml_number(w.rotational_damping_coefficient));
  if (!w.normal_sin.empty()) line(path + "normal_sin", list(w.normal_sin));
  if (!w.tangential_cos.empty()) line(path + "tangential_cos", list(w.tangential_cos));
}

}  // namespace

std::string jointed_text(const Jointed& v) {
  std::string text;
  const auto line = [&](const std::string& path, const std::string& value) { text += path + " = " + value + "\n"; };
  for (const Jointed::Input& i : v.inputs) {
    text += input_text(i);
    const auto number = [&](const std::string& key, double value) {
      if (value != 0) line("input." + i.name + "." + key, io::toml_number(value));
    };
    number("frequency", i.frequency);
    number("timing", i.timing);
    number("timing_opposed", i.timing_opposed);
    for (std::size_t k = 0; k < kAngles.size(); ++k) {
      const std::string angle = std::string(".") + kAngles[k];
      number("scale" + angle, i.scale[k]);
      number("scale_opposed" + angle, i.scale_opposed[k]);
      number("offset_rad" + angle, i.offset_rad[k]);
      number("offset_opposed_rad" + angle, i.offset_opposed_rad[k]);
    }
  }
  add_wing("left", v.left, line);
  add_wing("right", v.right, line);
  return text;
}

}  // namespace flappy::model
