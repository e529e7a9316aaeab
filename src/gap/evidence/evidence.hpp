// How probable residuals are under a hypothesis, in closed form. Rows (gap/replay/predicted_flight.hpp) form groups:
// one channel, one coefficient of the beat. In a group, over the beats of a flight,
//   residual = regressors theta + basis delta + noise
//   theta  unknowns of the hypothesis, standard normal a priori, shared by all groups
//   delta  model discrepancy: what every model gets wrong, a smooth function of input and motion (RegimeBasis),
//          N(0, (share x signal)^2); an effect has to explain more than this
//   noise  first-order autoregressive over beats; each group has a standard deviation and an autocorrelation, learnt
//          from what a fit of the whole basis leaves; heavy-tailed: rows far off count less (Student t)
// theta and delta are integrated out (Rasmussen and Williams, Gaussian Processes for Machine Learning, 2006, ch. 2.7):
//   log p(residual) = -1/2 r^T K^-1 r - 1/2 log det K + const
#pragma once

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <functional>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "gap/evidence/evidence_rules.hpp"
#include "gap/evidence/model_discrepancy.hpp"
#include "gap/replay/residuals.hpp"

namespace flappy::gap {

/// Number of groups; [group] is channel x kCoefficients + coefficient. Runs on a bench have groups of their own, which
/// follow those of flights in the air.
inline constexpr int kGroups = kSettingChannels * kCoefficients;
/// Groups of flights, which come before those of a bench.
inline constexpr int kFlownGroups = kChannels * kCoefficients;
/// First group of a channel.
constexpr int first_group(bool on_bench, int channel) { return ((on_bench ? kChannels : 0) + channel) * kCoefficients; }
constexpr bool of_bench(int group) { return group >= first_group(true, 0); }
constexpr int channel_of(int group) { return group / kCoefficients % kChannels; }
/// Column of a group in a beat of Rows.
constexpr int column_of(int group) { return group % (kChannels * kCoefficients); }

/// Smooth functions of the regime; [basis] is the index of a function. The first is the constant; each other one has
/// mean 0 and rms 1 over all flights, and likewise over all runs on a bench. Functions that never change are left out. In a contrast of a
/// bench alone there are no products. In a contrast, copies of all functions
/// except the offsets of flights follow: a copy is 0 in the references and equal to the function in the tests, for what
/// differs there.
class RegimeBasis {
 public:
  /// io::InputError if flights have different functions.
  RegimeBasis(const EvidenceRules& rules, const Flights& flights);
  int size() const { return static_cast<int>(functions_.size()); }
  const std::string& name(int i) const { return function(i).name; }
  const std::string& quantity(int i) const { return function(i).quantity; }
  BasisFunction kind(int i) const { return function(i).kind; }
  /// Whether a function is such a copy, so 0 in the references. Copies come last; there are none without references.
  bool of_tests(int i) const { return function(i).of_tests; }
  /// [group][basis] Coefficients of a change that acts in the test flights alone. `coefficients`: [group][basis] of the
  /// same change in all flights. in_tests() and in_all() are for contrasts only.
  Eigen::MatrixXd in_tests(const Eigen::MatrixXd& coefficients) const { return coefficients * in_tests_; }
  /// The reverse: from a change in the test flights alone to the same in all flights.
  Eigen::MatrixXd in_all(const Eigen::MatrixXd& coefficients) const { return coefficients * in_all_; }
  /// [function][function] Matrix that turns a reference flight's values of the functions into those that it would have
  /// as a test (`as_test`) or as a reference, without offsets of flights.
  Eigen::MatrixXd without_offsets(bool as_test) const;
  /// Whether the references vary enough in this class of regimes to tell what differs in the tests.
  bool covers(Regimes regimes) const { return covered_[static_cast<std::size_t>(regimes)]; }
  bool covers_all() const { return std::ranges::all_of(covered_, std::identity()); }
  /// [beat][basis] Values in a flight, an index of Flights.
  const Eigen::MatrixXd& values(std::size_t flight) const { return values_[flight]; }

