// The part of a question (docs/glossary.md) that Evidence and RegimeBasis call: it selects offsets, blocks and scales in
// the statistics of residuals. FitRules derives from this class, and Question derives from FitRules.
#pragma once

#include <functional>
#include <vector>

#include "gap/evidence/model_discrepancy.hpp"
#include "gap/replay/predicted_flight.hpp"

namespace flappy::gap {

class RegimeBasis;
struct Scales;

class EvidenceRules {
 public:
  virtual ~EvidenceRules() = default;
  /// Indices of the flights that have an offset of their own in the regime basis.
  virtual std::vector<std::size_t> offsets(const Flights& flights) const = 0;
  /// Indices of the flights that get a second copy of each basis function, except offsets. The copy is 0 in all other
  /// flights and stands for how these differ. In a contrast: the tests; else none.
  virtual std::vector<std::size_t> apart(const Flights& flights) const = 0;
  /// Whether the scale of this block may leave its prior; if it does, that is a sign of an unknown cause.
  virtual bool may_be_free(std::size_t block, const RegimeBasis& basis, const ModelDiscrepancy& discrepancy) const = 0;
  /// Scales from which expectation-maximisation starts (Evidence::weigh). `given`: those that the caller gave;
  /// `log_evidence`: of any scales, in nats. Called only while Scales::session has the central value of its prior.
  virtual Scales first_scales(const Scales& given, const std::function<double(const Scales&)>& log_evidence) const = 0;
  /// Largest number of alternations within an iteration between the scales of blocks and the centres of their priors,
  /// Scales::robot and Scales::session.
  virtual int max_passes() const = 0;
};

}  // namespace flappy::gap
