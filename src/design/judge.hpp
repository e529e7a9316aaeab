// Judges a robot by its figures: of its construction, of the stand, and of closed-loop flights. The flights are of many
// vehicles drawn about it, under gains that are fitted to it.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "design/stand.hpp"
#include "rollout/evaluation.hpp"

namespace flappy::design {

/// How far a design is judged. Each stage needs the one before.
enum class Stage { built, stand, hover, escape, effects };

enum class Figure {
  mass,
  lift_over_weight,
  stroke,
  gear_torque,
  stop_energy,
  winding,
  current,
  roll_authority,
  pitch_authority,
  yaw_authority,
  coupling,
  roll_bandwidth,
  pitch_bandwidth,
  yaw_bandwidth,
  hover_power,
  hover_success,
  endurance,
  escape_success,
  escape_time,
  effects_success
};
inline constexpr std::size_t kFigures = 20;
struct FigureInfo {
  const char *name, *words, *unit;
  bool more_is_better;
  Stage stage;  ///< the first that computes it
};
const FigureInfo& info_of(Figure figure);
/// Whether the figure is a share of the drawn vehicles, whose changes are counted in points.
bool is_share(Figure figure);
std::optional<Figure> figure_named(const std::string& name);

/// [figure]; NaN where it was not computed.
using Figures = std::array<double, kFigures>;
inline double& figure_of(Figures& f, Figure which) { return f[static_cast<std::size_t>(which)]; }
inline double figure_of(const Figures& f, Figure which) { return f[static_cast<std::size_t>(which)]; }

struct Judged {
  Robot robot;
  flight::Controller controller;
  Figures figures;
  std::string refused;  ///< why the design was not judged to the end; empty: it was
  Stage reached = Stage::built;
  double flown_s = 0;  ///< flapper-seconds
};

/// A demand that a design has to meet.
struct Limit {
  Figure figure;
  double at_least, at_most;  ///< infinite: no limit
};

struct JudgeConfig {
  Space space;
  rollout::FlyConfig hover, escape;  ///< both tasks define success
  std::size_t hover_flights = 0, escape_flights = 0, effect_flights = 0;
  std::vector<Limit> limits;
};

class Judge {
 public:
  explicit Judge(JudgeConfig config);

  const JudgeConfig& config() const { return config_; }
  /// Judges on one thread, up to a stage, or up to the first limit that is not met.
  Judged judge(const Values& values, Stage upto) const { return judged(values, upto, false); }
  /// Judges the published robot up to a stage. Limits that it misses are in `refused`, and do not end it.
  Judged judge_published(Stage upto) const { return judged(config_.space.built, upto, true); }
  /// The flights of a robot with a controller: `which` is the configuration's hover or escape.
  rollout::FlyConfig flights(const rollout::FlyConfig& which, const Robot& robot,
                             const flight::Controller& controller) const;
  /// The gains of the configuration's controller, which were tuned on the built robot, scaled so that with the moments
  /// and inertias of this one errors lead to the same accelerations.
  flight::Controller fitted(const Robot& robot, const Stand& stand) const;
  /// Flies hovers or escapes, as `stage` says, and puts their figures and the time flown into `into`.
  void fly(const rollout::FlyConfig& config, std::size_t count, std::uint32_t first_flapper, Stage stage,
           Judged& into) const;

 private:
  Judged judged(const Values& values, Stage upto, bool past_limits) const;
  bool allowed(Judged& judged, Stage stage, bool past_limits) const;

  JudgeConfig config_;
  Stand built_;  ///< what the stand measures of the published robot
};

}  // namespace flappy::design