 private:
  struct Function {
    std::string name, quantity;
    BasisFunction kind;
    bool of_tests = false;
  };
  void append_functions(const Flights& flights, const std::vector<std::size_t>& offsets);
  void append_of_tests(const Flights& flights, const std::vector<std::size_t>& tests);
  void find_covered(const Flights& flights);
  const Function& function(int i) const { return functions_[static_cast<std::size_t>(i)]; }
  std::vector<Function> functions_;
  std::vector<Eigen::MatrixXd> values_;
  Eigen::MatrixXd in_tests_;  ///< [function][function in the tests alone]
  Eigen::MatrixXd in_all_;    ///< [function in the tests alone][function]
  std::array<bool, static_cast<std::size_t>(Regimes::count)> covered_{};
};

/// The part of rows that is a smooth function of the regime, as coefficients of the basis: [group][basis].
using BasisCoefficients = Eigen::MatrixXd;

/// Regressors of the residual; the priors of their coefficients are normal with standard deviation 1. All lists are
/// [regressor].
struct Regressors {
  std::vector<const BasisCoefficients*> columns;  ///< not owned
  std::vector<double> prior_means;
  std::vector<int> effects;        ///< index in Scales::effects of the scale that multiplies the regressor; -1: none
  std::vector<ScalePrior> priors;  ///< prior of that scale
  std::vector<int> all;            ///< indices of all regressors: 0, 1, ...
  Eigen::VectorXd prior_mean() const;
  void add(const BasisCoefficients& column, double prior_mean, int effect = -1, ScalePrior prior = {});
};

/// All that evidence needs of a residual: [flight][group][basis] the sum of basis x residual over the whitened rows.
struct SufficientStatistics {
  std::vector<std::vector<Eigen::VectorXd>> sums;
};

/// Regressors and residual with delta integrated out.
struct Reduced {
  Eigen::MatrixXd sums;  ///< [i][j] sum of products of regressors i and j; the residual counts as the last one
  double log_scale = 0;  ///< contribution of delta to the log evidence: minus half the log determinant of its precision
};

// Rows, groups and blocks. A row is one number of one flight, Rows[beat][channel][coefficient]; its group is the column
// that it stands in; delta has a coefficient for each group and function:
//
//               channel         angular_acceleration_x  ..._y           ...   rotate_z
//               coefficient     mean cos1 sin1 ... sin4  mean cos1 ...         mean ... sin4
//   flight 1    beat 1          |    |    |        |                                          a beat: kRowsPerBeat rows
//               beat 2          |    |    |        |
//   flight 2    beat 1          |    |    |        |     (a channel may have no rows, and a beat may not be covered)
//               ...             |    |    |        |
//                               group 0, 1, 2, ... 8     9, 10, ...            ... kGroups - 1
//
//   delta, [group][basis]:      one channel
//     function     class        mean     cos1  sin1   cos2  sin2  ...
//     1            always       [ a ]    [ b     b ]  [ c     c ]     a block is a letter: one channel, one harmonic,
//     amplitude    inputs       [ d ]    [ e     e ]  [ f     f ]     one class of functions. Its coefficients share a
//     bias         inputs       [ d ]    [ e     e ]  [ f     f ]     scale. In a contrast each class comes again, for
//     velocity_x   velocity     [ g ]    [ h     h ]  [ i     i ]     what differs in the tests: kClasses.
//     height       place        [ j ]    [ k     k ]  [ l     l ]
//
/// Classes of functions whose coefficients share a scale: Regimes, and once more for the copies in the test flights.
inline constexpr int kRegimes = static_cast<int>(Regimes::count), kClasses = 2 * kRegimes;
/// Blocks: [channel of a setting][harmonic][class].
inline constexpr int kBlocks = kSettingChannels * (kHarmonics + 1) * kClasses;
constexpr bool block_of_tests(std::size_t block) { return block % kClasses >= static_cast<std::size_t>(kRegimes); }
constexpr Regimes regimes_of_block(std::size_t block) { return static_cast<Regimes>(block % kRegimes); }

/// How far models of this robot are off, in units of the prior of the model discrepancy.
struct Scales {
  double robot = 1;             ///< scale of the robot, common to all blocks
  double session = 1;           ///< scale of what differs between sessions, common to all blocks of the test flights
  std::vector<double> effects;  ///< scale of the background magnitude of each effect; empty: 1
  std::vector<double> blocks;   ///< [kBlocks] scale of delta; empty: 1
  std::vector<char> free;       ///< [kBlocks] whether an unknown cause lets the block exceed its prior
  /// Sets the scales of the test flights to the centres of their priors.
  void centre_tests(const SessionVariation& sessions);
  /// Prior scale of a background magnitude.
  double prior_scale(ScalePrior prior) const { return prior.follows_robot ? robot : prior.centre; }
  double block(std::size_t b) const { return blocks.empty() ? 1 : blocks[b]; }
  /// Scale about which that of block `b` varies.
  double centre(std::size_t b) const { return block_of_tests(b) ? session : robot; }
};

/// Posterior of coefficients, [regressor], or of distances along a fit's directions (Fit::posterior).
struct Posterior {
  double log_evidence = 0;  ///< nats, up to a constant that all hypotheses of a robot share
  Eigen::VectorXd mean;
  Eigen::MatrixXd covariance;
};

/// The evidence of a hypothesis with the scales that maximise it.
struct ScaledEvidence {
  Posterior posterior;  ///< its evidence includes the prior of the scales
  Scales scales;
  double law_factor = 1;  ///< as Fit::law_factor
  /// Posterior mean of delta, including deviations of laws, divided by its prior standard deviation.
  BasisCoefficients delta;
  /// Expected squares of delta, divided by its prior variance at scale 1; 0 in groups without rows.
  BasisCoefficients squares;
};

/// Rows of flights, whitened by a model of their noise. Immutable: with_... return a changed copy.
class Evidence {
 public:
  /// With the noise that the headers declare. Keeps references to `rules` and `flights`.
  Evidence(const EvidenceRules& rules, const Flights& flights, ModelDiscrepancy discrepancy, int threads);

