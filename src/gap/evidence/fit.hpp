// Finds the most probable unknowns of a hypothesis: Gauss-Newton on the rows of whole flights, whose derivatives are
// differences between vehicles that fly side by side as lanes.
#pragma once

#include <map>

#include "gap/evidence/evidence.hpp"
#include "gap/evidence/hypothesis.hpp"

namespace flappy::gap {

/// Orthonormal directions through the coordinates, and how far a difference goes along each.
struct Directions {
  Eigen::MatrixXd axes;  ///< a column each
  Eigen::VectorXd reach;
};

/// A hypothesis at given coordinates, linearised: what is left of the measurement, and how it changes.
struct Linearised {
  Eigen::VectorXd at;
  Directions directions;
  Residuals residual;               ///< empty: the vehicle comes apart
  SufficientStatistics statistics;  ///< of the residual, less rough
  std::vector<BasisCoefficients>
      columns;       ///< change of the prediction for a unit along each direction; empty: it comes apart there
  double shape = 1;  ///< how much of another law its effects have than their entries (Fitter::shape_error)
};

struct Fit {
  Linearised point;
  Posterior posterior;  ///< along the directions, relative to `point.at`
  /// Of the coordinates.
  Eigen::VectorXd mean() const;
  Eigen::MatrixXd covariance() const;
};

/// What every vehicle has of an entry, or of what looks like it: a column of standard normal coefficient.
struct Background {
  std::string entry;
  BasisCoefficients column;
};

/// Residuals under many candidates; empty residuals for vehicles that come apart.
std::vector<Residuals> residuals(const std::vector<PredictedFlight>& flights, const std::vector<Candidate>& candidates,
                                 int threads);

class Fitter {
 public:
  Fitter(const std::vector<PredictedFlight>& flights, const Evidence& evidence, int threads)
      : flights_(flights), evidence_(evidence), threads_(threads) {}

  /// Columns that may take what they can beside every hypothesis: first those that are the same for every robot, then what every vehicle
  /// has of the entries, also of those that a hypothesis names. Of which the flights tell nothing, beside a fit's, are left out.
  void set_background(const Columns& same, const std::vector<Background>& of_entries, const Fit& beside);
  /// Sizes whose change is the same wherever they stand, which so need not be flown: [effect, name].
  void set_lines(std::map<std::pair<std::string, std::string>, BasisCoefficients> lines) { lines_ = std::move(lines); }
  /// What a point leaves for a column of those that are the same for every robot: its place among them, and its coefficient.
  struct Beside {
    std::size_t place;
    double mean, sd;
  };
  /// Those of which the flights tell.
  std::vector<Beside> beside(const Linearised& point) const;
  /// From now on the background is that of a robot of the evidence's scales.
  void take_scales();
  /// Its place in Scales::entries; -1: none.
  int entry_of(const std::string& effect) const;
  const std::vector<std::string>& entries() const { return entries_; }
  std::vector<char> all_flights() const { return std::vector<char>(flights_.size(), 1); }
  /// The columns of a point that do not come apart.
  static Columns own_columns_of(const Linearised& point);
  /// Those, then the background's, as this robot has it: also of effects that a hypothesis names, for what models get wrong along an entry
  /// is there beside the entry's own size.
  Columns columns_of(const Linearised& point) const;
  /// The same with the background of a robot whose scales are 1.
  Columns unscaled_columns_of(const Linearised& point) const;
  /// What some of the flights say alone, along all directions of a point.
  Posterior posterior(const Hypothesis& hypothesis, const Linearised& point, const std::vector<char>& use) const;
  /// The most probable coordinates by the chosen flights alone, and what the columns beside them then change.
  struct Joint {
    Eigen::VectorXd at;
    BasisCoefficients beside;
  };
  /// `alone`: of a robot that has nothing of any entry but what the hypothesis names.
  Joint joint(const Hypothesis& hypothesis, const Linearised& point, const std::vector<char>& use,
              bool alone = false) const;
  /// Of its effects that act by the place, how far their laws may be others than their entries'.
  BasisCoefficients shape_error(const Hypothesis& hypothesis, const Linearised& point) const {
    return shape_error(hypothesis, point, point.shape);
  }
  BasisCoefficients shape_error(const Hypothesis& hypothesis, const Linearised& point, double shape) const;
  /// Whether any of its effects acts by the place, and so has a shape.
  bool has_shape(const Hypothesis& hypothesis, const Linearised& point) const;

