#include "flight/task.hpp"

#include <algorithm>
#include <cmath>

#include "io/csv.hpp"

namespace flappy::flight {
namespace {

constexpr double kFar = 1e9;

struct PartInfo {
  const char* name;
  const char* frame;
  std::vector<Signal> signals;
  const char* positive = "";
};

/// Signals of each Part, in bit order; previous_action's are added from the task's action. Ranges of a flying vehicle.
const std::vector<PartInfo>& part_infos() {
  static const std::vector<PartInfo> infos = [] {
    std::vector<PartInfo> list = {
        {"rotation_matrix", "B in W", {}},
        {"position_error",
         "W",
         {{"x_error", "m", -1, 1}, {"y_error", "m", -1, 1}, {"z_error", "m", -1, 1}},
         "estimate beyond the set point along the axis"},
        {"velocity",
         "W",
         {{"x_velocity", "m/s", -3, 3}, {"y_velocity", "m/s", -3, 3}, {"z_velocity", "m/s", -3, 3}},
         "estimate less set point, along the axis"},
        {"body_rate",
         "B",
         {{"roll_rate", "rad/s", -50, 50}, {"pitch_rate", "rad/s", -50, 50}, {"yaw_rate", "rad/s", -50, 50}},
         "right-handed about x, y, z: right side down, nose down, nose to the left"},
        {"beat_phase", "", {{"beat_sin", "1", -1, 1}, {"beat_cos", "1", -1, 1}}, "of the phase, 0 where a beat begins"},
        {"heading_error",
         "about z of W",
         {{"heading_sin", "1", -1, 1}, {"heading_cos", "1", -1, 1}},
         "of the estimate's heading less the set point's; nose to the left of it"},
        {"previous_action", "", {}},
        {"goal_rotation", "B in the goal's heading frame", {}},
        {"time", "", {{"time", "s", 0, 1}}},
        {"trim", "", {}},
        {"wings",
         "",
         {{"left_stroke", "rad", -1.6, 1.6},
          {"right_stroke", "rad", -1.6, 1.6},
          {"left_stroke_rate", "rad/s", -300, 300},
          {"right_stroke_rate", "rad/s", -300, 300}},
         "wing backward"}};
    for (const char* row : {"x", "y", "z"})
      for (const char* column : {"x", "y", "z"})
        for (const auto& [part, name] :
             {std::pair{Part::rotation_matrix, "R_"}, std::pair{Part::goal_rotation, "goal_R_"}})
          list[static_cast<std::size_t>(part)].signals.push_back({name + std::string(row) + column, "1", -1, 1});
    const char* inputs[] = {"amplitude", "difference", "bias", "split_cycle"};
    const double trim_high[] = {18, 3, 3.5, 0.15};
    for (int i = 0; i < 4; ++i) {
      list[9].signals.push_back(
          {std::string("trim_") + inputs[i], i < 3 ? "V" : "1", i > 0 ? -trim_high[i] : 0, trim_high[i]});
    }
    for (PartInfo& info : list)
      for (Signal& s : info.signals) s.frame = info.frame, s.positive = info.positive;
    return list;
  }();
  return infos;
}

/// Quintic from rest to rest (minimum-jerk trajectory).
Segment<double> rest_to_rest(std::uint32_t start_tick, double duration_s, const double (&from)[4],
                             const double (&to)[4]) {
  Segment<double> s{start_tick, {}};
  const double d3 = duration_s * duration_s * duration_s;
  for (int c = 0; c < 4; ++c) {
    const double way = to[c] - from[c];
    const double a[6] = {
        from[c], 0, 0, 10 * way / d3, -15 * way / (d3 * duration_s), 6 * way / (d3 * duration_s * duration_s)};
    std::copy(a, a + 6, s.coefficients[c]);
  }
  return s;
}

Segment<double> hold(std::uint32_t start_tick, const double (&at)[4]) {
  Segment<double> s{start_tick, {}};
  for (int c = 0; c < 4; ++c) s.coefficients[c][0] = at[c];
  return s;
}

struct Knot {
  std::uint32_t tick;
  double at[4];
};

/// Knot velocities of coordinate `c` of the cubic spline through the knots, at rest at its ends.
std::vector<double> spline_velocities(const std::vector<Knot>& knots, int c, double tick_s) {
  const std::size_t n = knots.size();
  std::vector<double> v(n, 0), upper(n, 0);
  // tridiagonal: v[i-1]/h0 + 2 (1/h0 + 1/h1) v[i] + v[i+1]/h1 = 3 (d0/h0^2 + d1/h1^2)
  for (std::size_t i = 1; i + 1 < n; ++i) {
    const double h0 = tick_s * (knots[i].tick - knots[i - 1].tick), h1 = tick_s * (knots[i + 1].tick - knots[i].tick);
    const double d0 = knots[i].at[c] - knots[i - 1].at[c], d1 = knots[i + 1].at[c] - knots[i].at[c];
    const double pivot = 2 * (1 / h0 + 1 / h1) - upper[i - 1] / h0;
    upper[i] = 1 / h1 / pivot;
    v[i] = (3 * (d0 / (h0 * h0) + d1 / (h1 * h1)) - v[i - 1] / h0) / pivot;
  }
  for (std::size_t i = n; i-- > 1;)
    if (i + 1 < n) v[i] -= upper[i] * v[i + 1];
  return v;
}

std::vector<Segment<double>> spline(const std::vector<Knot>& knots, double tick_s) {
  std::vector<Segment<double>> path;
  for (std::size_t i = 0; i + 1 < knots.size(); ++i) path.push_back({knots[i].tick, {}});
  for (int c = 0; c < 4; ++c) {
    const std::vector<double> v = spline_velocities(knots, c, tick_s);
    for (std::size_t i = 0; i + 1 < knots.size(); ++i) {
      const double h = tick_s * (knots[i + 1].tick - knots[i].tick), d = (knots[i + 1].at[c] - knots[i].at[c]) / h;
      const double a[6] = {
          knots[i].at[c], v[i], (3 * d - 2 * v[i] - v[i + 1]) / h, (v[i] + v[i + 1] - 2 * d) / (h * h), 0, 0};
      std::copy(a, a + 6, path[i].coefficients[c]);
    }
  }
  path.push_back(hold(knots.back().tick, knots.back().at));
  return path;
}

std::vector<Segment<double>> read_path(const io::Table& table, double tick_s) {
  constexpr io::Range kPlace{-1e4, 1e4}, kHeading{-100, 100};
  constexpr double kLongest_s = 1e5;
  std::vector<Knot> knots;
  const auto add = [&](double t_s, double x, double y, double z, double heading, const auto& refuse) {
    const auto tick = static_cast<std::uint32_t>(std::lround(t_s / tick_s));
    if (!knots.empty() && tick <= knots.back().tick) refuse();
    knots.push_back({tick, {x, y, z, heading}});
  };
  const std::string kind = table.choice("path.kind", {"waypoints", "file"});
  if (kind == "waypoints") {
    for (const io::Table& p : table.tables("path.waypoint"))
      add(p.number("t_s", {0, kLongest_s}), p.number("x_m", kPlace), p.number("y_m", kPlace), p.number("z_m", kPlace),
          p.number_or("heading_rad", 0, kHeading),
          [&] { p.fail("t_s", "is not after the one before", "times that increase"); });
    if (knots.empty()) table.fail("path", "has no waypoint", "at least one [[path.waypoint]]");
    if (knots[0].tick != 0) table.fail("path", "does not start at t_s = 0", "a first waypoint at 0");
    std::vector<Segment<double>> path;
    for (std::size_t i = 0; i + 1 < knots.size(); ++i)
      path.push_back(
          rest_to_rest(knots[i].tick, tick_s * (knots[i + 1].tick - knots[i].tick), knots[i].at, knots[i + 1].at));
    path.push_back(hold(knots.back().tick, knots.back().at));
    return path;
  }
  const io::CsvTable csv = io::read_csv(table.file("path.file"));
  const auto &t = csv.column("t_s"), &x = csv.column("x_m"), &y = csv.column("y_m"), &z = csv.column("z_m"),
             &heading = csv.column("heading_rad");
  for (std::size_t i = 0; i < t.size(); ++i) {
    const auto refuse = [&](const std::string& what) {
      throw io::InputError(csv.name + ":" + std::to_string(i + 2) + ": " + what);
    };
    if (!(t[i] >= 0 && t[i] <= kLongest_s)) refuse("t_s is out of range; accepted: 0 to 100000");
    for (const double place : {x[i], y[i], z[i]})
      if (!(std::abs(place) <= kPlace.high)) refuse("a place is out of range; accepted: -10000 to 10000");
    if (!(std::abs(heading[i]) <= kHeading.high)) refuse("heading_rad is out of range; accepted: -100 to 100");
    add(t[i], x[i], y[i], z[i], heading[i],
        [&] { refuse("t_s is not a control period after the one before; accepted: times that increase"); });
  }
  if (knots.size() < 2 || knots[0].tick != 0)
    throw io::InputError(csv.name + ": is no path; accepted: at least two rows, the first at t_s = 0");
  return spline(knots, tick_s);
}

void read_spread(const io::Table& table, const std::string& key, Spread (&to)[3]) {
  const auto part = table.optional_table(key);
  if (!part) return;
  const char* names[3] = {"x", "y", "z"};
  for (int i = 0; i < 3; ++i) {
    to[i].centre = part->number_or(names[i], 0, {-1e4, 1e4});
    to[i].half = part->number_or(std::string(names[i]) + "_half", 0, {0, 1e4});
  }
}

StartRange read_start(const io::Table& table) {
  StartRange s;
  s.kind = sim::Start::flying;
  const std::string kind = table.choice("start.kind", {"standing", "flying", "settled"});
  if (kind == "standing") s.kind = sim::Start::standing;
  s.settled = kind == "settled";
  read_spread(table, "start.position_m", s.position_m);
  read_spread(table, "start.rotation_rad", s.rotation_rad);
  read_spread(table, "start.velocity_m_s", s.velocity_m_s);
  read_spread(table, "start.body_rate_rad_s", s.body_rate_rad_s);
  s.x_low_m = table.number_or("start.x_low_m", -kFar, {-kFar, kFar});
  s.x_high_m = table.number_or("start.x_high_m", kFar, {s.x_low_m, kFar});
  return s;
}

Reward<double> read_reward(const io::Table& table) {
  Reward<double> r{};
  const auto weight = [&](const char* name) { return table.number_or(std::string("reward.") + name, 0, {-1e6, 1e6}); };
  r.action = weight("action");
  r.action_change = weight("action_change");
  r.position = weight("position_1_m");
  r.angles = weight("angles_1_rad");
  r.velocity = weight("velocity_s_m");
  r.body_rate = weight("body_rate_s_rad");
  r.inverse_square = weight("inverse_square");
  r.cost = weight("cost");
  r.facing = weight("facing");
  r.upright = weight("upright");
  r.behind = weight("behind_1_m");
  r.behind_m = weight("behind_m");
  r.alive = weight("alive");
  r.level = weight("level");
  r.near = weight("near");
  r.goal = weight("goal");
  r.arrival = weight("arrival");
  r.kept = weight("kept");
  r.until_s = table.number_or("reward.until_s", 0, {0, 1e6});
  if (r.kept != 0 && r.until_s == 0)
    table.fail("reward.kept", "is never paid without until_s", "reward.until_s, s, the time at which it is paid");
  const auto per = [&](const char* name) {
    return 1 / table.number_or(std::string("reward.") + name, kFar, io::positive());
  };
  r.near_1_m = per("near_m");
  r.goal_1_m = per("goal_m");
  r.goal_s_m = per("goal_m_s");
  r.goal_s_rad = per("goal_rad_s");
  r.goal_1_tilt = per("goal_tilt_rad");
  r.goal_1_heading = per("goal_heading_rad");
  return r;
}

/// Cosine of the largest angle allowed; -2, which excludes nothing, for angles above pi.
double cosine_limit(double angle_rad) { return angle_rad > std::numbers::pi ? -2 : model::sin_cos_wide(angle_rad).cos; }

void read_hand_back(const io::Table& table, HandBack<double>& h) {
  h = {0, 0, -kFar, kFar, kFar, kFar, -2, -2, kFar, kFar, 0, 0};
  const auto t = table.optional_table("hand_back");
  if (!t) return;
  const auto bound = [&](const std::string& name, double otherwise) {
    const bool is_place = name == "x_m" || name == "speed_x_m_s";
    return t->number_or(name, otherwise, {is_place ? -kFar : 0, kFar});
  };
  const std::string on = t->choice_or("on", "truth", {"truth", "estimate"});
  h = {1,
       on == "estimate" ? 1.0 : 0.0,
       bound("x_m", -kFar),
       bound("distance_m", kFar),
       bound("speed_x_m_s", kFar),
       bound("speed_m_s", kFar),
       cosine_limit(bound("heading_rad", 4)),
       cosine_limit(bound("tilt_rad", 4)),
       bound("body_rate_rad_s", kFar),
       bound("at_s", kFar),
       t->boolean_or("touching", false) ? 1.0 : 0.0,
       t->choice_or("to", "controller", {"controller", "rest"}) == "rest" ? 1.0 : 0.0};
}

void read_success(const io::Table& table, Success<double>& s) {
  const auto t = table.optional_table("success");
  if (!t) return;  // all bounds are 0: the goal is never captured
  const auto angle = [&](const char* name) { return cosine_limit(t->number(name, io::positive(4))); };
  s = {t->number("capture.by_s", io::positive()),
       t->number("capture.distance_m", io::positive()),
       t->number("capture.speed_m_s", io::positive()),
       t->number("capture.body_rate_rad_s", io::positive()),
       angle("capture.tilt_rad"),
       angle("capture.heading_rad"),
       t->number("keep.from_s", io::non_negative()),
       t->number("keep.until_s", {t->number("keep.from_s", io::non_negative()), kFar}),
       t->number("keep.distance_m", io::positive()),
       angle("keep.tilt_rad"),
       angle("keep.heading_rad"),
       t->boolean_or("capture.touching", false) ? 1.0 : 0.0};
}

void read_action(const io::Table& table, Task& task) {
  const bool voltages = table.choice_or("action.kind", "wing_beat", {"wing_beat", "voltages"}) == "voltages";
  task.action_kind = voltages ? ActionKind::voltages : ActionKind::wing_beat;
  const std::vector<std::string> keys =
      voltages ? std::vector<std::string>{"left_V", "right_V"}
               : std::vector<std::string>{"amplitude_V", "difference_V", "bias_V", "split_cycle"};
  for (std::size_t i = 0; i < keys.size(); ++i) {
    const std::string key = "action." + keys[i];
    const std::vector<double> range = table.numbers(key, voltages ? io::Range{-1000, 1000} : io::Range{-18, 18});
    if (range.size() != 2 || range[0] > range[1])
      table.fail(key, "is no range",
                 voltages ? "[low, high]: the voltages of -1 and 1" : "[low, high]: what -1 and 1 add");
    task.constants.action_low[i] = range[0];
    task.constants.action_high[i] = range[1];
  }
}

/// Throws io::InputError if a task with voltages needs a controller or a wing beat.
void refuse_control(const io::Table& table, const Task& task) {
  const std::string alone = ", but an action of kind \"voltages\" has no controller";
  if (task.constants.holds_trim > 0) table.fail("base", "is \"trim\"" + alone, "no base, or \"controller\"");
  if (table.has("hand_back")) table.fail("hand_back", "is given" + alone, "a task without it");
  if (task.start.settled) table.fail("start.kind", "is \"settled\"" + alone, "\"flying\" or \"standing\"");
  for (const Part part : {Part::trim, Part::beat_phase})
    if (task.parts >> static_cast<int>(part) & 1)
      table.fail("observation",
                 std::string(part_infos()[static_cast<std::size_t>(part)].name) +
                     " belongs to a controller or a wing beat, and an action of kind \"voltages\" has neither",
                 "other parts; \"wings\" shows where the strokes are");
}

}  // namespace

std::vector<std::pair<std::string, std::vector<Signal>>> Task::observed_parts() const {
  std::vector<std::pair<std::string, std::vector<Signal>>> list;
  for (std::size_t i = 0; i < part_infos().size(); ++i) {
    if (!(parts >> i & 1)) continue;
    list.emplace_back(part_infos()[i].name, part_infos()[i].signals);
    if (static_cast<Part>(i) == Part::trim)
      for (Signal& s : list.back().second)
        if (s.unit == "V") s.unit = input_unit;
    if (static_cast<Part>(i) != Part::previous_action) continue;
    for (Signal s : action()) {
      s.name = (sets_voltages() ? "previous_" : "added_") + s.name;
      list.back().second.push_back(s);
    }
  }
  return list;
}

std::vector<Signal> Task::observation() const {
  std::vector<Signal> list;
  for (std::uint32_t ago = 0; ago < history; ++ago)
    for (const auto& [part, signals] : observed_parts())
      for (Signal s : signals) {
        if (ago > 0) s.name += "_" + std::to_string(ago) + "_ago";
        list.push_back(s);
      }
  return list;
}

std::vector<Signal> Task::action() const {
  static constexpr const char* kInputs[] = {"amplitude", "difference", "bias", "split_cycle"};
  static constexpr const char* kVoltages[] = {"left_voltage", "right_voltage"};
  static constexpr const char* kPositive[] = {"both voltages swing wider", "left swings wider, right less",
                                              "both voltages higher", "left falls faster than it rises, right slower"};
  std::vector<Signal> list;
  for (int i = 0; i < actions(); ++i)
    list.push_back({sets_voltages() ? kVoltages[i] : kInputs[i], i < 3 ? input_unit : "1", constants.action_low[i],
                    constants.action_high[i], "",
                    sets_voltages()     ? "wing backward"
                    : input_unit == "V" ? kPositive[i]
                                        : ""});
  return list;
}

void Task::forbid_actions() {
  std::ranges::fill(constants.action_low, 0);
  std::ranges::fill(constants.action_high, 0);
  action_late_most = 0;
}

sim::FlapperState Task::sample_start(sim::RandomKey key) const {
  key.stream = sim::Stream::start;
  std::uint32_t index = 0;
  const auto sampled = [&](const Spread& s) {
    return s.centre + s.half * (2 * sim::uniform_pair(key, index++).first - 1);
  };
  sim::FlapperState s;
  double turn[3];
  for (int i = 0; i < 3; ++i) s.position_m[i] = sampled(start.position_m[i]);
  for (int i = 0; i < 3; ++i) turn[i] = sampled(start.rotation_rad[i]);
  for (int i = 0; i < 3; ++i) s.velocity_m_s[i] = sampled(start.velocity_m_s[i]);
  for (int i = 0; i < 3; ++i) s.body_rate_rad_s[i] = sampled(start.body_rate_rad_s[i]);
  s.position_m[0] = std::clamp(s.position_m[0], start.x_low_m, start.x_high_m);
  const double angle = std::sqrt(turn[0] * turn[0] + turn[1] * turn[1] + turn[2] * turn[2]);
  const auto half = model::sin_cos_wide(angle / 2);
  s.attitude[0] = half.cos;
  for (int i = 0; i < 3; ++i) s.attitude[i + 1] = angle > 0 ? half.sin * turn[i] / angle : 0;
  return s;
}

Task read_task(const io::Table& table, double tick_s) {
  table.schema(1);
  table.accept({"schema", "name", "start", "path", "observation", "history", "action", "reward", "end", "base",
                "hand_back", "success"});
  Task task;
  task.name = table.string("name");
  task.start = read_start(table);
  task.path = read_path(table, tick_s);

  std::vector<std::string> names;
  for (const PartInfo& info : part_infos()) names.emplace_back(info.name);
  for (const std::string& name : table.strings("observation")) {
    const auto found = std::ranges::find(names, name);
    if (found == names.end())
      table.fail("observation", "no part \"" + name + "\"", io::joined(names) + io::did_you_mean(name, names));
    const auto bit = std::uint32_t{1} << (found - names.begin());
    if (task.parts & bit) table.fail("observation", name + " is given twice", "each part once");
    task.parts |= bit;
  }

  task.history = static_cast<std::uint32_t>(table.integer_or("history", 1, 1, kMaxHistory));

  read_action(table, task);
  std::size_t numbers = 0;
  for (const auto& part : task.observed_parts()) numbers += part.second.size();
  if (numbers > kMaxObservation)
    table.fail("observation", "has " + std::to_string(numbers) + " numbers",
               "parts of at most " + std::to_string(kMaxObservation));
  TaskConstants<double>& k = task.constants;
  const auto periods = [&](const char* key, double seconds) {
    const auto count = static_cast<std::uint32_t>(std::lround(seconds / tick_s));
    if (std::abs(seconds / tick_s - count) > 1e-6)
      table.fail(key, "is no whole number of control periods", "n x " + io::shortest_digits(tick_s) + " s");
    return count;
  };
  task.action_repeat = periods("action.repeat_s", table.number_or("action.repeat_s", tick_s, {tick_s, 1}));
  task.action_late_most = periods("action.jitter_s", table.number_or("action.jitter_s", 0, io::non_negative(1)));
  if (task.action_late_most >= task.action_repeat)
    table.fail("action.jitter_s", "lets an action come after the next one",
               "less than action.repeat_s, " + io::shortest_digits(task.action_repeat * tick_s) + " s");
  k.reward = read_reward(table);

  const auto limit = [&](const std::string& name, double otherwise) {
    const bool is_size = name == "y_m" || name == "z_m" || name == "distance_m";
    return table.number_or("end." + name, otherwise, {is_size ? 0 : -kFar, kFar});
  };
  task.says_contact = table.has("end.contact");
  k.contact_ends = !task.says_contact || table.boolean("end.contact") ? 1 : 0;
  k.limits = {table.number("end.time_s", {tick_s, 1e6}),
              limit("x_low_m", -kFar),
              limit("x_high_m", kFar),
              limit("y_m", kFar),
              limit("z_m", kFar),
              limit("distance_m", kFar),
              limit("faced_by_s", kFar),
              limit("arrived_by_s", kFar),
              limit("arrived_x_m", -kFar)};

  // "trim": before the hand-back, the controller's output is its learnt trim
  k.holds_trim = table.choice_or("base", "controller", {"controller", "trim"}) == "trim" ? 1 : 0;
  read_hand_back(table, k.hand_back);
  read_success(table, k.success);
  if (task.sets_voltages()) refuse_control(table, task);
  table.finish();
  return task;
}

}  // namespace flappy::flight