  /// A copy with the noise learnt: standard deviation, autocorrelation and weights of outliers, from what the whole
  /// basis leaves of the residual of a good fit. The noise is no less than the declared one.
  Evidence with_noise(const Residuals& residual) const;
  /// A copy with only the weights of outliers learnt, for the residual of the vehicle file, before the first fit.
  Evidence with_weights(const Residuals& residual) const;
  /// As with_noise, but from the whole residual: its smooth part counts as noise, too. In the copy, scales stay 1,
  /// except those of free blocks.
  Evidence with_rest_as_noise(const Residuals& residual) const;
  Evidence with_discrepancy(ModelDiscrepancy discrepancy) const;
  /// A copy for a contrast among references: some of them count as the tests, and flights have no offsets. `tests`:
  /// [flight] whether it counts as one; `statistics`: those of a residual, which become those of this contrast.
  Evidence with_tests(const std::vector<char>& tests, SufficientStatistics& statistics) const;

  const RegimeBasis& basis() const { return *basis_; }
  const ModelDiscrepancy& discrepancy() const { return discrepancy_; }

  /// [group][basis] Coefficients of the basis that fit rows best, by least squares. All columns are made in this way
  /// from differences of simulations. The differences are rough, as a small change moves the step in which a wing meets
  /// its stop; their part that is not smooth in the regime is noise under every hypothesis.
  BasisCoefficients basis_coefficients(const Residuals& rows) const;
  /// Statistics of a residual that is not empty.
  SufficientStatistics statistics(const Residuals& residual) const;
  /// Changes `to` as if its residual had `share` times a smooth change in addition.
  void add(double share, const BasisCoefficients& change, SufficientStatistics& to) const;
  /// Returns the rows `residual` of a flight less a smooth change. `flight`: index in Flights.
  Rows without(std::size_t flight, Rows residual, const BasisCoefficients& change) const;

  /// Prior standard deviation of the discrepancy coefficients, [group][basis].
  BasisCoefficients discrepancy_sd(const Scales& scales) const;
  /// Returns sums with delta integrated out. `use`: [flight] whether it counts. `discrepancy_sd`: [group][basis].
  Reduced reduce(const SufficientStatistics& residual, const std::vector<const BasisCoefficients*>& regressors,
                 const std::vector<char>& use, const BasisCoefficients& discrepancy_sd) const;
  /// [residual] The same for several residuals under one prior; none for statistics without sums. `known`: sums of
  /// products of the regressors from an earlier call; null: to be computed.
  std::vector<std::optional<Reduced>> reduce_each(const std::vector<SufficientStatistics>& residuals,
                                                  const std::vector<const BasisCoefficients*>& regressors,
                                                  const std::vector<char>& use, const BasisCoefficients& discrepancy_sd,
                                                  const Eigen::MatrixXd* known = nullptr) const;
  /// Posterior mean of the discrepancy coefficients, [group][basis], given what else explains the residual.
  BasisCoefficients discrepancy_mean(const SufficientStatistics& residual, const BasisCoefficients& explained,
                                     const std::vector<char>& use, const BasisCoefficients& discrepancy_sd) const;
  /// Posterior of the coefficients of the regressors in `chosen`, indices of `reduced`; those not chosen are absent.
  /// `prior_mean`: [chosen]. `covariance`: whether to compute it.
  static Posterior posterior(const Reduced& reduced, const std::vector<int>& chosen, const Eigen::VectorXd& prior_mean,
                             bool covariance = true);

