#include "gap/next/next_experiment.hpp"

#include <algorithm>
#include <cmath>

#include "gap/next/expected_nats.hpp"
#include "gap/question/question.hpp"
#include "gap/replay/reset_prediction.hpp"
#include "io/config.hpp"
#include "io/parallel.hpp"
#include "rollout/simulated_flight.hpp"

namespace flappy::gap {
namespace {

namespace fs = std::filesystem;
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Number of the most probable rivals that have to survive a manoeuvre. Choice.
constexpr std::size_t kSurvive = 4;

/// The rivals keep references to `uncertain` and `as_filed`, which has minor draws of 0.
std::vector<Rival> rivals_of(const Question& question, const Inference& d, const sim::Randomisation& uncertain,
                             const sim::Randomisation& as_filed, double least_probability) {
  std::vector<Rival> rivals;
  for (const ScoredHypothesis& a : d.hypotheses) {
    if (a.probability < least_probability) break;
    if (a.kind != HypothesisKind::unknown && !a.has_remainder())
      rivals.push_back(question.rival(a, d, uncertain, as_filed));
  }
  return rivals;
}

/// Prediction of a simulated flight by a rival; none if the simulation diverges. `first`: linearisation of the first
/// rival with parameters; its columns serve all.
std::optional<Expected> expect(const Question& question, const Rival& rival, const Fitter& fitter,
                               std::optional<Fit>& first) {
  const bool with_parameters = rival.directions.reach.size() > 0;
  std::vector<SharedColumn> known;
  if (with_parameters) known = question.known_columns(rival, first);
  const Fit l = fitter.linearise(rival.hypothesis, rival.at, rival.directions, known);
  if (l.residual.empty()) return {};
  if (with_parameters && !first) first = l;
  Expected e{l.statistics, {}, fitter.law_sd(rival.hypothesis, l)};
  const Index k = rival.covariance.rows();
  if (k == 0) return e;  // the vehicle file as it is: nothing is uncertain
  const Eigen::SelfAdjointEigenSolver<MatrixXd> eigen(rival.covariance);
  for (Index i = 0; i < k; ++i) {
    if (!(eigen.eigenvalues()[i] > 0)) continue;
    BasisCoefficients sum = BasisCoefficients::Zero(e.law_sd.rows(), e.law_sd.cols());
    for (Index d = 0; d < k; ++d) {
      const BasisCoefficients& column = l.columns[static_cast<std::size_t>(d)];
      if (column.size() > 0) sum += eigen.eigenvectors()(d, i) * column;
    }
    e.uncertain.emplace_back(std::sqrt(eigen.eigenvalues()[i]) * sum);
  }
  return e;
}

/// Predictions of rivals left open: the residual of the most probable rival plus the change by their magnitudes. They
/// differ from one vehicle by magnitudes alone, so each change is smooth and costs one simulation.
void add_open(const std::vector<Rival>& rivals, const Flights& flights, const Evidence& evidence,
              std::vector<std::optional<Expected>>& expected) {
  std::vector<std::size_t> open;
  std::vector<VehicleHypothesis> vehicles;
  for (std::size_t i = 0; i < rivals.size(); ++i) {
    if (expected[i] || !rivals[i].open) continue;
    const Rival& r = rivals[i];
    if (open.empty()) {
      VectorXd without = r.hypothesis.start();
      without.head(r.hypothesis.shared()) = r.at.head(r.hypothesis.shared());
      vehicles.push_back(r.hypothesis.vehicle(without));
    }
    vehicles.push_back(r.vehicle());
    open.push_back(i);
  }
  if (open.empty()) return;
  std::vector<Residuals> rest = residuals(flights, vehicles, 1);
  if (rest[0].empty()) return;
  const SufficientStatistics without = evidence.statistics(rest[0]);
  for (std::size_t k = 0; k < open.size(); ++k) {
    if (rest[k + 1].empty()) continue;
    Expected e = *expected[0];
    e.law_sd.setZero();
    const SufficientStatistics with = evidence.statistics(rest[k + 1]);
    for (std::size_t f = 0; f < with.sums.size(); ++f)
      for (std::size_t g = 0; g < with.sums[f].size(); ++g)
        e.residual.sums[f][g] += with.sums[f][g] - without.sums[f][g];
    expected[open[k]] = std::move(e);
  }
}

/// Time between points of the course of a flight. Size: of what is written.
constexpr double kCourseStep_s = 0.1;

constexpr const char* kCourses[] = {"x_m", "y_m", "z_m", "amplitude_V", "difference_V", "bias_V", "split_cycle"};

/// [quantity][step] means over kCourseStep_s; a step without samples repeats the one before.
std::vector<std::vector<double>> course_of(const flightlog::FlightLog& log) {
  const flightlog::MocapStream& m = log.mocap;
  const flightlog::CommandStream& c = log.command;
  const std::pair<const flightlog::Column*, const flightlog::Column*> columns[] = {{&m.t_s, &m.x_m},
                                                                                   {&m.t_s, &m.y_m},
                                                                                   {&m.t_s, &m.z_m},
                                                                                   {&c.t_s, &c.inputs->amplitude_V},
                                                                                   {&c.t_s, &c.inputs->difference_V},
                                                                                   {&c.t_s, &c.inputs->bias_V},
                                                                                   {&c.t_s, &c.inputs->split_cycle}};
  const auto steps = static_cast<std::size_t>((c.t_s.back() - c.t_s.front()) / kCourseStep_s);
  std::vector<std::vector<double>> course;
  for (const auto& [t_s, values] : columns) {
    if (t_s->empty()) {  // a clamped robot has no path
      course.emplace_back();
      continue;
    }
    std::vector<double> sums(steps, 0), counts(steps, 0);
    for (std::size_t i = 0; i < t_s->size(); ++i) {
      const double at = ((*t_s)[i] - c.t_s.front()) / kCourseStep_s;
      if (at < 0 || at >= static_cast<double>(steps)) continue;
      sums[static_cast<std::size_t>(at)] += (*values)[i];
      counts[static_cast<std::size_t>(at)] += 1;
    }
    for (std::size_t k = 0; k < steps; ++k)
      sums[k] = counts[k] > 0 ? sums[k] / counts[k] : k > 0 ? sums[k - 1] : values->front();
    course.push_back(std::move(sums));
  }
  return course;
}

std::vector<Course> courses_of(const std::vector<std::vector<double>>& first,
                               const std::vector<std::vector<double>>& second) {
  std::vector<std::pair<double, Course>> list;
  for (std::size_t q = 0; q < std::size(kCourses); ++q) {
    const std::size_t n = std::min(first[q].size(), second[q].size());
    if (n == 0) continue;
    const Eigen::Map<const VectorXd> a(first[q].data(), static_cast<Index>(n)),
        b(second[q].data(), static_cast<Index>(n));
    const double own = (a.array() - a.mean()).matrix().norm(), apart = (a - b).norm();
    list.push_back({own > 0 ? apart / own : 0, {kCourses[q], {a.begin(), a.end()}, {b.begin(), b.end()}}});
  }
  std::ranges::stable_sort(list, std::greater{}, &std::pair<double, Course>::first);
  std::vector<Course> courses;
  for (auto& [share, course] : list) courses.push_back(std::move(course));
  return courses;
}

std::optional<NextExperiment> weighed(const Question& question, const Manoeuvre& m, const std::vector<Rival>& rivals,
                                      const NextOptions& options) {
  const auto fly = [&](const Rival& r) {
    return std::move(simulate(m.config, r.vehicle().vehicle, 1, m.config.settle_s)[0]);
  };
  std::vector<rollout::SimulatedFlight> flown;
  for (std::size_t i = 0; i < std::min(rivals.size(), kSurvive); ++i) {
    flown.push_back(fly(rivals[i]));
    if (flown.back().lost || !flown.back().log) return {};
  }
  const Flights flights{
      options.references,
      {std::make_shared<ResetPrediction>(Recording(m.name, *flown.front().log, rivals.front().vehicle().vehicle))}};
  const Fitter fitter(question, flights, std::make_shared<const Evidence>(question, flights, options.discrepancy, 1),
                      1);
  const Evidence& evidence = fitter.evidence();
  std::vector<std::optional<Expected>> expected(rivals.size());
  std::optional<Fit> first;
  for (std::size_t i = 0; i < rivals.size(); ++i)
    if (i < 2 || !rivals[i].open) expected[i] = expect(question, rivals[i], fitter, first);
  if (!expected[0] || !expected[1]) return {};
  add_open(rivals, flights, evidence, expected);
  const auto nats = [&](std::size_t a, std::size_t b) { return expected_nats(evidence, *expected[a], *expected[b]); };
  std::vector<std::size_t> flyable;
  double all = 0;
  for (std::size_t i = 0; i < rivals.size(); ++i)
    if (expected[i]) flyable.push_back(i), all += rivals[i].probability;
  std::vector<double> probability, over_strongest;
  NextExperiment result{m.name, in_words(m.config.changes), m.cost, {}, 0, 0, kCourseStep_s, {}};
  std::size_t other = 1;
  double most = -1;
  for (const std::size_t a : flyable) {
    probability.push_back(rivals[a].probability / all);
    over_strongest.push_back(a == 0 ? nats(0, 1) : nats(a, 0));
    const double own = expected_information({probability.back()}, {over_strongest.back()}, options.rule);
    if (a > 0 && own > most) most = own, other = a;
  }
  result.information = expected_information(probability, over_strongest, options.rule);
  result.expected_nats = 0.5 * (nats(0, other) + nats(other, 0));
  result.separates = {rivals[0].name, rivals[other].name};
  if (other >= flown.size()) flown.push_back(fly(rivals[other]));
  if (const auto& log = flown[std::min(other, flown.size() - 1)].log)
    result.courses = courses_of(course_of(*flown[0].log), course_of(*log));
  return result;
}

void add_interventions(const fs::path& file, std::vector<Manoeuvre>& list) {
  const io::Config config = io::Config::load(file);
  config.root().schema(1);
  std::vector<Manoeuvre> added;
  for (const io::Table& t : config.root().tables("intervention")) {
    const std::string name = t.string("name"), flown = t.string("manoeuvre");
    const auto base = std::ranges::find(list, flown, &Manoeuvre::name);
    if (base == list.end()) {
      std::vector<std::string> names;
      for (const Manoeuvre& m : list) names.push_back(m.name);
      t.fail("manoeuvre", "no manoeuvre \"" + flown + "\"", io::joined(names) + io::did_you_mean(flown, names));
    }
    added.push_back({name, base->config, t.string("cost")});
    added.back().config.changes = model::read_changes(t);
    if (!added.back().config.changes.any()) t.fail("name", "changes nothing", "a table changes, as of flight.toml");
  }
  config.root().finish();
  std::ranges::move(added, std::back_inserter(list));
}

}  // namespace

std::vector<Manoeuvre> read_manoeuvres(const fs::path& folder, const std::vector<std::string>& overrides) {
  std::vector<Manoeuvre> list;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(folder, error))
    if (entry.path().extension() == ".toml" && entry.path().filename() != kInterventions)
      list.push_back({entry.path().stem().string(), rollout::read_fly_config(entry.path(), overrides)});
  if (list.empty())
    throw io::InputError(folder.string() + ": holds no manoeuvre; accepted: a folder of configurations of flappy-fly");
  std::ranges::sort(list, {}, &Manoeuvre::name);
  if (fs::exists(folder / kInterventions, error)) add_interventions(folder / kInterventions, list);
  return list;
}

std::vector<NextExperiment> rank_experiments(const Inference& inference, const sim::Randomisation& uncertain,
                                             const std::vector<Manoeuvre>& manoeuvres, const NextOptions& options) {
  sim::Randomisation as_filed = uncertain;
  as_filed.set_minors(std::vector<double>(uncertain.minors().size(), 0));
  const Question& question = question_beside(options.references);
  const std::vector<Rival> rivals = rivals_of(question, inference, uncertain, as_filed, options.least_probability);
  if (rivals.size() < 2) return {};
  std::vector<std::optional<NextExperiment>> found(manoeuvres.size());
  const auto is_ready = [&](const Manoeuvre& m) { return m.config.log.rig ? options.on_bench : options.in_flight; };
  io::parallel_for(manoeuvres.size(), options.threads, [&](std::size_t i) {
    if (is_ready(manoeuvres[i])) found[i] = weighed(question, manoeuvres[i], rivals, options);
  });
  std::vector<NextExperiment> list;
  for (std::optional<NextExperiment>& e : found)
    if (e) list.push_back(std::move(*e));
  std::ranges::stable_sort(list, std::greater{}, &NextExperiment::information);
  return list;
}

}  // namespace flappy::gap
