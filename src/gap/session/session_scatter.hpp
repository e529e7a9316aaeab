// How much the quantities of a beat-averaged robot (quantities.hpp) differ from session to session while nothing is
// done to the robot. The yardstick of a contrast is the robot itself: of a quantity with session means x_1 ... x_n,
//   x ~ N(m, s^2 R)    a random walk and scatter (session_walk.hpp), r = drift^2 / s_0^2
//   s^2, noise of the flights included, ~ scaled inverse chi-squared(nu, s_0^2)
//   y ~ t_n'(m_t, s^2 c + v)    what another session of the unchanged robot shows at its time t
//   n' = nu + n - 1, at most most_freedom; v: by how much the variance of y by noise exceeds the references', at least 0
// s_0, drift and nu are those of other robots (configs/gap/beat_averaged/session_scatter.toml), which learn_scatter.hpp
// learns (Gelman et al., Bayesian Data Analysis, 3rd ed., ch. 3.2 and 5.4).
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
    double leak;     ///< probability that these quantities change, too, if others change by as much as their `unknown`
  };
  std::map<std::string, Block> blocks;  ///< by SessionQuantity::block
  double freedom = 0;                   ///< nu: for how many sessions of the robot s_0 counts
  double most_freedom = 0;              ///< largest n'
  double share_of_noise = 0;  ///< share of the noise of flights, as a standard deviation, that s_0 has besides
  /// Prior probabilities of what may have happened, of sum 1; then that of any second effect besides a first.
  double unchanged = 0, effect = 0, unknown = 0, further_effect = 0;
  std::map<std::string, double> together;  ///< in place of further_effect, by two effects in the order of their names
  /// Prior probability of a second effect `b` besides `a`. `effects`: number of effects that may be the second.
  double further(const std::string& a, const std::string& b, std::size_t effects) const;
  const Block& of(const SessionQuantity& quantity) const { return blocks.at(quantity.block); }
  /// s_0^2: variance between sessions before any is seen. `noise`: variance by the noise of the flights.
  double variance(const SessionQuantity& quantity, double noise) const;
};
/// io::InputError with file and line for what is not accepted; probabilities have to add up to 1.
SessionPrior read_session_prior(const std::filesystem::path& path);

/// Sessions of one robot: means of their flights, weighted by what each flight shows, and variances of these means by
/// noise.
struct SessionValues {
  Eigen::MatrixXd values, variances;  ///< [session][quantity]
};

/// [flight][quantity] Weight of each flight in the mean of these flights; those of a quantity add up to 1.
Eigen::MatrixXd flight_shares(const std::vector<FlightQuantities>& flights, const SessionPrior& prior);
/// `of`: [flight] number of its session, from 0 on; each session has a flight.
SessionValues session_values(const std::vector<FlightQuantities>& flights, const std::vector<int>& of,
                             const SessionPrior& prior);

/// m and s^2 of the equations above; all vectors are [quantity].
class SessionScatter {
 public:
  SessionScatter(const std::vector<SessionQuantity>& quantities, const SessionValues& references,
                 const SessionTimes& times, const SessionPrior& prior);
  const std::vector<SessionQuantity>& quantities() const { return quantities_; }
  /// What the unchanged robot shows on the mean when it is tested.
  const Eigen::VectorXd& mean() const { return mean_; }
  /// Variance between sessions at one time, and of a session when the robot is tested about mean().
  const Eigen::VectorXd& variance() const { return variance_; }
  const Eigen::VectorXd& variance_of_next() const { return variance_of_next_; }
  /// Mean over the references of the variance by the noise of their flights, which is part of variance().
  const Eigen::VectorXd& noise() const { return noise_; }
  double freedom() const { return freedom_; }  ///< n'

 private:
  std::vector<SessionQuantity> quantities_;
  Eigen::VectorXd mean_, variance_, variance_of_next_, noise_;
  double freedom_;
};

/// Log density of quantities of a further session: a sum over blocks, each of them Student's t.
class SessionDensity {
 public:
  /// `values`, `variances`: [quantity] of the further session, as in SessionValues.
  SessionDensity(const SessionScatter& scatter, const Eigen::VectorXd& values, const Eigen::VectorXd& variances,
                 const SessionPrior& prior);
  /// [quantity] By how much the session differs from the mean of the references, and the variance of this difference
  /// were nothing changed.
  const Eigen::VectorXd& difference() const { return difference_; }
  const Eigen::VectorXd& variance() const { return variance_; }
  double freedom() const { return freedom_; }
  /// `shift`: [quantity] what a cause adds; `more`: [quantity] variance that is added, of causes whose shift is not
  /// known. A robot that changed much flies otherwise. Then errors of the model that are the same in all flights no
  /// longer cancel, and the change may leak into other quantities.
  double log_density(const Eigen::VectorXd& shift, const Eigen::VectorXd& more) const;
  /// [quantity] Precision at a shift: that of the normal distribution with the same slope.
  Eigen::VectorXd precision(const Eigen::VectorXd& shift, const Eigen::VectorXd& more) const;
  /// [block] Indices of the block's quantities.
  const std::vector<std::vector<Eigen::Index>>& blocks() const { return blocks_; }

 private:
  Eigen::VectorXd difference_, variance_;
  Eigen::VectorXd noise_;    ///< variance by the noise of the session's flights and of the references'
  Eigen::VectorXd unknown_;  ///< standard deviation of what an unknown cause does
  Eigen::VectorXd leak_;     ///< probability that a change leaks into it
  double freedom_;
  std::vector<std::vector<Eigen::Index>> blocks_;
  /// The largest change is 1: as large as that by an unknown cause.
  double size_of(const Eigen::VectorXd& shift) const;
  /// Log density of a block, and the precision of its quantities.
  double block_density(const std::vector<Eigen::Index>& block, const Eigen::VectorXd& shift,
                       const Eigen::VectorXd& variance, Eigen::VectorXd* precision) const;
};

}  // namespace flappy::gap