  /// Evidence at its maximum over the scales, by expectation-maximisation from `start` on (weigh.cpp). `law_sd`:
  /// [group][basis] standard deviation of the deviations of the effects' laws, which no scale changes; empty: 0.
  /// `unknown_penalty_nats`: penalty of each free block; none: no block is free.
  ScaledEvidence weigh(const SufficientStatistics& residual, const Regressors& regressors, const std::vector<char>& use,
                       const BasisCoefficients& law_sd, const Scales& start,
                       std::optional<double> unknown_penalty_nats = {}, int max_iterations = kMaxIterations) const;
  /// weigh() of one residual by `law_sd` and `start`, several times: most of what depends on neither is computed once.
  using Weigher = std::function<ScaledEvidence(const BasisCoefficients& law_sd, const Scales& start)>;
  /// The evidence and `regressors` have to outlive the result, which may not be called at the same time by several threads.
  Weigher weigher(const SufficientStatistics& residual, const Regressors& regressors, const std::vector<char>& use,
                  std::optional<double> unknown_penalty_nats = {}) const;
  /// Largest number of iterations of a search for scales. Choice.
  static constexpr int kMaxIterations = 40;
  /// Log-prior cost, in nats, of a background magnitude whose scale is `times`.
  static double scale_cost_nats(double times, ScalePrior prior, const Scales& scales);
  /// Block of a function of the basis in a group.
  int block_of(int group, int function) const;

  /// Standard deviation of the noise of a row of a group, in the channel's unit.
  double noise_sd(int group) const;
  /// Rms of the signal of a group: the root of the average of its own mean square and its channel's.
  double signal(int group) const { return groups_[static_cast<std::size_t>(group)].signal; }

 private:
  struct Group {
    double sd = 1, past = 0, signal = 0;
    double declared_sd = 0;
  };
  /// Basis x basis, summed over whitened rows. Empty in groups without rows.
  struct Sums {
    std::vector<std::vector<Eigen::MatrixXd>> of_flights;  ///< [flight][group]
    std::vector<Eigen::MatrixXd> all;                      ///< [group]
    std::vector<Eigen::LDLT<Eigen::MatrixXd>> loose;       ///< [group] of `all` with a ridge
  };
  class GroupSums;
  class Weighing;
  enum class Learn { declared, weights, noise, rest_as_noise };
  const PredictedFlight& flight(std::size_t f) const { return *(*flights_)[f]; }
  bool has_rows(int group) const { return has_rows_[static_cast<std::size_t>(group)] != 0; }
  void sum_basis();
  void take_sums(std::vector<std::vector<Eigen::MatrixXd>> of_flights);
  struct GroupSum {
    Eigen::MatrixXd normal;  ///< basis x basis
    Eigen::VectorXd right;   ///< basis x residual
    double square = 0;       ///< sum of squares of the residual's projection on the basis
  };
  /// Sums one group over the flights in `use`.
  GroupSum sum_of(const SufficientStatistics& residual, const std::vector<char>& use, int group) const;
  void learn(const Residuals& residual, Learn what);
  Eigen::VectorXd session_means(const Residuals& residual, int group) const;
  template <class Use>
  void for_rows(std::size_t flight, int group, const Use& use) const;
  template <class Use>
  void for_whitened(std::size_t flight, int group, const Use& use) const;
  Eigen::VectorXd prior_sd(int group) const;

  const EvidenceRules* rules_;
  const Flights* flights_;
  ModelDiscrepancy discrepancy_;
  int threads_;
  std::shared_ptr<const RegimeBasis> basis_;
  std::vector<Group> groups_;
  std::vector<char> has_rows_;  ///< [group] whether a flight of its setting has rows of it
  bool scales_held_ = false;
  Residuals weights_;
  std::vector<Eigen::MatrixXd> inverse_;  ///< [group / kCoefficients] inverse of basis x basis, without whitening
  std::shared_ptr<const Sums> sums_;
};

}  // namespace flappy::gap
