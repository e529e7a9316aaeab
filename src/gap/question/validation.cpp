#include "gap/question/validation.hpp"

#include <algorithm>
#include <boost/math/distributions/chi_squared.hpp>
#include <cmath>
#include <random>

#include "io/statistics.hpp"

namespace flappy::gap {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

/// Length of a block of rows that is resampled. Choice.
constexpr double kBlock_s = 2;
/// Number of resamples for an interval. Choice.
constexpr int kResamples = 1000;
/// Number of shifted copies of an effect's change. Choice.
constexpr int kCopies = 20;
/// Ridge on functions of rms 1. Choice: functions may be nearly the same.
constexpr double kRidge = 0.01;

/// Type of a flight: its name without the number of the repetition, as "level_flight" for level_flight_2.
std::string type_of(std::string name) {
  while (!name.empty() && std::isdigit(static_cast<unsigned char>(name.back()))) name.pop_back();
  while (!name.empty() && (name.back() == '_' || name.back() == '-')) name.pop_back();
  for (const char* word : {"_rep", "_run"})
    if (name.ends_with(word)) name.resize(name.size() - std::string(word).size());
  return name;
}

/// Calls use(flight, beat, row) for the mean row of each covered beat of a channel.
template <class Use>
void for_rows(const FlightList& flights, int channel, const Use& use) {
  for (std::size_t f = 0; f < flights.size(); ++f)
    for (std::size_t j = 0; j < flights[f]->beats(); ++j)
      if (flights[f]->covers(j, channel))
        use(f, j, j * kRowsPerBeat + static_cast<std::size_t>(channel) * kCoefficients);
}

double rms_of(const FlightList& flights, const TestResiduals& rest, int channel) {
  double sum = 0, n = 0;
  for_rows(flights, channel, [&](std::size_t f, std::size_t, std::size_t row) {
    if (rest[f].empty()) return;
    sum += rest[f][row] * rest[f][row];
    n += 1;
  });
  return n > 0 ? std::sqrt(sum / n) : 0;
}

std::vector<int> channels_of(const FlightList& flights) {
  std::vector<int> list;
  for (int channel = 0; channel < kChannels; ++channel)
    if (flights.front()->has_rows(channel, 0)) list.push_back(channel);
  return list;
}

HeldOutError error_of(const FlightList& flights, const TestResiduals& each, const TestResiduals& by_type, int channel) {
  HeldOutError e{channel_name(channel), rms_of(flights, each, channel), 0, 0, rms_of(flights, by_type, channel)};
  std::vector<double> sums, counts;
  std::vector<std::size_t> first;  // block of each flight
  for (std::size_t f = 0; f < flights.size(); ++f) {
    first.push_back(sums.size());
    const auto length =
        std::max<std::size_t>(1, static_cast<std::size_t>(std::round(kBlock_s * flights[f]->beats_Hz())));
    sums.resize(first[f] + flights[f]->beats() / length + 1, 0);
    counts.resize(sums.size(), 0);
    for (std::size_t j = 0; j < flights[f]->beats(); ++j) {
      if (each[f].empty() || !flights[f]->covers(j, channel)) continue;
      const double v = each[f][j * kRowsPerBeat + static_cast<std::size_t>(channel) * kCoefficients];
      sums[first[f] + j / length] += v * v;
      counts[first[f] + j / length] += 1;
    }
  }
  std::mt19937_64 random(1);
  std::vector<double> draws;
  for (int k = 0; k < kResamples; ++k) {
    double sum = 0, n = 0;
    for (std::size_t i = 0; i < sums.size(); ++i) {
      const std::size_t b = random() % sums.size();
      sum += sums[b], n += counts[b];
    }
    if (n > 0) draws.push_back(std::sqrt(sum / n));
  }
  if (!draws.empty()) e.low = io::quantile(draws, 0.05), e.high = io::quantile(draws, 0.95);
  return e;
}

/// Share of the rms of `y` that `x` removes, each flight by a factor of `x` that is fitted to the other flights, a lone
/// flight by its own; both [flight][row].
double removed_by(const std::vector<std::vector<double>>& y, const std::vector<std::vector<double>>& x) {
  double before = 0, after = 0;
  for (std::size_t out = 0; out < y.size(); ++out) {
    double xy = 0, xx = 1e-12;
    for (std::size_t f = 0; f < y.size(); ++f)
      for (std::size_t j = 0; (f != out || y.size() == 1) && j < y[f].size(); ++j)
        xy += x[f][j] * y[f][j], xx += x[f][j] * x[f][j];
    for (std::size_t j = 0; j < y[out].size(); ++j)
      before += std::pow(y[out][j], 2), after += std::pow(y[out][j] - xy / xx * x[out][j], 2);
  }
  return before > 0 ? 1 - std::sqrt(after / before) : 0;
}

/// Subtracts the mean over all flights, for a constant cannot be shifted in time.
void centre(std::vector<std::vector<double>>& v) {
  double sum = 0, n = 0;
  for (const std::vector<double>& flight : v)
    for (const double value : flight) sum += value, n += 1;
  for (std::vector<double>& flight : v)
    for (double& value : flight) value -= sum / n;
}

/// Appends one control for each effect whose vehicles can be simulated. `flights`: without references. `at`:
/// coordinates of `all`, fitted to all flights.
void control(const Flights& flights, const FittedHypothesis& all, const VectorXd& at, int threads, Validation& to) {
  std::vector<VehicleHypothesis> vehicles = {all.hypothesis.vehicle(at)};
  for (const std::string& e : all.hypothesis.effects()) {
    VectorXd without = at;
    for (Index i = all.hypothesis.shared(); i < all.hypothesis.size(); ++i) {
      const Unknown& u = all.hypothesis.unknowns()[static_cast<std::size_t>(i)];
      if (u.effect == e && u.magnitude) without[i] = 0;
    }
    vehicles.push_back(all.hypothesis.vehicle(without));
  }
  const std::vector<Residuals> rest = residuals(flights, vehicles, threads);
  for (std::size_t e = 0; e + 1 < vehicles.size(); ++e) {
    if (rest[0].empty() || rest[e + 1].empty()) continue;
    Validation::Control best{all.hypothesis.effects()[e], "", 0, 0};
    for (const int channel : channels_of(flights.tests)) {
      std::vector<std::vector<double>> y(flights.tests.size()), x(flights.tests.size());
      for_rows(flights.tests, channel, [&](std::size_t f, std::size_t, std::size_t row) {
        y[f].push_back(rest[e + 1][f][row]);
        x[f].push_back(rest[e + 1][f][row] - rest[0][f][row]);
      });
      const auto cannot_shift = [](const std::vector<double>& flight) { return flight.size() < 2; };
      std::erase_if(y, cannot_shift);
      std::erase_if(x, cannot_shift);
      if (y.empty()) continue;
      centre(y);
      centre(x);
      const double gain = removed_by(y, x);
      if (!best.channel.empty() && gain <= best.gain) continue;
      best.channel = channel_name(channel), best.gain = gain, best.best_of_shifted = best_of_shifted(y, x);
    }
    if (!best.channel.empty()) to.controls.push_back(best);
  }
}

void agree(const Fitter& fitter, const Flights& flights, const FittedHypothesis& fit, Validation& to) {
  const Hypothesis& h = fit.hypothesis;
  const Eigen::MatrixXd& axes = fit.fit->directions.axes;
  std::vector<VectorXd> means, sds;
  for (std::size_t f = 0; f < flights.size(); ++f) {
    std::vector<char> use(flights.size(), 0);
    use[f] = 1;
    const Posterior p = fitter.posterior(h, *fit.fit, use);
    means.push_back(h.bounded(fit.fit->at + axes * p.mean));
    sds.push_back((axes * p.covariance * axes.transpose()).diagonal().cwiseSqrt());
  }
  for (Index i = h.shared(); i < h.size(); ++i) {
    const Unknown& u = h.unknowns()[static_cast<std::size_t>(i)];
    if (!u.magnitude) continue;
    Validation::Agreement a{u.effect + "." + u.name, {}, {}, 1};
    double weight = 0, mean = 0, squares = 0;
    for (std::size_t f = 0; f < flights.size(); ++f) {
      a.value.push_back(u.value(means[f][i]));
      a.sd.push_back(u.scale * sds[f][i]);
      weight += 1 / (a.sd[f] * a.sd[f]);
      mean += a.value[f] / (a.sd[f] * a.sd[f]);
    }
    for (std::size_t f = 0; f < flights.size(); ++f) squares += std::pow((a.value[f] - mean / weight) / a.sd[f], 2);
    if (flights.size() > 1)
      a.p_value = cdf(complement(boost::math::chi_squared(static_cast<double>(flights.size() - 1)), squares));
    to.agreements.push_back(std::move(a));
  }
}

}  // namespace

