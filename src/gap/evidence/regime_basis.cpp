#include <algorithm>
#include <cmath>

#include "gap/evidence/evidence.hpp"

namespace flappy::gap {

RegimeBasis::RegimeBasis(const EvidenceRules& rules, const Flights& flights) {
  covered_.fill(true);
  append_functions(flights, rules.offsets(flights));
  const std::vector<std::size_t> apart = rules.apart(flights);
  if (apart.empty()) return;
  append_of_tests(flights, apart);
  find_covered(flights);
}

void RegimeBasis::append_functions(const Flights& flights, const std::vector<std::size_t>& offsets) {
  values_.resize(flights.size());
  std::vector<std::vector<RegimeFunction>> functions;
  std::vector<Eigen::VectorXd> column;
  for (const auto& f : flights.all()) {
    functions.push_back(f->functions());
    column.push_back(Eigen::VectorXd::Ones(static_cast<Eigen::Index>(f->beats())));
  }
  // Appends a function with mean 0 and rms 1, except the constant, over the flights in the air and over the runs on a
  // bench: how high a bench stands tells nothing of flights. 0 where it never changes; left out if it changes nowhere.
  const auto append = [&](const std::string& name, const std::string& quantity, BasisFunction kind) {
    const bool constant = functions_.empty();
    bool changes = constant;
    for (const bool on_bench : {false, true}) {
      const auto in_setting = [&](std::size_t f) { return flights[f]->clamped() == on_bench; };
      double sum = 0, squares = 0, n = 0;
      for (std::size_t f = 0; f < column.size(); ++f)
        if (in_setting(f))
          sum += column[f].sum(), squares += column[f].squaredNorm(), n += static_cast<double>(column[f].size());
      if (n == 0 || constant) continue;
      const double mean = sum / n, sd = std::sqrt(std::max(0.0, squares / n - mean * mean));
      const bool here = sd > 1e-9 * (std::abs(mean) + 1e-3);
      changes = changes || here;
      for (std::size_t f = 0; f < column.size(); ++f)
        if (in_setting(f) && here) column[f] = (column[f].array() - mean) / sd;
        else if (in_setting(f)) column[f].setZero();
    }
    if (!changes) return;
    for (std::size_t f = 0; f < flights.size(); ++f) {
      values_[f].conservativeResize(column[f].size(), values_[f].cols() + 1);
      values_[f].rightCols(1) = column[f];
    }
    functions_.push_back({name, quantity, kind});
  };
  append("1", "always", BasisFunction::constant);
  if (flights.size() == 0) return;
  for (std::size_t f = 1; f < flights.size(); ++f)
    if (!std::ranges::equal(functions[f], functions.front(), {}, &RegimeFunction::name, &RegimeFunction::name))
      throw io::InputError(flights[f]->name() + ": has other streams than " + flights[0]->name() +
                           "; accepted: flights with the same streams");
  for (std::size_t i = 0; i < functions.front().size(); ++i) {
    for (std::size_t f = 0; f < flights.size(); ++f) column[f] = functions[f][i].values;
    append(functions.front()[i].name, functions.front()[i].quantity, functions.front()[i].kind);
  }
  // an offset for each flight would otherwise look like an influence of that flight's height
  for (const std::size_t offset : offsets) {
    for (std::size_t f = 0; f < flights.size(); ++f) column[f].setConstant(f == offset ? 1 : 0);
    append("flight " + flights[offset]->name(), "flight", BasisFunction::flight);
  }
  // A contrast of a bench alone has none. Choice: with them two of four harmless development robots were called changed.
  if (!flights.references.empty() && std::ranges::all_of(flights.all(), [](const auto& f) { return f->clamped(); }))
    return;
  // products of centred functions; none at all if one of the factors never changes
  const auto index = [&](const std::string& name) {
    return static_cast<int>(std::ranges::find(functions_, name, &Function::name) - functions_.begin());
  };
  std::vector<std::pair<std::string, std::string>> products;
  for (const auto& f : flights.all())
    for (const auto& pair : f->products())
      if (std::ranges::count(products, pair) == 0) products.push_back(pair);
  if (std::ranges::any_of(products, [&](const auto& p) { return std::max(index(p.first), index(p.second)) >= size(); }))
    return;
  for (const auto& [a, b] : products) {
    const int i = index(a), j = index(b);
    for (std::size_t f = 0; f < flights.size(); ++f) column[f] = values_[f].col(i).cwiseProduct(values_[f].col(j));
    append(a + " " + b, quantity(j), BasisFunction::product);
  }
}

void RegimeBasis::append_of_tests(const Flights& flights, const std::vector<std::size_t>& tests) {
  const int once = size();
  for (int i = 0; i < once; ++i) {
    if (kind(i) == BasisFunction::flight) continue;
    for (std::size_t f = 0; f < flights.size(); ++f) {
      const Eigen::VectorXd column = (std::ranges::count(tests, f) > 0 ? 1.0 : 0.0) * values_[f].col(i);
      values_[f].conservativeResize(column.size(), values_[f].cols() + 1);
      values_[f].rightCols(1) = column;
    }
    functions_.push_back({name(i), quantity(i), kind(i), true});
  }
  in_all_ = in_tests_ = Eigen::MatrixXd::Zero(size(), size());
  int again = once;
  for (int i = 0; i < once; ++i) {
    if (kind(i) != BasisFunction::flight) {
      in_tests_(i, again) = in_tests_(again, again) = 1;
      in_all_(i, i) = in_all_(again, i) = 1;
      ++again;
      continue;
    }
    // the offset of a flight: one value in it, another in all others
    const auto largest = std::ranges::max_element(values_, {}, [&](const auto& v) { return v(0, i); });
    in_all_(i, i) = 1;
    const std::size_t own = static_cast<std::size_t>(largest - values_.begin());
    double elsewhere = (*largest)(0, i);
    for (std::size_t f = 0; f < flights.size(); ++f)
      if (flights[f]->clamped() == flights[own]->clamped()) elsewhere = std::min(elsewhere, values_[f](0, i));
    in_tests_(i, once) = elsewhere;
    if (flights.is_reference(own)) continue;
    in_tests_(i, i) = 1;
    in_tests_(i, 0) = -elsewhere;
  }
}

Eigen::MatrixXd RegimeBasis::without_offsets(bool as_test) const {
  Eigen::MatrixXd to = Eigen::MatrixXd::Zero(size(), size());
  int again = static_cast<int>(std::ranges::count(functions_, false, &Function::of_tests));
  for (int i = 0; i < size() && !of_tests(i); ++i) {
    if (kind(i) == BasisFunction::flight) continue;
    to(i, i) = 1;
    if (as_test) to(i, again) = 1;
    ++again;
  }
  return to;
}

/// By the mean over a class's functions of their variance in the references over that in the tests, at most 1 each.
void RegimeBasis::find_covered(const Flights& flights) {
  // References cover a class of regimes if they have this share of its variance in the tests. Choice.
  constexpr double kCovered = 0.5;
  const auto variance = [&](int i, bool of_reference) {
    double sum = 0, squares = 0, n = 0;
    for (std::size_t f = 0; f < flights.size(); ++f) {
      if (flights.is_reference(f) != of_reference) continue;
      const auto v = values_[f].col(i);
      sum += v.sum(), squares += v.squaredNorm(), n += static_cast<double>(v.size());
    }
    return squares / n - sum * sum / (n * n);
  };
  std::array<double, static_cast<std::size_t>(Regimes::count)> shares{}, counts{};
  for (int i = 1; i < size() && !of_tests(i); ++i) {
    if (kind(i) == BasisFunction::flight) continue;
    const auto c = static_cast<std::size_t>(regimes_of(kind(i)));
    const double in_tests = variance(i, false);
    shares[c] += in_tests > 0 ? std::min(1.0, variance(i, true) / in_tests) : 1;
    counts[c] += 1;
  }
  for (std::size_t c = 0; c < covered_.size(); ++c) covered_[c] = counts[c] == 0 || shares[c] >= kCovered * counts[c];
}

}  // namespace flappy::gap
