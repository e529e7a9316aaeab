#include "blind_predict.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "flappy/vehicle_file.hpp"
#include "gap/baselines.hpp"
#include "io/config.hpp"
#include "model/effects/registry.hpp"

namespace flappy::gap {
namespace {

constexpr double kHalf90 = 1.645;
constexpr double kHuber = 1.345;
/// Beats that are taken together for the sd of a mean.
constexpr std::size_t kBlock = 8;

// ---- what diagnose reports

std::vector<std::string> groups_of(const std::vector<std::string>& effects) {
  std::vector<std::string> groups;
  for (const std::string& e : effects) {
    const std::string group = model::effects()[static_cast<std::size_t>(model::effect_index(e.c_str()))].info.group;
    groups.push_back(group.empty() ? e : group);
  }
  std::ranges::sort(groups);
  return groups;
}

/// The largest mass, rivals of a group pooled; of a pool the best where it holds half of all or four fifths of its pool.
void conclude(const std::vector<Answer>& answers, Prediction& p) {
  struct Pool {
    std::vector<std::string> groups;
    std::vector<const Answer*> members;
    double mass = 0;
  };
  std::vector<Pool> pools;
  p.probability = -1;
  const auto offer = [&](const char* kind, double probability) {
    if (probability > p.probability) p.kind = kind, p.probability = probability;
  };
  for (const Answer& a : answers) {
    if (a.kind == Answer::Kind::none) offer("none", p.none = a.probability);
    if (a.kind == Answer::Kind::parameters) offer("parameters", p.parameters = a.probability);
    if (a.kind == Answer::Kind::unknown) offer("unknown", p.unknown = a.probability);
    if (a.kind != Answer::Kind::effect) continue;
    const std::vector<std::string> groups = groups_of(a.effects);
    auto pool = std::ranges::find(pools, groups, &Pool::groups);
    if (pool == pools.end()) pool = pools.insert(pool, {groups, {}, 0});
    pool->members.push_back(&a);
    pool->mass += a.probability;
  }
  for (const Pool& pool : pools) {
    if (pool.mass <= p.probability) continue;
    const Answer& best = *pool.members.front();  // answers are the most probable first
    p.effects.clear();
    if (best.probability >= std::min(0.5, 0.8 * pool.mass)) {
      p.kind = "effect";
      p.probability = best.probability;
      p.effects = best.effects;
    } else {
      p.kind = "group";
      p.probability = pool.mass;
      for (const Answer* a : pool.members)
        for (const std::string& e : a->effects)
          if (a->probability >= 0.05 * pool.mass && std::ranges::count(p.effects, e) == 0) p.effects.push_back(e);
    }
  }
}

// ---- E, the mean loss

double huber(double x) {
  const double a = std::abs(x);
  return a < kHuber ? 0.5 * a * a : kHuber * (a - 0.5 * kHuber);
}

/// Of noise of sd 1.
double expected_loss() {
  const double density = std::exp(-0.5 * kHuber * kHuber) / std::sqrt(2 * std::numbers::pi);
  const double beyond = 0.5 * std::erfc(kHuber / std::numbers::sqrt2);
  return 0.5 * (1 - 2 * beyond - 2 * kHuber * density) + 2 * kHuber * (density - 0.5 * kHuber * beyond);
}

/// Sums of losses and counts of rows in blocks of beats; none where a flight has no residual.
struct Loss {
  std::vector<double> sum, rows;
  double total(const std::vector<double>& v) const {
    double t = 0;
    for (const double x : v) t += x;
    return t;
  }
  std::optional<double> mean() const {
    const double n = total(rows);
    return n > 0 ? std::optional(total(sum) / n) : std::nullopt;
  }
};

Loss loss_of(const std::vector<CarriedFlight>& flights, const std::vector<double>& noise_sd, const Signature& left) {
  Loss loss;
  if (left.size() != flights.size()) return loss;
  for (std::size_t f = 0; f < flights.size(); ++f) {
    if (left[f].empty()) return {};
    for (std::size_t j = 0; j < flights[f].beats(); ++j) {
      if (j % kBlock == 0) loss.sum.push_back(0), loss.rows.push_back(0);
      for (int g = 0; g < kGroups; ++g) {
        const auto k = static_cast<std::size_t>(g);
        if (!has_rows(g / kCoefficients, g % kCoefficients) || !(noise_sd[k] > 0) ||
            !flights[f].covers(j, g / kCoefficients))
          continue;
        loss.sum.back() += huber(left[f][j * kRowsPerBeat + k] / noise_sd[k]);
        loss.rows.back() += 1;
      }
    }
  }
  return loss;
}

/// Of the difference of two means, from its scatter over blocks.
double sd_of_difference(const Loss& a, const Loss& b) {
  if (a.sum.size() != b.sum.size() || a.sum.size() < 2) return 0;
  const double rows = a.total(a.rows), n = static_cast<double>(a.sum.size());
  const double mean = (a.total(a.sum) - b.total(b.sum)) / rows;
  double scatter = 0;
  for (std::size_t i = 0; i < a.sum.size(); ++i) {
    const double d = a.sum[i] - b.sum[i] - mean * a.rows[i];
    scatter += d * d;
  }
  return std::sqrt(scatter * n / (n - 1)) / rows;
}

std::map<std::string, Estimate> estimates(const Answer& a, const sim::Randomisation& uncertain) {
  std::map<std::string, Estimate> values;
  const Hypothesis h(uncertain, a.effects);
  const Eigen::VectorXd mean = a.fit.mean();
  const Eigen::MatrixXd covariance = a.fit.covariance();
  for (Eigen::Index i = h.shared(); i < h.size(); ++i) {
    const Unknown& u = h.unknowns()[static_cast<std::size_t>(i)];
    const double reach = kHalf90 * std::sqrt(covariance(i, i));
    values[u.effect + "." + u.name] = {u.value(mean[i]), u.value(mean[i] - reach), u.value(mean[i] + reach)};
  }
  return values;
}

}  // namespace

Prediction predict(const Question& q) {
  const model::Vehicle vehicle = model::read_vehicle(q.vehicle);
  const sim::Randomisation uncertain = sim::read_randomisation(vehicle, io::Config::load(q.priors).root());
  std::vector<CarriedFlight> flights;
  try {
    for (const std::filesystem::path& folder : q.flights)
      flights.emplace_back(Recording(folder, flight::read_flight_log(folder), vehicle));
  } catch (const io::InputError&) {
    return {.kind = "data", .probability = 1};
  }
  DiagnoseOptions options;
  options.threads = 1;
  options.withheld = q.withheld;
  const Diagnosis d = diagnose(flights, uncertain, options);
  Prediction p;
  conclude(d.answers, p);
  const Loss refit = loss_of(flights, d.noise_sd, d.refit);
  p.nominal = loss_of(flights, d.noise_sd, d.nominal).mean();
  p.refit = refit.mean();
  p.floor = expected_loss();
  for (const Answer& a : d.answers) {
    if (a.kind != Answer::Kind::effect || a.fit.point.residual.empty()) continue;
    const Loss left = loss_of(flights, d.noise_sd, a.left);
    p.sets.push_back({a.effects, a.probability, estimates(a, uncertain), left.mean(), sd_of_difference(refit, left)});
  }
  if (q.baselines) p.baselines = baselines(flights, uncertain, d, q.withheld, options.threads);
  return p;
}

}  // namespace flappy::gap
