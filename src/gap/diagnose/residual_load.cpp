#include "gap/diagnose/residual_load.hpp"

#include <cmath>

#include "gap/localise/closure.hpp"
#include "gap/replay/recording.hpp"

namespace flappy::gap {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

constexpr const char* kResidual = "residual";
constexpr const char* kLimits[] = {"u_limit_m_s",   "v_limit_m_s",   "w_limit_m_s",
                                   "p_limit_rad_s", "q_limit_rad_s", "r_limit_rad_s"};

/// The largest velocities and rates of the flights, as means over a beat.
std::map<std::string, double> flown_limits(const Flights& tests) {
  std::map<std::string, double> limits;
  for (const auto& flight : tests)
    for (const BeatMotion& m : flight->recording()->regimes)
      for (int i = 0; i < 6; ++i) {
        double& most = limits[kLimits[i]];
        most = std::max(most, std::abs(i < 3 ? m.velocity_B_m_s[i] : m.rate_rad_s[i - 3]));
      }
  return limits;
}

/// The load's coefficients given the residual of the corrected vehicle in some flights.
Posterior load_given(const Fitter& fitter, const Fit& corrected, const std::vector<char>& use) {
  const Regressors r = Fitter::own_regressors(corrected);
  const Evidence& evidence = fitter.evidence();
  return Evidence::posterior(
      evidence.reduce(corrected.statistics, r.columns, use, evidence.discrepancy_sd(fitter.scales())), r.all,
      r.prior_mean());
}

}  // namespace

std::optional<ResidualLoad> fit_residual_load(const RobotFit& robot, const Fitter& fitter, const Flights& flights,
                                              int threads, const Inference& d) {
  std::vector<std::string> effects = d.corrected.effects;
  effects.emplace_back(kResidual);
  sim::Randomisation uncertain = robot.uncertain();
  uncertain.set_minors(d.corrected.minors);
  const Hypothesis h(uncertain, effects);
  const Index named = d.corrected.at.size(), load = h.size() - named;
  VectorXd without = VectorXd::Zero(h.size());
  without.head(named) = d.corrected.at;
  const Fit corrected =
      fitter.linearise(h, without, Fitter::axes(h), std::vector<BasisCoefficients>(static_cast<std::size_t>(named)));
  if (!corrected.flown() || Fitter::own_regressors(corrected).columns.size() != static_cast<std::size_t>(load))
    return std::nullopt;
  std::vector<char> tests(flights.size(), 1);
  for (std::size_t f = 0; f < flights.size(); ++f) tests[f] = flights[f]->is_reference() ? 0 : 1;
  const auto with = [&](const VectorXd& coefficients) {
    VectorXd at = without;
    at.tail(load) = coefficients;
    return h.bounded(std::move(at));
  };
  const Posterior all = load_given(fitter, corrected, tests);
  const Flights asked = tests_of(flights);
  ResidualLoad l{effects, with(all.mean), all.covariance, flown_limits(asked), {}, {}};
  if (asked.size() < 2) return l;
  Residuals before, after;
  for (std::size_t f = 0; f < flights.size(); ++f) {
    if (!tests[f]) continue;
    std::vector<char> others = tests;
    others[f] = 0;
    std::vector<Residuals> rows =
        residuals({flights[f]}, {h.vehicle(with(load_given(fitter, corrected, others).mean))}, threads);
    before.push_back(corrected.residual[f]);
    after.push_back(rows[0].empty() ? Rows() : std::move(rows[0][0]));
  }
  const RowContext context = row_context_of(asked, d.noise_sd);
  l.loss_without = losses_of(context, before).mean();
  l.loss = losses_of(context, after).mean();
  l.helps = l.loss && l.loss_without && *l.loss < *l.loss_without;
  return l;
}

model::Vehicle with_limits(model::Vehicle vehicle, const ResidualLoad& load) {
  for (const auto& [name, limit] : load.limits) vehicle.effects[kResidual][name] = limit;
  return vehicle;
}

}  // namespace flappy::gap
