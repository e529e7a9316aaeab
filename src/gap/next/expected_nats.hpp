// What flights that are still to be flown would bring: the evidence for a hypothesis A over a rival B, if A is true,
// and the information about all hypotheses together. With c the rows that A predicts,
//   nats(A, B) = log p(c | A) - log p(c | B)
// p integrates out model discrepancy, noise, and what a hypothesis leaves uncertain (gap/evidence/evidence.hpp).
// nats(A, B) is the Kullback-Leibler divergence of B's prediction from A's, without what noise and the covariance of A
// add.
//
// Before any flight (separation.hpp) a hypothesis has its prior, and screening finds log p. After some flights
// (next_experiment.hpp) a hypothesis H predicts rows by a normal distribution with covariance K_H. With Delta the
// difference of the mean predictions, the divergence is
//   1/2 Delta^T K_B^-1 Delta + 1/2 (tr M - n - log det M)      M = K_B^-1 K_A, n rows
// The second part comes from the difference of the covariances and is never negative. nats leaves it out, so it is a
// lower bound.
//
// The expected information of a flight follows from its nats. A rival that is N nats behind keeps the share D(N) of its
// odds, D = tempered (verdict.hpp). If A is true, its probability p_A thus becomes p_A / (p_A + (1 - p_A) D(N_A)), with
// N_A its nats over its strongest rival. The expected information is the mean logarithm of this gain,
//   I = - sum over A of p_A log(p_A + (1 - p_A) D(N_A))
// It is at most the present entropy of the probabilities: separating many rivals a little beats separating one well.
#pragma once

#include <vector>

#include "gap/evidence/evidence.hpp"
#include "gap/question/verdict_rule.hpp"

namespace flappy::gap {

/// [hypothesis] nats(a, hypothesis), before any flight. `log_evidence`: [hypothesis] log p of the rows that `a`
/// predicts, up to a constant that all hypotheses share.
Eigen::VectorXd expected_nats(const Eigen::VectorXd& log_evidence, Eigen::Index a);

/// A fitted hypothesis' prediction of a next flight.
struct Expected {
  SufficientStatistics residual;             ///< log less prediction; the simulated log is the same for all hypotheses
  std::vector<BasisCoefficients> uncertain;  ///< [independent unknown] change by one standard deviation
  BasisCoefficients law_sd;  ///< [group][basis] standard deviation of the deviations of the laws of its effects
};
/// nats(a, b), after some flights. K is the covariance of declared noise, model discrepancy at scale 1, the deviations
/// of the laws of both, and what is uncertain in b. `evidence`: of the next flight and, in a contrast, the references.
double expected_nats(const Evidence& evidence, const Expected& a, const Expected& b);

/// D: the share of its odds that a rival keeps after a flight that brings `nats` against it; 1 if it brings none.
double kept_odds(double nats, const VerdictRule& rule);

/// I, in nats; if only some hypotheses are given, their part of the sum. `probability`: [hypothesis] p_A; `nats`:
/// [hypothesis] N_A.
double expected_information(const std::vector<double>& probability, const std::vector<double>& nats,
                            const VerdictRule& rule);

}  // namespace flappy::gap
