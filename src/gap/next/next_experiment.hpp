// Proposes the next flight: the manoeuvre that best tells apart the rivals, which are the hypotheses that are still
// probable.
//
// The vehicle of the most probable rival flies each manoeuvre in our simulator. Each rival predicts this log, as fitted
// so far. The differences of the predictions say what the flight would bring (expected_nats.hpp):
//   nats(A, B) = 1/2 Delta^T K^-1 Delta      K: covariance of noise, model discrepancy (evidence.hpp), deviations of
//                                            the laws of their effects, and what is still uncertain of B
// By this K, B may adapt to the new flight as far as the flights so far allow. The correlation of B's errors in old and
// new flights is neglected, which makes the nats too small. If an effect was fitted only linearly, its magnitude is the
// root mean square under its posterior. The strongest rival of a hypothesis is the most probable other one. The
// manoeuvre with the largest expected information is proposed.
//
// In a contrast the new flight is a further test flight. All rivals have the parameters of the references, so they
// differ by their effects alone. The references stay among the flights: in the regimes that they visit, the model
// discrepancy cancels, and K includes what sessions differ by. All this is only for vehicles with wings.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "gap/answer/inference.hpp"
#include "rollout/fly_config.hpp"

namespace flappy::gap {

/// A safe flight, or an intervention: a flight before which something is done to the robot (`changes` of the
/// configuration). Its log begins at settle_s of the configuration.
struct Manoeuvre {
  std::string name;
  rollout::FlyConfig config;
  std::string cost;  ///< of an intervention, in words
};

/// File of interventions in a folder of manoeuvres.
inline constexpr const char* kInterventions = "interventions.toml";

/// The configurations (*.toml) of a folder by name, then its interventions. `overrides`: KEY=VALUE for all
/// configurations. io::InputError if there is no configuration, or a faulty one.
std::vector<Manoeuvre> read_manoeuvres(const std::filesystem::path& folder,
                                       const std::vector<std::string>& overrides = {});

struct NextOptions {
  int threads = 0;                          ///< as for io::parallel_for
  double least_probability = 0.01;          ///< smallest probability of a rival
  FlightList references;                    ///< reference flights of a contrast; empty: no contrast
  bool in_flight = true, on_bench = false;  ///< whether the robot may fly, or be clamped
  ModelDiscrepancy discrepancy;
  VerdictRule rule;
};

/// The manoeuvres, the most informative one first; empty with fewer than two rivals. Hypotheses with an unknown cause
/// or a remainder are no rivals, as no vehicle simulates them. Leaves out manoeuvres in which one of the four most
/// probable rivals crashes, or for which the prediction of one of the two most probable ones diverges. `uncertain`:
/// with the minor draws of `inference`.
std::vector<NextExperiment> rank_experiments(const Inference& inference, const sim::Randomisation& uncertain,
                                             const std::vector<Manoeuvre>& manoeuvres, const NextOptions& options);

}  // namespace flappy::gap
