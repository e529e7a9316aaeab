#include "benchmark/questions.hpp"

namespace flappy::benchmark {

namespace fs = std::filesystem;

fs::path BenchQuestions::vehicle_of(const Manifest& manifest) const {
  return vehicle.empty() ? fs::path(manifest.vehicle) : vehicle;
}

Question BenchQuestions::question(const fs::path& folder, const Manifest& manifest, const PublicCase& of) const {
  Question q;
  q.flights = of.flights(folder);
  q.reference = of.references(folder);
  q.vehicle = vehicle_of(manifest);
  q.priors = priors;
  q.discrepancy = discrepancy;
  q.verdict = verdict;
  q.sessions = sessions;
  return q;
}

}  // namespace flappy::benchmark
