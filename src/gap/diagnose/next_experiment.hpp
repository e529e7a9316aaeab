// The next flight: the manoeuvre that best tells apart the hypotheses that are still probable, the rivals.
//
// The most probable vehicle flies each manoeuvre in our own simulator; each rival then predicts the log. Let Delta be the difference of the
// predictions of two rivals A and B, each with its parameters and magnitudes as fitted to the flights so far. The expected evidence for A over B,
// if A is true, is
//   nats(A, B) = 1/2 Delta^T K^-1 Delta      K: covariance of the declared noise, of the model discrepancy (evidence.hpp), of the deviations of
//                                            the laws of their effects, and of what is still uncertain of B
// So the parameters and magnitudes of B may adapt to the new flight as far as the flights so far allow. The errors of B in old and new flights
// are the same; their correlation is neglected, so this is a lower bound. If A is an effect that the flights so far leave open, its magnitude is
// the root mean square of its posterior.
// Let N_A be the nats of A over the most probable rival (for the most probable rival: over the next one), and D(N) the tempered factor on a rival
// that is N nats behind (tempered in verdict.hpp). Then the probability p of a true A becomes p / (p + (1 - p) D(N_A)), and the expected
// information of a manoeuvre is
//   I = - sum over A of p_A log(p_A + (1 - p_A) D(N_A))
// which is at most the entropy of the present probabilities: a manoeuvre that separates many rivals a little beats one that separates a single
// rival well.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "gap/diagnose/inference.hpp"
#include "rollout/fly_config.hpp"

namespace flappy::gap {

/// A safe flight. Its log begins at settle_s of the configuration.
struct Manoeuvre {
  std::string name;
  rollout::FlyConfig config;
};

/// The configurations (*.toml) of a folder, sorted by name. io::InputError if there is none, or if one is faulty.
std::vector<Manoeuvre> read_manoeuvres(const std::filesystem::path& folder);

struct NextOptions {
  int threads = 0;
  double least_probability = 0.01;  ///< least probability of a rival
  ModelDiscrepancy discrepancy = read_model_discrepancy();
  VerdictRule rule = read_verdict_rule();
};

/// The most informative manoeuvre first. Hypotheses with an unknown cause or a remainder are no rivals, for no vehicle simulates them. Empty if
/// there are fewer than two rivals. Leaves out manoeuvres in which one of the four most probable rivals crashes.
std::vector<NextExperiment> rank_experiments(const Inference& inference, const sim::Randomisation& uncertain,
                                             const std::vector<Manoeuvre>& manoeuvres, const NextOptions& options = {});

}  // namespace flappy::gap