double best_of_shifted(const std::vector<std::vector<double>>& y, const std::vector<std::vector<double>>& x) {
  std::mt19937_64 random(1);
  double most = -1;
  for (int copy = 0; copy < kCopies; ++copy) {
    std::vector<std::vector<double>> moved = x;
    for (std::vector<double>& flight : moved) {
      // rotated by n rows, a flight is shifted by n at its begin and by the others at its end
      const std::size_t least = std::max<std::size_t>(1, std::min(kMinShift, flight.size() / 4));
      const std::size_t shift = least + random() % (flight.size() - 2 * least + 1);
      std::rotate(flight.begin(), flight.begin() + static_cast<std::ptrdiff_t>(shift), flight.end());
    }
    most = std::max(most, removed_by(y, moved));
  }
  return most;
}

TestResiduals smoothed_away(const Evidence& evidence, const Flights& flights, const TestResiduals& residual) {
  const RegimeBasis& basis = evidence.basis();
  const FlightList& tests = flights.tests;
  const auto values = [&](std::size_t f, std::size_t j) {
    return basis.values(flights.references.size() + f).row(static_cast<Index>(j));
  };
  TestResiduals rest = residual;
  for (const int channel : channels_of(tests)) {
    struct Sums {
      Eigen::MatrixXd normal;
      VectorXd right;
      double n = 0;
      void operator+=(const Sums& o) { normal += o.normal, right += o.right, n += o.n; }
    };
    const Sums none{Eigen::MatrixXd::Zero(basis.size(), basis.size()), VectorXd::Zero(basis.size())};
    std::vector<Sums> of(tests.size(), none);
    for_rows(tests, channel, [&](std::size_t f, std::size_t j, std::size_t row) {
      if (residual[f].empty()) return;
      const auto b = values(f, j);
      of[f].normal.noalias() += b.transpose() * b;
      of[f].right += residual[f][row] * b.transpose();
      of[f].n += 1;
    });
    std::vector<VectorXd> fits;
    for (std::size_t out = 0; out < tests.size(); ++out) {
      Sums others = none;
      for (std::size_t f = 0; f < tests.size(); ++f)
        if (f != out || tests.size() == 1) others += of[f];
      others.normal.diagonal().array() += kRidge * others.n;
      fits.push_back(others.normal.ldlt().solve(others.right));
    }
    for_rows(tests, channel, [&](std::size_t f, std::size_t j, std::size_t row) {
      if (!rest[f].empty()) rest[f][row] -= values(f, j).dot(fits[f]);
    });
  }
  return rest;
}

