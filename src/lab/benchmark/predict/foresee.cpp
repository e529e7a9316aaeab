#include "lab/benchmark/predict/foresee.hpp"

#include "gap/next/plan.hpp"

namespace flappy::benchmark {

std::vector<Foreseen> foresee(const Question& q) {
  gap::PlanSettings settings;
  settings.vehicle = q.vehicle;
  for (const std::filesystem::path& folder : q.flights) settings.like.push_back(folder);
  for (const std::filesystem::path& folder : q.reference) settings.like_reference.push_back(folder);
  settings.reference = !q.reference.empty();
  settings.priors = q.priors;
  settings.discrepancy = q.discrepancy;
  settings.verdict = q.verdict;
  settings.sessions = q.sessions;
  settings.matrix_only = true;
  settings.threads = 1;
  const gap::Plan plan = make_plan(settings);
  std::vector<Foreseen> all;
  for (const gap::PlannedEffect& e : plan.effects) {
    Foreseen f{e.effect, "", 0, e.probability};
    for (std::size_t r = 0; r < plan.rivals.size(); ++r)
      if (plan.rivals[r] != e.effect && (f.rival.empty() || e.nats[r] < f.nats))
        f.rival = plan.rivals[r], f.nats = e.nats[r];
    all.push_back(std::move(f));
  }
  return all;
}

}  // namespace flappy::benchmark
