#include "sim/randomise.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <ranges>
#include <stdexcept>
#include <utility>

#include "model/posterior.hpp"

namespace flappy::sim {
namespace {

/// Cut of the draw of a coefficient whose vehicle file declares a standard deviation.
constexpr double kDeclaredCut_sd = 4;
constexpr std::uint32_t kIndicesPerDraw = 64;  // a cut at 1 sd is redrawn 63 times once in 1e31
/// Draws that together make no body are drawn again. The indices of an attempt are apart from those of 16,384 draws of
/// another. A table of which kTried attempts in a row fail is refused, so at least about 5 % succeed, and kAttempts in a
/// row fail once in 1e5 vehicles or less.
constexpr std::uint32_t kIndicesPerAttempt = 1U << 20, kAttempts = 256, kTried = 64;

std::string six_digits(double value) {
  char text[32];
  return {text, std::to_chars(text, text + sizeof text, value, std::chars_format::general, 6).ptr};
}

}  // namespace

Randomisation::Randomisation(model::Vehicle nominal, const io::Table& config) : Randomisation(std::move(nominal)) {
  model::Vehicle vehicle = nominal_;
  const std::vector<model::Parameter> parameters = model::parameters(vehicle);
  std::vector<Reach> reach;
  for (const model::Parameter& p : parameters) reach.push_back({*p.value, *p.value});
  const auto add = [&](const io::Table& table, Draw draw) {
    draws_.push_back(std::move(draw));
    check_reach(table, draws_.back(), parameters, reach);
    if (draws_.back().minor) {
      minors_.push_back(0);
      return;
    }
    if (++majors_ < draws_.size())
      table.fail("minor", "a draw before this one is minor", "minor draws behind all others");
    check_bodies(table, draws_.back());
  };
  const std::vector<io::Table> tables = config.tables("randomise");
  for (const io::Table& table : tables) {
    Draw draw = read_draw(table, parameters);
    if (!table.boolean_or("each", false)) {
      add(table, std::move(draw));
      continue;
    }
    for (const std::size_t parameter : std::exchange(draw.parameters, {})) {
      draw.parameters = {parameter};
      add(table, draw);
    }
  }
  const auto possible = [&](std::uint32_t attempt) { return !model::physical_fault(drawn({}, attempt)); };
  if (!tables.empty() && std::ranges::none_of(std::views::iota(0U, kTried), possible))
    tables.back().fail(
        "",
        "with all draws before it, hardly ever makes a body that can be: " + model::physical_fault(drawn({}, 0))->path,
        "draws that make a possible inertia together, as one draw for all of its moments");
  if (!vehicle.beat_averaged) return;
  // standard deviations that the vehicle file declares, for coefficients that the table does not name
  for (const model::BeatAveraged::Coefficient& c : vehicle.beat_averaged->coefficients) {
    const auto at = std::ranges::find(parameters, "coefficients." + c.name, &model::Parameter::path);
    const auto index = static_cast<std::size_t>(at - parameters.begin());
    const bool named =
        std::ranges::any_of(draws_, [&](const Draw& d) { return std::ranges::count(d.parameters, index) > 0; });
    if (named || c.sd == 0) continue;
    draws_.insert(draws_.begin() + static_cast<std::ptrdiff_t>(majors_),
                  {{index}, Law::add_normal, 0, c.sd, kDeclaredCut_sd, false});
    ++majors_;
  }
}

Randomisation Randomisation::of_posterior(model::Vehicle vehicle) {
  if (!vehicle.posterior) throw std::invalid_argument("a vehicle without posterior");
  const model::Posterior posterior = *std::exchange(vehicle.posterior, std::nullopt);
  const auto factor = model::lower_factor(posterior);
  if (!factor) throw std::invalid_argument("a covariance that is not positive definite");
  Randomisation r(std::move(vehicle));
  const std::vector<model::Parameter> parameters = model::parameters(r.nominal_);
  for (std::size_t i = 0; i < posterior.names.size(); ++i) {
    const auto at = std::ranges::find(parameters, posterior.names[i], &model::Parameter::path);
    if (at == parameters.end()) throw std::invalid_argument("no parameter " + posterior.names[i]);
    r.posterior_.push_back({static_cast<std::size_t>(at - parameters.begin()), posterior.means[i], (*factor)[i]});
  }
  return r;
}

Randomisation::Draw Randomisation::read_draw(const io::Table& table, const std::vector<model::Parameter>& parameters) {
  static const std::vector<std::string> kLaws = {"scale_normal", "scale_half_normal", "replace_normal",
                                                 "add_normal",   "scale_uniform",     "replace_uniform"};
  Draw draw{};
  for (const std::string& name : table.strings("parameters")) {
    const std::size_t before = draw.parameters.size();
    for (std::size_t i = 0; i < parameters.size(); ++i) {
      const std::string& path = parameters[i].path;
      if (path != name && !path.starts_with(name + ".")) continue;
      if (std::ranges::find(draw.parameters, i) != draw.parameters.end())
        table.fail("parameters", path + " is given twice", "each parameter once");
      if (path == "driver.hold_s")
        table.fail("parameters", path + " is the same for a whole batch", "what may differ from flapper to flapper");
      draw.parameters.push_back(i);
    }
    if (draw.parameters.size() == before) {
      std::vector<std::string> known;
      for (const model::Parameter& p : parameters) known.push_back(p.path);
      table.fail("parameters", "no parameter \"" + name + "\"",
                 "paths of the vehicle file" + io::did_you_mean(name, known));
    }
  }
  if (draw.parameters.empty()) table.fail("parameters", "is empty", "paths of the vehicle file");
  const std::string law = table.choice("law", kLaws);
  draw.law = static_cast<Law>(std::ranges::find(kLaws, law) - kLaws.begin());
  if (draw.law == Law::scale_uniform || draw.law == Law::replace_uniform) {
    draw.a = table.number("low");
    draw.b = table.number("high", {draw.a, 1e12});
    draw.cut_sd = 1;
  } else {
    draw.a = draw.law == Law::replace_normal ? table.number("mean") : 0;
    draw.b = table.number("sd", io::non_negative());
    draw.cut_sd = table.number_or("cut_sd", 3, {1, 8});
  }
  draw.minor = table.boolean_or("minor", false);
  return draw;
}

/// Extends the reach of each parameter by a draw, and refuses a draw that could leave the accepted range.
void Randomisation::check_reach(const io::Table& table, const Draw& draw,
                                const std::vector<model::Parameter>& parameters, std::vector<Reach>& reach) {
  for (const std::size_t i : draw.parameters) {
    const model::Parameter& p = parameters[i];
    const Reach before = reach[i];
    reach[i].low = reach[i].high = apply(draw, before.low, 0);
    for (const double from : {before.low, before.high})
      for (const double extreme : {-draw.cut_sd, 0.0, draw.cut_sd}) {
        const double value = apply(draw, from, extreme);
        if (value < p.low || value > p.high)
          table.fail("parameters", p.path + " could become " + six_digits(value),
                     "draws between " + six_digits(p.low) + " and " + six_digits(p.high));
        reach[i] = {std::min(reach[i].low, value), std::max(reach[i].high, value)};
      }
  }
}

/// Refuses impossible inertias at the ends of a draw, which suffice: possible inertias are convex, the laws linear.
void Randomisation::check_bodies(const io::Table& table, const Draw& draw) const {
  for (const double extreme : {-draw.cut_sd, 0.0, draw.cut_sd}) {
    model::Vehicle vehicle = nominal_;
    const std::vector<model::Parameter> parameters = model::parameters(vehicle);
    for (const std::size_t i : draw.parameters) *parameters[i].value = apply(draw, *parameters[i].value, extreme);
    if (const auto fault = model::physical_fault(vehicle))
      table.fail("parameters", fault->path + ": " + fault->what, fault->accepted);
  }
}

double Randomisation::apply(const Draw& draw, double nominal, double variate) {
  const double uniform = draw.a + (draw.b - draw.a) * std::clamp((variate + 1) / 2, 0.0, 1.0);
  switch (draw.law) {
    case Law::scale_normal:
      return nominal * (1 + draw.b * variate);
    case Law::scale_half_normal:
      return nominal * (1 + std::abs(draw.b * variate));
    case Law::replace_normal:
      return draw.a + draw.b * variate;
    case Law::add_normal:
      return nominal + draw.b * variate;
    case Law::scale_uniform:
      return nominal * uniform;
    case Law::replace_uniform:
      return uniform;
  }
  return nominal;
}

model::Vehicle Randomisation::sample(RandomKey key) const {
  key.stream = Stream::vehicle;
  if (!posterior_.empty()) {
    std::vector<double> variates;
    for (std::uint32_t i = 0; i < posterior_.size(); ++i) variates.push_back(normal(key, i));
    return from_posterior(std::move(variates));
  }
  if (draws_.empty()) return nominal_;
  for (std::uint32_t attempt = 0; attempt < kAttempts; ++attempt)
    if (model::Vehicle vehicle = drawn(key, attempt); !model::physical_fault(vehicle)) return vehicle;
  return nominal_;
}

model::Vehicle Randomisation::drawn(const RandomKey& key, std::uint32_t attempt) const {
  model::Vehicle vehicle = nominal_;
  const std::vector<model::Parameter> parameters = model::parameters(vehicle);
  std::uint32_t base = attempt * kIndicesPerAttempt;
  for (const Draw& draw : draws_) {
    if (draw.minor) break;
    double variate = 0;
    if (draw.law == Law::scale_uniform || draw.law == Law::replace_uniform) {
      variate = 2 * uniform_pair(key, base).first - 1;
    } else {
      for (std::uint32_t i = 0; i < kIndicesPerDraw; ++i) {
        variate = normal(key, base + i);
        if (std::abs(variate) <= draw.cut_sd) break;
      }
    }
    for (const std::size_t i : draw.parameters) *parameters[i].value = apply(draw, *parameters[i].value, variate);
    base += kIndicesPerDraw;
  }
  return vehicle;
}

model::Vehicle Randomisation::from_posterior(std::vector<double> variates) const {
  model::Vehicle vehicle = nominal_;
  const std::vector<model::Parameter> parameters = model::parameters(vehicle);
  // impossible inertias move towards the possible mean; possible ones are a convex set
  for (int tries = 0; tries < 60; ++tries) {
    for (const Uncertain& u : posterior_) {
      double value = u.mean;
      for (std::size_t k = 0; k < u.row.size(); ++k) value += u.row[k] * variates[k];
      const model::Parameter& p = parameters[u.parameter];
      *p.value = std::clamp(value, p.low, p.high);
    }
    if (!model::physical_fault(vehicle)) break;
    for (double& v : variates) v *= 0.75;
  }
  return vehicle;
}

void Randomisation::set_minors(const std::vector<double>& variates) {
  const std::vector<double> middle(majors(), 0);
  minors_.assign(variates.size(), 0);
  for (std::size_t k = 0; k < variates.size(); ++k) {
    minors_[k] = variates[k];
    for (int tries = 0; tries < 10 && model::physical_fault(at(middle)); ++tries) minors_[k] *= 0.5;
    if (model::physical_fault(at(middle))) minors_[k] = 0;
  }
}

bool Randomisation::is_uniform(std::size_t draw) const {
  if (!posterior_.empty()) return false;
  return draws_[draw].law == Law::scale_uniform || draws_[draw].law == Law::replace_uniform;
}

void Randomisation::narrow(const std::vector<std::string>& parts, double share) {
  for (std::size_t d = 0; d < draws_.size(); ++d) {
    const std::string path = name(d);
    if (std::ranges::none_of(parts, [&](const std::string& part) { return path.find(part) != std::string::npos; }))
      continue;
    Draw& draw = draws_[d];
    if (is_uniform(d)) {
      const double middle = (draw.a + draw.b) / 2, half = share * (draw.b - draw.a) / 2;
      draw.a = middle - half, draw.b = middle + half;
    } else {
      draw.b *= share;
    }
  }
}

std::string Randomisation::name(std::size_t draw) const {
  model::Vehicle vehicle = nominal_;
  const std::size_t first = posterior_.empty() ? draws_[draw].parameters.front() : posterior_[draw].parameter;
  return model::parameters(vehicle)[first].path;
}

model::Vehicle Randomisation::at(const std::vector<double>& variates) const {
  if (!posterior_.empty()) return from_posterior(variates);
  model::Vehicle vehicle = nominal_;
  const std::vector<model::Parameter> parameters = model::parameters(vehicle);
  for (std::size_t d = 0; d < draws_.size(); ++d) {
    Draw draw = draws_[d];
    if (draw.law == Law::scale_half_normal) draw.law = Law::scale_normal;
    const double variate = d < variates.size() ? variates[d] : minors_[d - majors_];
    for (const std::size_t i : draw.parameters)
      *parameters[i].value =
          std::clamp(apply(draw, *parameters[i].value, variate), parameters[i].low, parameters[i].high);
  }
  return vehicle;
}

Randomisation read_randomisation(model::Vehicle nominal, const io::Table& root) {
  root.schema(1);
  Randomisation randomisation(std::move(nominal), root);
  root.finish();
  return randomisation;
}

}  // namespace flappy::sim
