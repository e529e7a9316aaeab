// How much the quantities of a beat-averaged robot (quantities.hpp) differ from session to session while nothing is
// done to the robot. A contrast compares a change with these differences. For a quantity with means x_1 ... x_n in the
// n reference sessions of the robot,
//   x ~ N(m, s^2 R)    scatter and a random walk (session_walk.hpp) with r = drift^2 / s_0^2
//   s^2 ~ scaled inverse chi-squared(nu, s_0^2)    includes the noise of the flights
//   y ~ t_n'(m_t, s^2 c + v)    value in another session of the unchanged robot, at time t; m_t, c: session_walk.hpp
//   n' = nu + n - 1, at most most_freedom
//   v: variance of y due to noise less that of the references, at least 0
// s_0, drift and nu are learnt from other robots (learn_scatter.hpp) and stand in
// configs/gap/beat_averaged/session_scatter.toml (Gelman et al., Bayesian Data Analysis, 3rd ed., ch. 3.2 and 5.4).
#pragma once

#include <map>

#include "gap/session/quantities.hpp"
#include "gap/session/session_walk.hpp"

namespace flappy::gap {

/// What is believed before the robot's own sessions are seen: configs/gap/beat_averaged/session_scatter.toml.
struct SessionPrior {
  struct Block {
    double scatter;  ///< s_0 without noise of flights, in the quantity's unit
    double drift;    ///< standard deviation of the walk from one session to the next, or in a day, in the same unit
    double unknown;  ///< standard deviation of the change by a cause that is not in the catalogue, in the same unit
    double leak;     ///< probability that these quantities change as well if others change by their `unknown` or more
  };
  std::map<std::string, Block> blocks;  ///< by SessionQuantity::block
  double freedom = 0;                   ///< nu: for how many sessions of the robot s_0 counts
  double most_freedom = 0;              ///< largest n'
  double share_of_noise = 0;  ///< s_0^2 also includes (this share * standard deviation due to noise of flights)^2
  /// Prior probabilities that the robot is unchanged, has an effect, or has an unknown cause; their sum is 1.
  /// further_effect: that of any second effect, given a first.
  double unchanged = 0, effect = 0, unknown = 0, further_effect = 0;
  /// Prior probability of the second of two effects, given the first, in place of further_effect. Key: both names
  /// joined by _, in alphabetical order.
  std::map<std::string, double> together;
  /// Prior probability of a second effect `b`, given `a`. `effects`: number of effects that may be the second.
  double further(const std::string& a, const std::string& b, std::size_t effects) const;
  const Block& of(const SessionQuantity& quantity) const { return blocks.at(quantity.block); }
  /// s_0^2: variance between sessions before any is seen. `noise`: variance due to the noise of the flights.
  double variance(const SessionQuantity& quantity, double noise) const;
};
/// io::InputError with file and line for what is not accepted; probabilities have to add up to 1.
SessionPrior read_session_prior(const std::filesystem::path& path);

/// Sessions of one robot: means of their flights, weighted by flight_shares(), and variances of these means due to
/// noise.
struct SessionValues {
  Eigen::MatrixXd values, variances;  ///< [session][quantity]
};

/// [flight][quantity] Weight of each flight in the mean of these flights; those of a quantity add up to 1.
Eigen::MatrixXd flight_shares(const std::vector<FlightQuantities>& flights, const SessionPrior& prior);
/// `of`: [flight] number of its session, from 0 on; each session has a flight.
SessionValues session_values(const std::vector<FlightQuantities>& flights, const std::vector<int>& of,
                             const SessionPrior& prior);

/// m_t, s^2 and s^2 c of the equations above; t: time of the tests. All vectors are [quantity].
class SessionScatter {
 public:
  SessionScatter(const std::vector<SessionQuantity>& quantities, const SessionValues& references,
                 const SessionTimes& times, const SessionPrior& prior);
  const std::vector<SessionQuantity>& quantities() const { return quantities_; }
  /// m_t: the expected values of the unchanged robot at the time of the tests.
  const Eigen::VectorXd& mean() const { return mean_; }
  /// s^2: variance between sessions at one time.
  const Eigen::VectorXd& variance() const { return variance_; }
  /// s^2 c: variance about mean() of a session at the time of the tests.
  const Eigen::VectorXd& variance_of_next() const { return variance_of_next_; }
  /// Mean over the reference sessions of the variance due to noise of their flights; it is part of variance().
  const Eigen::VectorXd& noise() const { return noise_; }
  double freedom() const { return freedom_; }  ///< n'

 private:
  std::vector<SessionQuantity> quantities_;
  Eigen::VectorXd mean_, variance_, variance_of_next_, noise_;
  double freedom_;
};

/// Log density of the quantities of a further session: a sum over blocks, each with Student's t of several dimensions.
class SessionDensity {
 public:
  /// `values`, `variances`: [quantity] of the further session, as in SessionValues.
  SessionDensity(const SessionScatter& scatter, const Eigen::VectorXd& values, const Eigen::VectorXd& variances,
                 const SessionPrior& prior);
  /// [quantity] The values of the session less SessionScatter::mean().
  const Eigen::VectorXd& difference() const { return difference_; }
  /// [quantity] s^2 c + v: variance of this difference if nothing changed.
  const Eigen::VectorXd& variance() const { return variance_; }
  double freedom() const { return freedom_; }
  /// `shift`: [quantity] what a cause adds to the values; `more`: [quantity] additional variance, for causes whose
  /// shift is not known. A robot that changed much flies differently. Then errors of the model that are the same in all
  /// flights no longer cancel, and the change may leak into other quantities, so a large shift widens the density.
  double log_density(const Eigen::VectorXd& shift, const Eigen::VectorXd& more) const;
  /// [quantity] Precision of the normal distribution whose log density has the same slope at this shift.
  Eigen::VectorXd precision(const Eigen::VectorXd& shift, const Eigen::VectorXd& more) const;
  /// [block] Indices of the block's quantities.
  const std::vector<std::vector<Eigen::Index>>& blocks() const { return blocks_; }

 private:
  Eigen::VectorXd difference_, variance_;
  Eigen::VectorXd noise_;    ///< variance due to noise: of the session plus mean of the references
  Eigen::VectorXd unknown_;  ///< standard deviation of what an unknown cause does
  Eigen::VectorXd leak_;     ///< probability that a large change of others leaks into this quantity
  double freedom_;
  std::vector<std::vector<Eigen::Index>> blocks_;
  /// How large a shift is, from 0 to 1; 1: as large as that of an unknown cause, or larger.
  double size_of(const Eigen::VectorXd& shift) const;
  /// Log density of a block, and the precision of its quantities.
  double block_density(const std::vector<Eigen::Index>& block, const Eigen::VectorXd& shift,
                       const Eigen::VectorXd& variance, Eigen::VectorXd* precision) const;
};

}  // namespace flappy::gap
