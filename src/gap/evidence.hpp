// How probable residuals are under a hypothesis, in closed form.
//
// Rows (gap/beat_rows.hpp) fall into groups: one channel, one coefficient. In a group, over the beats of a flight,
//   residual = columns theta + basis eta + noise
//   theta    what the hypothesis leaves free, standard normal a priori: shared by all groups
//   eta      what every model of a flapping wing gets wrong: a smooth function of input and motion (RegimeBasis) in every
//            group, N(0, (its floor x size of the signal)^2). An effect must explain more than this.
//   noise    first-order autoregressive from beat to beat, with a scale and an autocorrelation of its own in every group,
//            found from what even the whole basis does not explain; heavy-tailed: rows far off count less (Student t)
// theta and eta are integrated out (Rasmussen and Williams, Gaussian Processes for Machine Learning, 2006, ch. 2.7), so
//   log p(residual) = -1/2 r^T K^-1 r - 1/2 log det K + const
// and what whole flights say of another is the difference of two of these.
#pragma once

#include <Eigen/Dense>
#include <vector>

#include "gap/carry.hpp"

namespace flappy::gap {

/// Rows of all flights.
using Signature = std::vector<Rows>;

inline constexpr int kGroups = kChannels * kCoefficients;

/// Smooth functions of what a beat did, over all flights of mean 0 and rms 1 but for the constant.
class RegimeBasis {
 public:
  explicit RegimeBasis(const std::vector<CarriedFlight>& flights);
  int size() const { return static_cast<int>(names_.size()); }
  const std::string& name(int i) const { return names_[static_cast<std::size_t>(i)]; }
  /// How large its coefficient is in every model, as a share of the signal.
  double floor(int i) const { return floors_[static_cast<std::size_t>(i)]; }
  /// [beat][size()].
  const Eigen::MatrixXd& values(std::size_t flight) const { return values_[flight]; }

 private:
  std::vector<std::string> names_;
  std::vector<double> floors_;
  std::vector<Eigen::MatrixXd> values_;
};

/// Sums of products of basis, columns and residual (last), whitened: [flight][group].
struct Grams {
  int basis = 0, columns = 0;
  std::vector<std::vector<Eigen::MatrixXd>> sums;
  /// Terms of log p that no hypothesis changes: [flight].
  std::vector<double> constant;
};

/// Grams with eta integrated out.
struct Reduced {
  Eigen::MatrixXd sums;  ///< columns and residual: square, columns + 1
  double log_scale = 0;  ///< of what was integrated out
};

struct Posterior {
  double log_evidence = 0;
  Eigen::VectorXd mean;
  Eigen::MatrixXd covariance;
};

class Evidence {
 public:
  explicit Evidence(const std::vector<CarriedFlight>& flights);

  const RegimeBasis& basis() const { return basis_; }
  /// Noise is as the headers declare it, until it is learnt from what a good fit leaves: its scale, its autocorrelation, and
  /// which rows count less. The weights alone are for residuals that are no noise yet.
  void learn_weights(const Signature& residual);
  void learn_noise(const Signature& residual);
  /// The part of rows that is a smooth function of the regime. Differences of simulations are rough: where in its step a
  /// wing meets its stop decides on more than the parameter that was moved.
  void smooth(Signature& rows) const;
  Grams grams(const Signature& residual, const std::vector<const Signature*>& columns) const;
  /// `use`: which flights. `unexplained`: share of the signal that eta may reach besides what every model gets wrong.
  Reduced reduce(const Grams& grams, const std::vector<char>& use, double unexplained) const;
  /// Of the chosen columns, whose theta has the given prior means and standard deviations.
  static Posterior posterior(const Reduced& reduced, const std::vector<int>& columns, const Eigen::VectorXd& prior_mean,
                             const Eigen::VectorXd& prior_sd);

  double noise_sd(int group) const { return groups_[static_cast<std::size_t>(group)].sd; }
  double signal(int group) const { return groups_[static_cast<std::size_t>(group)].signal; }
  /// Innovations of a residual over their sd, by flight, group and beat; what a plot or a test of whiteness wants.
  Signature whitened(const Signature& residual) const;

 private:
  struct Group {
    double sd = 1, past = 0, signal = 0;
    double least_sd = 0;  ///< as declared
  };
  enum class Find { declared, weights, noise };
  void find_noise(const Signature& residual, Find what);
  template <class Use>
  void for_rows(std::size_t flight, int channel, const Use& use) const;

  const std::vector<CarriedFlight>& flights_;
  RegimeBasis basis_;
  std::vector<Group> groups_;
  Signature weights_;
};

}  // namespace flappy::gap
