// What a question changes in the statistics of residuals. The questions are in gap/question/: FitRules derives from
// this class (gap/fit/fit_rules.hpp), Question from that. Evidence and RegimeBasis call it.
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
  /// Indices of the flights for which all functions but offsets follow a second time, as what differs in these flights:
  /// the tests of a contrast; else none.
  virtual std::vector<std::size_t> apart(const Flights& flights) const = 0;
  /// Whether an excess of a block over its prior is a sign of an unknown cause.
  virtual bool may_be_free(std::size_t block, const RegimeBasis& basis, const ModelDiscrepancy& discrepancy) const = 0;
  /// Scales from which expectation-maximisation starts (Evidence::weigh). `given`: those that the caller gave;
  /// `log_evidence`: of any scales, in nats. Asked only where Scales::session is still the centre of its prior.
  virtual Scales first_scales(const Scales& given, const std::function<double(const Scales&)>& log_evidence) const = 0;
  /// How often, at most, an iteration maximises scales of blocks and, in turn, the centres of their priors:
  /// Scales::robot and Scales::session.
  virtual int max_passes() const = 0;
};

}  // namespace flappy::gap
