// What flights that are still to be flown would bring: for a hypothesis A over a rival B, if A is true, and for all
// together. With c the rows that A predicts,
//   nats(A, B) = log p(c | A) - log p(c | B)
// where p integrates out what a hypothesis leaves uncertain, model discrepancy and noise (gap/evidence/evidence.hpp).
// That is the Kullback-Leibler divergence of B's prediction from A's, but for what noise and the covariance of A add.
//
// Before any flight (separation.hpp) a hypothesis has its prior, and screening finds log p. After some
// (next_experiment.hpp) it is a normal prediction: with Delta the difference of the predictions and K_H the covariance
// under H, the divergence is
//   1/2 Delta^T K_B^-1 Delta + 1/2 (tr M - n - log det M)      M = K_B^-1 K_A, n rows
// The second part comes from how the covariances differ. It is never negative; nats leaves it out: a lower bound.
//
// What is expected of a flight then: a rival N nats behind keeps the share D(N) of its odds, D = tempered
// (verdict.hpp), so a true A of probability p_A becomes p_A / (p_A + (1 - p_A) D(N_A)), with N_A its nats over its
// strongest rival. The expected information is the mean logarithm of that gain,
//   I = - sum over A of p_A log(p_A + (1 - p_A) D(N_A))
// It is at most the entropy now: separating many rivals a little beats separating one well.
#pragma once

#include <vector>

#include "gap/evidence/evidence.hpp"
#include "gap/question/verdict_rule.hpp"

namespace flappy::gap {

/// [hypothesis] nats(a, hypothesis), before any flight. `log_evidence`: [hypothesis] log p of the rows that hypothesis
/// `a` predicts, less anything that all have in common.
Eigen::VectorXd expected_nats(const Eigen::VectorXd& log_evidence, Eigen::Index a);

/// A fitted hypothesis' prediction of a next flight.
struct Expected {
  SufficientStatistics residual;             ///< measured less predicted, of one simulated log for all hypotheses
  std::vector<BasisCoefficients> uncertain;  ///< [independent unknown] change for one standard deviation
  BasisCoefficients law_sd;  ///< [group][basis] standard deviation of the deviations of the laws of its effects
};
/// nats(a, b), after some flights. K: declared noise, model discrepancy at scale 1, the deviations of the laws of both,
/// and what is uncertain of b. `evidence`: of the next flight and, in a contrast, the references.
double expected_nats(const Evidence& evidence, const Expected& a, const Expected& b);

/// Share of its odds that a rival keeps after a flight that brings `nats` over it; 1 if it brings none.
double kept_odds(double nats, const VerdictRule& rule);

/// I, in nats. `probability`: [hypothesis] p_A; `nats`: [hypothesis] N_A. Given some hypotheses alone, their part of
/// the sum.
double expected_information(const std::vector<double>& probability, const std::vector<double>& nats,
                            const VerdictRule& rule);

}  // namespace flappy::gap
