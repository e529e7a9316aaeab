#include "model/beat_averaged.hpp"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>
#include <stdexcept>

#include "io/toml_writer.hpp"

namespace flappy::model {
namespace {

constexpr const char* kMotionNames[kMotionVariables] = {"v_x", "v_y", "v_z", "speed", "w_x", "w_y", "w_z", "battery"};
constexpr const char* kMixKeys[] = {"amplitude", "difference", "bias", "split_cycle"};
constexpr const char* kRoles[] = {"flapping", "stroke_plane", "other"};
constexpr const char* kAccepted =
    "sums and products of numbers, coefficients, actuators and motion, as \"k * left * v_x\"";
constexpr int kMaxPower = 4;
constexpr double kLargest = 1e6, kLongestLag_s = 2, kFarthest_m = 1;

struct Monomial {
  double factor = 1;
  std::vector<std::size_t> variables;
};
using Sum = std::vector<Monomial>;

constexpr std::size_t kMaxMonomials = 10'000;
constexpr int kMaxDepth = 32;

Sum times(const Sum& a, const Sum& b) {
  if (a.size() * b.size() > kMaxMonomials)
    throw ExpressionFault{"multiplied out, it has more than " + std::to_string(kMaxMonomials) + " terms",
                          "fewer terms"};
  Sum all;
  for (const Monomial& x : a)
    for (const Monomial& y : b) {
      all.push_back({x.factor * y.factor, x.variables});
      all.back().variables.insert(all.back().variables.end(), y.variables.begin(), y.variables.end());
    }
  return all;
}

/// Reads an expression: sum = product {+- product}, product = power {* power}, power = atom [^ whole].
class Reader {
 public:
  Reader(std::string_view text, const BeatAveraged& vehicle) : text_(text), vehicle_(vehicle) {}

  Sum read() {
    Sum all = sum();
    if (at_ < text_.size()) fail("\"" + std::string(text_.substr(at_)) + "\" is left over");
    return all;
  }

 private:
  [[noreturn]] static void fail(const std::string& what, const std::string& accepted = kAccepted) {
    throw ExpressionFault{what, accepted};
  }

  char next() {
    while (at_ < text_.size() && std::isspace(static_cast<unsigned char>(text_[at_]))) ++at_;
    return at_ < text_.size() ? text_[at_] : '\0';
  }
  bool take(char c) {
    if (next() != c) return false;
    ++at_;
    return true;
  }

  Sum sum() {
    Sum all;
    for (bool first = true;; first = false) {
      double sign = 1;
      if (take('-')) sign = -1;
      else if (!take('+') && !first) break;
      for (Monomial& m : product()) all.push_back({sign * m.factor, std::move(m.variables)});
    }
    next();
    return all;
  }

  Sum product() {
    Sum all = power();
    while (take('*')) all = times(all, power());
    return all;
  }

  Sum power() {
    Sum base = atom();
    if (!take('^')) return base;
    next();
    int n = 0;
    const auto end = std::from_chars(text_.data() + at_, text_.data() + text_.size(), n);
    if (end.ec != std::errc() || n < 1 || n > kMaxPower)
      fail("\"^\" is not followed by a power", "whole powers from 1 to " + std::to_string(kMaxPower));
    at_ = static_cast<std::size_t>(end.ptr - text_.data());
    Sum all = base;
    for (int i = 1; i < n; ++i) all = times(all, base);
    return all;
  }

  Sum atom() {
    if (take('(')) {
      if (++depth_ > kMaxDepth)
        fail("its parentheses are too deep", "at most " + std::to_string(kMaxDepth) + " in each other");
      Sum inner = sum();
      --depth_;
      if (!take(')')) fail("a \"(\" is not closed");
      return inner;
    }
    const char c = next();
    if (std::isdigit(static_cast<unsigned char>(c)) || c == '.') {
      double value = 0;
      const auto end = std::from_chars(text_.data() + at_, text_.data() + text_.size(), value);
      if (end.ec != std::errc()) fail("no number at \"" + std::string(text_.substr(at_)) + "\"");
      at_ = static_cast<std::size_t>(end.ptr - text_.data());
      return {{value, {}}};
    }
    const std::size_t from = at_;
    while (at_ < text_.size() && (std::isalnum(static_cast<unsigned char>(text_[at_])) || text_[at_] == '_')) ++at_;
    if (at_ == from)
      fail(from < text_.size() ? "nothing can stand at \"" + std::string(text_.substr(from)) + "\""
                               : "it ends too early");
    return named(text_.substr(from, at_ - from));
  }

