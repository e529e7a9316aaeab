// Which flight to fly next: the manoeuvre that best tells apart the hypotheses that are left.
//
// Every manoeuvre is flown by the most probable vehicle in our own simulator; its log is then predicted by every rival. With
// Delta the difference of what two rivals A and B predict, where the flights so far leave each of them,
//   nats(A, B) = 1/2 Delta^T K^-1 Delta      K: noise as declared, what every model of a wing gets wrong (evidence.hpp), what
//                                            the equations of their effects get wrong, and what is uncertain of B still
// is what such a flight is expected to bring for A over B where A is true: parameters and sizes of B may adjust themselves,
// as far as the flights so far allow. That B's errors in old and new flights are the same ones is left out, so it is a
// lower bound. Of what the flights so far leave open, A has a size that it may well have: its root mean square.
// With N_A the nats of A over the most probable rival (of that one over the next), and D what the verdict keeps of a rival against which so many
// nats speak (verdict.hpp), A of probability p is then thought of as p / (p + (1 - p) D(N_A)), and the information to be expected of a manoeuvre is
//   I = - sum over A of p_A log(p_A + (1 - p_A) D(N_A))
// at most the entropy of what is thought now: a manoeuvre that shows many rivals a little beats one that shows a single one well.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "gap/diagnose/inference.hpp"
#include "rollout/fly_config.hpp"

namespace flappy::gap {

/// A safe flight; it is logged from its settle_s on.
struct Manoeuvre {
  std::string name;
  rollout::FlyConfig config;
};

/// The configurations (*.toml) of a folder, by name. io::InputError where there is none or one is faulty.
std::vector<Manoeuvre> read_manoeuvres(const std::filesystem::path& folder);

struct NextOptions {
  int threads = 0;
  double least_probability = 0.01;  ///< of a rival
  ModelDiscrepancy discrepancy = read_model_discrepancy();
  VerdictRule rule = read_verdict_rule();
};

/// Most informative first. Rivals are the probable hypotheses that can fly: an unknown cause cannot. Without two of them, and for a
/// manoeuvre that one of the four most probable vehicles would not survive, there is nothing.
std::vector<NextExperiment> rank_experiments(const Inference& inference, const sim::Randomisation& uncertain,
                                             const std::vector<Manoeuvre>& manoeuvres, const NextOptions& options = {});

}  // namespace flappy::gap
