// How probable residuals are under a hypothesis, in closed form.
//
// Rows (gap/replay/beat_rows.hpp) fall into groups: one channel, one coefficient. In a group, over the beats of a flight,
//   residual = columns theta + basis delta + noise
//   theta  what the hypothesis leaves free, standard normal a priori: shared by all groups
//   delta  what every model of a flapping wing gets wrong: a smooth function of input and motion (RegimeBasis) in every
//          group, N(0, (its share x size of the signal)^2): the model discrepancy. An effect must explain more than this.
//   noise  first-order autoregressive from beat to beat, with a scale and an autocorrelation of its own in every group,
//          found from what even the whole basis does not explain; heavy-tailed: rows far off count less (Student t)
// theta and delta are integrated out (Rasmussen and Williams, Gaussian Processes for Machine Learning, 2006, ch. 2.7), so
//   log p(residual) = -1/2 r^T K^-1 r - 1/2 log det K + const
#pragma once

#include <Eigen/Dense>
#include <optional>
#include <utility>
#include <vector>

#include "gap/evidence/model_discrepancy.hpp"

namespace flappy::gap {

/// Rows of all flights.
using Residuals = std::vector<Rows>;

inline constexpr int kGroups = kChannels * kCoefficients;

/// Smooth functions of what a beat did, over all flights of mean 0 and rms 1 but for the constant.
class RegimeBasis {
 public:
  explicit RegimeBasis(const std::vector<PredictedFlight>& flights);
  int size() const { return static_cast<int>(names_.size()); }
  const std::string& name(int i) const { return names_[static_cast<std::size_t>(i)]; }
  BasisFunction kind(int i) const { return kinds_[static_cast<std::size_t>(i)]; }
  /// [beat][size()].
  const Eigen::MatrixXd& values(std::size_t flight) const { return values_[flight]; }

 private:
  std::vector<std::string> names_;
  std::vector<BasisFunction> kinds_;
  std::vector<Eigen::MatrixXd> values_;
};

/// The part of rows that is a smooth function of the regime, as coefficients of its basis: [group][basis].
using BasisCoefficients = Eigen::MatrixXd;

/// Columns beside each other, and what is thought of their coefficients: normal about these means, of sd 1.
struct Columns {
  std::vector<const BasisCoefficients*> columns;
  std::vector<int> chosen;  ///< all of them
  std::vector<double> prior_mean;
  std::vector<int>
      entry;  ///< of what every vehicle has of an entry: which of Scales::entries it grows with; -1: of none
  std::vector<Tail> tail;  ///< of that scale
  Eigen::VectorXd mean() const;
  void add(const BasisCoefficients& column, double mean, int of_entry = -1, Tail of_scale = {});
};

/// All that the rows of flights say of smooth residuals: sums over the whitened rows of a group, basis x
/// residual, [flight][group].
struct SufficientStatistics {
  std::vector<std::vector<Eigen::VectorXd>> sums;
};

/// Columns and residual with delta integrated out.
struct Reduced {
  Eigen::MatrixXd sums;  ///< columns, then the residual: square
  double log_scale = 0;  ///< of what was integrated out
};

/// How far models of this robot are off, beside what is usual: factors of its discrepancy.
struct Scales {
  double robot = 1;
  std::vector<double> entries;  ///< of what it has of each entry, as every vehicle does; empty: 1
  std::vector<double> blocks;   ///< [kBlocks]
  std::vector<char> free;       ///< [kBlocks] whether it is larger than models are, by whatever it takes
  /// Of such an entry, where nothing was found.
  double usual(Tail tail) const { return tail.of_model ? robot : 1; }
};
inline constexpr int kClasses = static_cast<int>(Regimes::count), kBlocks = kChannels * (kHarmonics + 1) * kClasses;

struct Posterior {
  double log_evidence = 0;
  Eigen::VectorXd mean;
  Eigen::MatrixXd covariance;
};

/// A hypothesis weighed with the scales that make the flights most probable.
struct Weighed {
  Posterior posterior;  ///< its evidence includes what is thought of the scales
  Scales scales;
  double shape = 1;           ///< as of Linearised
  BasisCoefficients delta;    ///< mean of what is left for the discrepancy, over its sd
  BasisCoefficients squares;  ///< expected square of delta, over that of its sd where all scales are 1; 0: not seen
};

class Evidence {
 public:
  Evidence(const std::vector<PredictedFlight>& flights, ModelDiscrepancy discrepancy, int threads);