  Sum named(std::string_view name) const {
    for (const BeatAveraged::Coefficient& c : vehicle_.coefficients)
      if (c.name == name) return {{c.value, {}}};
    for (std::size_t i = 0; i < vehicle_.actuators.size(); ++i)
      if (vehicle_.actuators[i].name == name) return {{1, {i}}};
    for (std::size_t i = 0; i < kMotionVariables; ++i)
      if (kMotionNames[i] == name) return {{1, {vehicle_.actuators.size() + i}}};
    std::vector<std::string> known;
    for (const BeatAveraged::Coefficient& c : vehicle_.coefficients) known.push_back(c.name);
    for (const BeatAveraged::Actuator& a : vehicle_.actuators) known.push_back(a.name);
    known.insert(known.end(), std::begin(kMotionNames), std::end(kMotionNames));
    fail("nothing is called \"" + std::string(name) + "\"",
         io::joined(known) + io::did_you_mean(std::string(name), known));
  }

  std::string_view text_;
  std::size_t at_ = 0;
  int depth_ = 0;
  const BeatAveraged& vehicle_;
};

void check_name(const io::Table& table, const std::string& name, const BeatAveraged& v) {
  const bool word =
      !name.empty() && !std::isdigit(static_cast<unsigned char>(name.front())) &&
      std::ranges::all_of(name, [](char c) { return std::isalnum(static_cast<unsigned char>(c)) || c == '_'; });
  if (!word) table.fail(name, "no expression can name this", "letters, digits and underscores, a letter first");
  const bool twice = std::ranges::count(v.actuators, name, &BeatAveraged::Actuator::name) > 0 ||
                     std::ranges::count(kMotionNames, name) > 0 ||
                     std::ranges::count(v.coefficients, name, &BeatAveraged::Coefficient::name) > 0;
  if (twice) table.fail(name, "something else has this name", "another name");
}

}  // namespace

std::optional<ExpressionFault> expression_fault(std::string_view text, const BeatAveraged& vehicle) {
  try {
    Reader(text, vehicle).read();
  } catch (const ExpressionFault& fault) {
    return fault;
  }
  return std::nullopt;
}

BeatAveragedWrench::BeatAveragedWrench(const BeatAveraged& vehicle) {
  for (const BeatAveraged::Wrench& w : vehicle.wrenches) {
    const double at[3] = {w.at_m.x, w.at_m.y, w.at_m.z};
    for (std::size_t k = 0; k < w.terms.size(); ++k) {
      if (w.terms[k].empty()) continue;
      Sum sum;
      try {
        sum = Reader(w.terms[k], vehicle).read();
      } catch (const ExpressionFault& fault) {
        throw std::invalid_argument(fault.what);
      }
      for (const Monomial& m : sum) {
        double factor = m.factor;
        for (std::size_t i = 0; i < vehicle.actuators.size(); ++i)
          if (std::ranges::count(m.variables, i) > 0) factor *= vehicle.actuators[i].load_share;
        products_.push_back({k, factor, m.variables});
        if (k >= 3) continue;
        const std::size_t next = (k + 1) % 3, last = (k + 2) % 3;
        if (at[last] != 0) products_.push_back({3 + next, factor * at[last], m.variables});
        if (at[next] != 0) products_.push_back({3 + last, -factor * at[next], m.variables});
      }
    }
  }
  has_moments_ = std::ranges::any_of(products_, [](const Product& p) { return p.component >= 3; });
}

BeatAveragedWrench::BeatAveragedWrench(std::vector<Product> products)
    : products_(std::move(products)),
      has_moments_(std::ranges::any_of(products_, [](const Product& p) { return p.component >= 3; })) {}

BeatAveragedLoad BeatAveragedWrench::at(std::span<const double> variables) const {
  BeatAveragedLoad load;
  for (const Product& p : products_) {
    double value = p.factor;
    for (const std::size_t v : p.variables) value *= variables[v];
    (p.component < 3 ? load.force_N[p.component] : load.moment_Nm[p.component - 3]) += value;
  }
  return load;
}

BeatAveraged::Input read_input(const std::string& name, const io::Table& t) {
  const io::Range any{-kLargest, kLargest};
  const double low = t.number("low", any);
  BeatAveraged::Input input{name, low, t.number("high", {low, kLargest})};
  input.neutral = t.number_or("neutral", std::clamp(0.0, low, input.high), {low, input.high});
  for (std::size_t k = 0; k < input.mix.size(); ++k) input.mix[k] = t.number_or(kMixKeys[k], 0, any);
  return input;
}

BeatAveraged read_beat_averaged(const io::Table& root, bool predicted) {
  BeatAveraged v;
  v.predicted = predicted;
  const io::Table beat = root.table("beat");
  v.nominal_Hz = beat.number("nominal_Hz", {1e-3, 1e4});
  v.bandwidth_Hz = beat.number("bandwidth_Hz", {1e-3, v.nominal_Hz / 2});
  v.compares_moments = beat.boolean_or("compares_moments", true);
  v.trims = beat.boolean_or("trims", false);
  const io::Range any{-kLargest, kLargest};
  const auto each = [&](const char* key, const auto& read) {
    if (predicted && !root.has(key)) return;
    const io::Table all = root.table(key);
    for (const std::string& name : all.keys()) read(all, name, all.table(name));
  };
  each("input",
       [&](const io::Table&, const std::string& name, const io::Table& t) { v.inputs.push_back(read_input(name, t)); });
  std::vector<std::string> columns;
  for (const BeatAveraged::Input& i : v.inputs) columns.push_back(i.name);
  each("actuator", [&](const io::Table& actuators, const std::string& name, const io::Table& t) {
    check_name(actuators, name, v);
    BeatAveraged::Actuator a{name, t.choice("input", columns)};
    const std::string role = t.choice("role", {std::begin(kRoles), std::end(kRoles)});
    a.role = static_cast<BeatAveraged::Role>(std::ranges::find(kRoles, role) - std::begin(kRoles));
    a.gain = t.number("gain", any);
    a.offset = t.number_or("offset", 0, any);
    a.lag_s = t.number_or("lag_s", 0, {0, kLongestLag_s});
    v.actuators.push_back(std::move(a));
  });
  if ((v.actuators.empty() && !predicted) || v.actuators.size() > kMaxActuators)
    root.fail("actuator", v.actuators.empty() ? "there is none" : "there are too many",
              "1 to " + std::to_string(kMaxActuators) + " tables [actuator.NAME]");
  if (const auto coefficients = root.optional_table("coefficients"))
    for (const std::string& name : coefficients->keys()) {
      check_name(*coefficients, name, v);
      const bool known = coefficients->is_table(name);
      BeatAveraged::Coefficient c{name, coefficients->number(known ? name + ".value" : name, any)};
      if (known) c.sd = coefficients->number(name + ".sd", {0, kLargest});
      if (predicted) c.predicted_at = known ? coefficients->number_or(name + ".predicted_at", c.value, any) : c.value;
      v.coefficients.push_back(std::move(c));
    }
  if (predicted) return v;
  each("wrench", [&](const io::Table& wrenches, const std::string& name, const io::Table& t) {
    if (!io::is_bare(name)) wrenches.fail(name, "is no name of a wrench", "letters, digits, underscores and dashes");
    BeatAveraged::Wrench w{name, {}, {}};
    const io::Range near{-kFarthest_m, kFarthest_m};
    if (t.has("at_m")) w.at_m = {t.number("at_m.x", near), t.number("at_m.y", near), t.number("at_m.z", near)};
    bool any_term = false;
    for (std::size_t k = 0; k < w.terms.size(); ++k) {
      w.terms[k] = t.string_or(kLoadNames[k], "");
      if (w.terms[k].empty()) continue;
      any_term = true;
      if (const auto fault = expression_fault(w.terms[k], v)) t.fail(kLoadNames[k], fault->what, fault->accepted);
    }
    if (!any_term)
      wrenches.fail(name, "has no force and no moment", io::joined({kLoadNames.begin(), kLoadNames.end()}));
    v.wrenches.push_back(std::move(w));
  });
  return v;
}

std::string input_text(const BeatAveraged::Input& i) {
  std::string text;
  const auto number = [&](const std::string& key, double value) {
    text += "input." + i.name + "." + key + " = " + io::toml_number(value) + "\n";
  };
  number("low", i.low);
  number("high", i.high);
  if (i.neutral != 0) number("neutral", i.neutral);
  for (std::size_t k = 0; k < i.mix.size(); ++k)
    if (i.mix[k] != 0) number(kMixKeys[k], i.mix[k]);
  return text;
}

std::string beat_averaged_text(const BeatAveraged& v) {
  std::string text;
  const auto line = [&](const std::string& path, const std::string& value) { text += path + " = " + value + "\n"; };
  const auto number = [&](const std::string& path, double value) { line(path, io::toml_number(value)); };
  number("beat.nominal_Hz", v.nominal_Hz);
  number("beat.bandwidth_Hz", v.bandwidth_Hz);
  if (!v.compares_moments) line("beat.compares_moments", "false");
  if (v.trims) line("beat.trims", "true");
  for (const BeatAveraged::Input& i : v.inputs) text += input_text(i);
  for (const BeatAveraged::Actuator& a : v.actuators) {
    line("actuator." + a.name + ".input", io::toml_string(a.input));
    line("actuator." + a.name + ".role", io::toml_string(kRoles[static_cast<int>(a.role)]));
  }
  for (const BeatAveraged::Coefficient& c : v.coefficients) {
    number("coefficients." + c.name + ".value", c.value);
    number("coefficients." + c.name + ".sd", c.sd);
    if (v.predicted && c.predicted_at != c.value) number("coefficients." + c.name + ".predicted_at", c.predicted_at);
  }
  for (const BeatAveraged::Wrench& w : v.wrenches) {
    if (w.at_m.x != 0 || w.at_m.y != 0 || w.at_m.z != 0) {
      number("wrench." + w.name + ".at_m.x", w.at_m.x);
      number("wrench." + w.name + ".at_m.y", w.at_m.y);
      number("wrench." + w.name + ".at_m.z", w.at_m.z);
    }
    for (std::size_t k = 0; k < w.terms.size(); ++k)
      if (!w.terms[k].empty()) line("wrench." + w.name + "." + kLoadNames[k], io::toml_string(w.terms[k]));
  }
  return text;
}

}  // namespace flappy::model
