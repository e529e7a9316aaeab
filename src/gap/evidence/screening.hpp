// What every effect of the catalogue would explain beside a fit, as far as a linear model sees.
#pragma once

#include "gap/evidence/fit.hpp"

namespace flappy::gap {

/// A size of an effect.
struct EffectSize {
  std::string effect;
  Eigen::Index unknown, unknowns;  ///< which of the effect's, and how many it has
  bool one_sided;
  double from;  ///< coordinate that the vehicle's file gives it
};

/// A size a step of kSizeReach away from that, with all else as it was.
struct SizeStep : EffectSize {
  Candidate candidate;
  std::vector<Candidate> shaped;   ///< the same with each of its shapes a standard deviation away
  std::vector<Candidate> further;  ///< of a size of one sign: two steps away, three, .. kFurthest
  double reach;                    ///< as far as vehicles without the effect go, ..
  std::vector<Candidate> near;     ///< .. and there: above, and below where a size may be
};
inline constexpr std::size_t kFurthest = 5;
inline constexpr double kSizeReach = 0.4;

/// Of every entry of the catalogue but `withheld`, at the given coordinates of the parameters; shapes are in the middle. `usual`: what
/// vehicles have of it without the effect, for steps as near as that.
std::vector<SizeStep> size_steps(const sim::Randomisation& uncertain, const Eigen::VectorXd& at,
                                 const std::vector<std::string>& withheld, const ModelDiscrepancy* usual = nullptr);

/// What a size changes for a unit of its coordinate, near the file's; and where it is large, as a delay of a third of a beat turns what a smaller
/// one does into something else.
struct SizeColumn : EffectSize {
  BasisCoefficients change;
  /// Where it is as small as in vehicles without the effect, above 0 and below: how a wing lands on its stop is another matter there.
  std::vector<BasisCoefficients> near;
  struct Large {
    double at;                        ///< coordinate beyond the file's
    BasisCoefficients chord, change;  ///< on the way there, and there
  };
  std::vector<Large> large;
};

struct Screened {
  std::string effect;
  double gain = 0;              ///< nats
  Eigen::VectorXd coordinates;  ///< of its unknowns
};

/// Every effect that has columns, those that follow one another; the largest gain first.
std::vector<Screened> screen(const Evidence& evidence, const Fitter& fitter, const Fit& fit,
                             const std::vector<SizeColumn>& columns);

}  // namespace flappy::gap