  const RegimeBasis& basis() const { return basis_; }
  const ModelDiscrepancy& discrepancy() const { return discrepancy_; }
  /// Noise is as the headers declare it, until it is learnt from what a good fit leaves: its scale, its autocorrelation, and
  /// which rows count less. The weights alone are for residuals that are no noise yet.
  void learn_weights(const Residuals& residual);
  void learn_noise(const Residuals& residual);
  /// By least squares. Differences of simulations are rough: where in its step a wing meets its stop decides on more than
  /// the parameter that was moved. What is no smooth function of the regime is noise, whatever the hypothesis.
  BasisCoefficients basis_coefficients(const Residuals& rows) const;
  SufficientStatistics statistics(const Residuals& residual) const;
  /// Adds to a residual `share` times a smooth one.
  void add(double share, const BasisCoefficients& change, SufficientStatistics& to) const;
  /// Sd of delta that every model of this robot has.
  BasisCoefficients discrepancy_sd() const;
  /// `use`: which flights. `discrepancy_sd`: of delta's coefficients. `same`: sums of the columns alone, where they are known already.
  Reduced reduce(const SufficientStatistics& residual, const std::vector<const BasisCoefficients*>& columns,
                 const std::vector<char>& use, const BasisCoefficients& discrepancy_sd,
                 const Eigen::MatrixXd* same = nullptr) const;
  /// Expectation-maximisation over the scales of the discrepancy, from `start` on. `own_sd`: what equations of effects get wrong of
  /// themselves, which no scale changes. `freeing_nats`: the price at which a block whose tails are no heavier than those of the place may be
  /// larger than any model is off; none: no block.
  Weighed weigh(const SufficientStatistics& residual, const Columns& columns, const std::vector<char>& use,
                const BasisCoefficients& own_sd, const Scales& start, std::optional<double> freeing_nats = {},
                int iterations = kMostIterations) const;
  /// Nats that it costs a hypothesis that this robot has so many times what is usual of an entry.
  double price_of(double times, Tail tail) const;
  static constexpr int kMostIterations = 40;
  void set_discrepancy(ModelDiscrepancy discrepancy) { discrepancy_ = std::move(discrepancy); }
  /// Those that every model of this robot has from now on.
  void set_scales(const Scales& scales) { scales_ = scales; }
  /// From now on all of a residual is noise, smooth or not, and no hypothesis finds scales of its own, but for blocks that are free.
  void learn_remainder(const Residuals& residual);
  /// The residual of a flight less what columns of such coefficients make of it, as far as they are smooth.
  Rows without(std::size_t flight, Rows residual, const BasisCoefficients& change) const;
  const Scales& scales() const { return scales_; }
  static int block_of(int group, BasisFunction function);
  /// Of the chosen columns, whose theta has the given prior means and sd 1; without `covariance` that is empty.
  static Posterior posterior(const Reduced& reduced, const std::vector<int>& columns, const Eigen::VectorXd& prior_mean,
                             bool covariance = true);

  /// Sd of a row of noise alone.
  double noise_sd(int group) const;
  double signal(int group) const { return groups_[static_cast<std::size_t>(group)].signal; }

 private:
  struct Group {
    double sd = 1, past = 0, signal = 0;
    double least_sd = 0;  ///< as declared
  };
  bool has_rows(int group) const { return flights_.front().has_rows(group / kCoefficients, group % kCoefficients); }
  void sum_basis();
  std::pair<Eigen::MatrixXd, Eigen::VectorXd> sums_of(const SufficientStatistics& residual,
                                                      const std::vector<char>& use, int group) const;
  enum class Find { declared, weights, noise, remainder };
  void find_noise(const Residuals& residual, Find what);
  template <class Use>
  void for_rows(std::size_t flight, int channel, const Use& use) const;
  /// Sd of a group's delta where every scale is 1.
  Eigen::VectorXd base_sd(int group) const;
  /// Of a residual whose sums are given, as far as the basis has it.
  static double squares_of(Eigen::MatrixXd normal, const Eigen::VectorXd& right);
  template <class Use>
  void for_whitened(std::size_t flight, int group, const Use& use) const;

  const std::vector<PredictedFlight>& flights_;
  ModelDiscrepancy discrepancy_;
  int threads_;
  RegimeBasis basis_;
  std::vector<Group> groups_;
  bool held_ = false;
  Scales scales_{1, {}, std::vector<double>(kBlocks, 1), std::vector<char>(kBlocks, 0)};
  Residuals weights_;
  std::vector<Eigen::MatrixXd> plain_inverse_;        ///< of basis x basis, by channel
  std::vector<std::vector<Eigen::MatrixXd>> normal_;  ///< basis x basis of the whitened rows, [flight][group]
};

}  // namespace flappy::gap