  /// `known`: columns of the first directions, which need not be found again.
  Linearised linearise(const Hypothesis& hypothesis, const Eigen::VectorXd& at, Directions directions,
                       const std::vector<BasisCoefficients>& known = {}) const;
  /// Every coordinate.
  static Directions axes(const Hypothesis& hypothesis);
  /// From `start` on, at most `iterations` linearisations; empty residual where the vehicle comes apart at once.
  Fit fit(const Hypothesis& hypothesis, Eigen::VectorXd start, int iterations) const;
  /// From `start` on, beside another fit: its parameters keep their directions and derivatives.
  Fit fit(const Hypothesis& hypothesis, const Eigen::VectorXd& start, const Fit& parameters, int iterations) const;
  /// The same, but that the parameters stay where that fit has them, so that both are judged by the same columns.
  Fit fit_beside(const Hypothesis& hypothesis, const Eigen::VectorXd& start, const Fit& parameters) const;
  /// The same, from where another fit ended, along its directions.
  Fit refit(const Hypothesis& hypothesis, const Fit& before, int iterations) const;
  /// A robot that has nothing of any entry but what the hypothesis names: from another fit on, along its directions, by its columns.
  Fit alone(const Hypothesis& hypothesis, const Fit& before) const;
  /// Without any effect's size, taken as linear in the hypothesis' own unknowns, whose columns are given (empty: unseen), beside
  /// a fit of the parameters. No residual.
  Fit linear(const Hypothesis& hypothesis, const Fit& parameters, const std::vector<BasisCoefficients>& own) const;

 private:
  std::map<std::string, BasisCoefficients> changes(const Hypothesis& hypothesis, const Linearised& point) const;
  BasisCoefficients shape_of(const BasisCoefficients& change, double shape) const;
  BasisCoefficients discrepancy_sd(const Hypothesis& hypothesis, const Linearised& point) const;
  /// Of a size that is a line; null: of none.
  const BasisCoefficients* line_of(const Hypothesis& hypothesis, Eigen::Index direction) const;
  static Directions joint_directions(const Hypothesis& hypothesis, const Fit& parameters);
  static std::vector<BasisCoefficients> known(const Hypothesis& hypothesis, const Fit& parameters);
  static Directions principal(const Hypothesis& hypothesis, const Fit& fit);
  /// `own`: whether the columns are those of the point itself.
  Fit improve(const Hypothesis& hypothesis, Fit fit, int iterations, const Fit* parameters, bool own) const;
  std::vector<Eigen::VectorXd> around(const Hypothesis& hypothesis, const Eigen::VectorXd& at,
                                      const Directions& directions, const std::vector<BasisCoefficients>& known,
                                      std::vector<Candidate>& candidates) const;
  void average(const std::vector<Residuals>& rows, const std::vector<Eigen::VectorXd>& shifts, Linearised& l) const;
  Reduced reduce(const Linearised& point, const Columns& columns) const;
  /// Along all directions. `damping`: of the steps, as so much more precision around the point itself (Levenberg).
  Posterior solve(const Linearised& point, const Columns& columns, Reduced reduced, double damping = 0) const;
  double cost(const Columns& background, const Eigen::MatrixXd& sums, const SufficientStatistics& residual,
              const Eigen::VectorXd& at) const;

  const std::vector<PredictedFlight>& flights_;
  const Evidence& evidence_;
  int threads_;
  void add_background(const std::vector<BasisCoefficients>& list, Columns& to) const;
  std::map<std::pair<std::string, std::string>, BasisCoefficients> lines_;
  std::vector<BasisCoefficients> background_, scaled_;
  std::vector<double> means_;         ///< of background_
  std::vector<int> entry_;            ///< of background_: in entries_, or -1
  std::vector<Tail> tails_;           ///< of background_: of that entry's scale
  std::vector<std::string> entries_;  ///< as in Scales::entries
  std::vector<std::size_t> places_;   ///< of the columns that are of no entry, as they were given
};

}  // namespace flappy::gap