double mean_square(const Evidence& evidence, const FlightList& tests, const TestResiduals& residual) {
  double sum = 0, n = 0;
  for (const int channel : channels_of(tests)) {
    for_rows(tests, channel, [&](std::size_t f, std::size_t, std::size_t row) {
      const double noise = evidence.noise_sd(first_group(tests[f]->clamped(), channel));
      if (!residual[f].empty()) sum += std::pow(residual[f][row] / noise, 2), n += 1;
    });
  }
  return n > 0 ? sum / n : 0;
}

Validation validation_of(const Question& question, const Fitter& fitter, const sim::Randomisation& uncertain,
                         const Flights& flights, const Inference& d, int threads) {
  Validation v;
  std::vector<FittedHypothesis> fits = {{Hypothesis(uncertain, {}), &d.parameters}};
  std::vector<const TestResiduals*> rest = {&d.refit};
  const std::vector<std::string>& effects = d.conclusion().effects;
  for (std::size_t n = 1; n <= effects.size(); ++n) {
    const std::vector<std::string> set(effects.begin(), effects.begin() + static_cast<std::ptrdiff_t>(n));
    const auto found = std::ranges::find_if(d.hypotheses, [&](const ScoredHypothesis& a) {
      return a.fitted() && a.kind == HypothesisKind::effect && a.effects == set;
    });
    if (found == d.hypotheses.end()) continue;
    fits.push_back({Hypothesis(uncertain, set), &found->fit});
    rest.push_back(&found->held_out);
  }
  std::vector<int> type;
  std::vector<std::string> types;
  for (const auto& flight : flights.tests) {
    const std::string name = type_of(flight->name());
    if (!std::ranges::count(types, name)) types.push_back(name);
    type.push_back(static_cast<int>(std::ranges::find(types, name) - types.begin()));
  }
  std::vector<TestResiduals> by_type;
  if (types.size() > 1) by_type = question.held_out(fitter, flights, fits, type, threads);
  else
    for (const TestResiduals* each : rest) by_type.push_back(*each);  // holding out the only type leaves no flight
  const auto rung = [&](const std::string& added, const TestResiduals& each, const TestResiduals& by_types) {
    v.ladder.push_back({added, {}});
    for (const int channel : channels_of(flights.tests))
      v.ladder.back().errors.push_back(error_of(flights.tests, each, by_types, channel));
  };
  rung("file", d.nominal, d.nominal);
  for (std::size_t i = 0; i < fits.size(); ++i)
    rung(i == 0 ? "parameters" : fits[i].hypothesis.effects().back(), *rest[i], by_type[i]);
  const FittedHypothesis& last = fits.back();
  control(flights, last, fitter.joint_fit(last.hypothesis, *last.fit, fitter.all_flights()).at, threads, v);
  agree(fitter, flights, last, v);
  return v;
}

}  // namespace flappy::gap
