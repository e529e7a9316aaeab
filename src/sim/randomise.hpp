// Randomised vehicles: a table of distributions over the parameters of a nominal vehicle.
//
//   [[randomise]]
//   parameters = ["torso.mass_kg", "torso.inertia_kg_m2"]   # one draw for all; a table stands for all parameters in it
//   law = "scale_normal"
//   sd = 0.10
//   cut_sd = 3.0                                            # draws farther out are drawn again
//   minor = true                                            # small influence: a fit may treat it as linear
//   each = true                                             # a separate draw for each of the parameters
//
// With n a normal draw and u a uniform one: scale_normal x (1 + sd n), scale_half_normal x (1 + |sd n|), replace_normal
// mean + sd n, add_normal + sd n, scale_uniform x u, replace_uniform u in [low, high]. Minor draws come after all
// others; sample() leaves them out, and they may give a body an impossible inertia to one side. Draws that are possible
// one by one, and together give a body an impossible inertia, are all drawn again.
//
// Alternatively, the posterior of a vehicle file: its parameters are drawn jointly from one normal distribution,
// whatever their nominal values, and clipped to their accepted ranges.
#pragma once

#include <vector>

#include "flappy/vehicle.hpp"
#include "io/config.hpp"
#include "sim/random.hpp"

namespace flappy::sim {

class Randomisation {
 public:
  explicit Randomisation(model::Vehicle nominal) : nominal_(std::move(nominal)) { nominal_.posterior.reset(); }

  /// Reads the array `randomise` of a configuration. Throws io::InputError if a parameter is unknown, or if a draw
  /// could leave its accepted range or give a body an impossible inertia, or if draws together nearly always do so.
  Randomisation(model::Vehicle nominal, const io::Table& config);

  /// Draws from the posterior of `vehicle`. std::invalid_argument without one, or if it is not positive semidefinite.
  static Randomisation of_posterior(model::Vehicle vehicle);

  const model::Vehicle& nominal() const { return nominal_; }
  /// The vehicle of a key: the same for the same key, whatever else is sampled.
  model::Vehicle sample(RandomKey key) const;

  /// Draws whose first parameter's path contains one of `parts` vary by a share of what they did. Not of a posterior.
  void narrow(const std::vector<std::string>& parts, double share);
  /// Number of draws; each has one variate, standard normal or uniform in [-1, 1].
  std::size_t draws() const { return draws_.size() + posterior_.size(); }
  std::size_t majors() const { return majors_ + posterior_.size(); }
  /// Variates that at() uses for minor draws if none are given. A variate that makes an inertia impossible is reduced.
  void set_minors(const std::vector<double>& variates);
  const std::vector<double>& minors() const { return minors_; }
  bool is_uniform(std::size_t draw) const;
  /// Path of the first parameter of a draw.
  std::string name(std::size_t draw) const;
  /// The vehicle with a variate for each draw, or each that is not minor. For a half-normal law, it keeps its sign.
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
  /// The vehicle of a key at the first attempt, or at the next one.
  model::Vehicle drawn(const RandomKey& key, std::uint32_t attempt) const;
  model::Vehicle from_posterior(std::vector<double> variates) const;
  static double apply(const Draw& draw, double nominal, double variate);

  /// A parameter's mean, and its row of the covariance's lower factor.
  struct Uncertain {
    std::size_t parameter;  // index in model::parameters()
    double mean;
    std::vector<double> row;
  };

  model::Vehicle nominal_;
  std::vector<Draw> draws_;
  std::size_t majors_ = 0;
  std::vector<double> minors_;
  std::vector<Uncertain> posterior_;  // empty unless of_posterior() made this; then draws_ is empty
};

/// Reads a file of [[randomise]] tables, as in configs/randomisation.
Randomisation read_randomisation(model::Vehicle nominal, const io::Table& root);

}  // namespace flappy::sim
