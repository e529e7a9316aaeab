// Randomised vehicles: a table of distributions over the parameters of a nominal vehicle.
//
//   [[randomise]]
//   parameters = ["torso.mass_kg", "torso.inertia_kg_m2"]   # one draw for all; a table stands for all below it
//   law = "scale_normal"
//   sd = 0.10
//   cut_sd = 3.0                                            # draws farther out are drawn again
//   minor = true                                            # changes little: who fits a vehicle takes it as linear
//   each = true                                             # a draw for each of the parameters, instead of one for all
//
// With n a normal draw and u a uniform one: scale_normal x (1 + sd n), scale_half_normal x (1 + |sd n|),
// replace_normal mean + sd n, add_normal + sd n, scale_uniform x u, replace_uniform u in [low, high].
//
// Minor draws stand behind all others. No vehicle is drawn by them, and a body may become one that no body is, on one side.
//
// Or the posterior of a vehicle file: its parameters are drawn together from one normal distribution, whatever their
// nominal figures, and kept within their accepted ranges.
#pragma once

#include <vector>

#include "flappy/vehicle.hpp"
#include "io/config.hpp"
#include "sim/random.hpp"

namespace flappy::sim {

class Randomisation {
 public:
  /// No randomisation: every vehicle is the nominal one.
  explicit Randomisation(model::Vehicle nominal) : nominal_(std::move(nominal)) { nominal_.posterior.reset(); }

  /// Reads the array `randomise` of a configuration. io::InputError where a parameter is unknown, or a draw could
  /// leave its accepted range or give a body an inertia that no body has.
  Randomisation(model::Vehicle nominal, const io::Table& config);

  /// Draws from the posterior of `vehicle`, which it must have; std::invalid_argument where its covariance is none.
  static Randomisation of_posterior(model::Vehicle vehicle);

  const model::Vehicle& nominal() const { return nominal_; }
  /// The vehicle of this key: the same for the same key, whatever else was sampled.
  model::Vehicle sample(RandomKey key) const;

  /// Draws of the table; each has one variate, standard normal or uniform in [-1, 1].
  std::size_t draws() const { return draws_.size() + posterior_.size(); }
  /// Those before the minor ones.
  std::size_t majors() const { return majors_ + posterior_.size(); }
  /// Minor variates of `at` where none are given; one that makes a body none is drawn in.
  void set_minors(const std::vector<double>& variates);
  const std::vector<double>& minors() const { return minors_; }
  bool is_uniform(std::size_t draw) const;
  /// Path of its first parameter.
  std::string name(std::size_t draw) const;
  /// The vehicle of given variates, one for each draw, or each but the minor ones; a half-normal law takes the sign of its own.
  model::Vehicle at(const std::vector<double>& variates) const;

 private:
  enum class Law { scale_normal, scale_half_normal, replace_normal, add_normal, scale_uniform, replace_uniform };
  struct Draw {
    std::vector<std::size_t> parameters;  // index in model::parameters()
    Law law;
    double a, b;  // mean and sd, or low and high
    double cut_sd;
    bool minor;
  };
  struct Reach {
    double low, high;
  };
  static Draw read_draw(const io::Table& table, const std::vector<model::Parameter>& parameters);
  static void check_reach(const io::Table& table, const Draw& draw, const std::vector<model::Parameter>& parameters,
                          std::vector<Reach>& reach);
  void check_bodies(const io::Table& table, const Draw& draw) const;
  model::Vehicle from_posterior(std::vector<double> variates) const;
  static double apply(const Draw& draw, double nominal, double variate);

  /// A parameter's mean, and what the variates up to its own add.
  struct Uncertain {
    std::size_t parameter;  // index in model::parameters()
    double mean;
    std::vector<double> row;
  };

  model::Vehicle nominal_;
  std::vector<Draw> draws_;
  std::size_t majors_ = 0;
  std::vector<double> minors_;
  std::vector<Uncertain> posterior_;  // one or the other
};

/// Reads all of a file of [[randomise]] tables, as configs/randomisation has them.
Randomisation read_randomisation(model::Vehicle nominal, const io::Table& root);

}  // namespace flappy::sim
