// Which flight to fly next: the manoeuvre that best tells apart the hypotheses that are left.
//
// Every manoeuvre is flown by the most probable vehicle in our own simulator; its log is then predicted by every rival. With
// Delta the difference of what two rivals A and B predict, where the flights so far leave each of them,
//   nats(A, B) = 1/2 Delta^T K^-1 Delta      K: noise as declared, what every model of a wing gets wrong (evidence.hpp), what
//                                            the equations of their effects get wrong, and what is uncertain of B still
// is what such a flight is expected to bring for A over B where A is true: parameters and sizes of B may adjust themselves,
// as far as the flights so far allow. That B's errors in old and new flights are the same ones is left out, so it is a
// lower bound. Pairs count by the product of their probabilities.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "gap/diagnose/diagnose.hpp"
#include "rollout/fly_config.hpp"

namespace flappy::gap {

/// A safe flight; it is logged from its settle_s on.
struct Manoeuvre {
  std::string name;
  rollout::FlyConfig config;
};

/// The configurations (*.toml) of a folder, by name. io::InputError where there is none or one is faulty.
std::vector<Manoeuvre> read_manoeuvres(const std::filesystem::path& folder);

/// What a flight shows of a rival: means over kCourseStep_s, from the log's begin.
struct Course {
  std::string quantity;               ///< x_m, ..., amplitude_V, ...
  std::vector<double> first, second;  ///< of the two that are told apart
};
inline constexpr double kCourseStep_s = 0.1;

struct NextExperiment {
  std::string manoeuvre;
  std::vector<std::string>
      separates;             ///< the two hypotheses that it tells apart most: effects joined by +, or their kind
  double expected_nats = 0;  ///< mean over pairs
  std::vector<Course>
      courses;  ///< as each of the two would fly it; first what differs most beside what it does in the flight
};

struct NextOptions {
  int threads = 0;
  std::size_t most_rivals = 4;
  ModelDiscrepancy discrepancy = read_model_discrepancy();
};

/// Best first. Rivals are the most probable hypotheses that can fly: an unknown cause cannot. Without two of them, and for a
/// manoeuvre that one of their vehicles would not survive, there is nothing.
std::vector<NextExperiment> rank_experiments(const Diagnosis& diagnosis, const sim::Randomisation& uncertain,
                                             const std::vector<Manoeuvre>& manoeuvres, const NextOptions& options = {});

}  // namespace flappy::gap
