#include <algorithm>
#include <cmath>

#include "gap/evidence/evidence.hpp"

namespace flappy::gap {

RegimeBasis::RegimeBasis(const Flights& flights) {
  values_.resize(flights.size());
  std::vector<std::vector<RegimeFunction>> functions;
  std::vector<Eigen::VectorXd> column;
  for (const auto& f : flights) {
    functions.push_back(f->functions());
    column.push_back(Eigen::VectorXd::Ones(static_cast<Eigen::Index>(f->beats())));
  }
  // appends a function with mean 0 and rms 1, except the constant; a function that never changes is left out
  const auto append = [&](const std::string& name, const std::string& quantity, BasisFunction kind) {
    double sum = 0, squares = 0, n = 0;
    for (const Eigen::VectorXd& v : column)
      sum += v.sum(), squares += v.squaredNorm(), n += static_cast<double>(v.size());
    const bool constant = functions_.empty();
    const double mean = constant ? 0 : sum / n;
    const double sd = constant ? 1 : std::sqrt(std::max(0.0, squares / n - mean * mean));
    if (!(sd > 1e-9 * (std::abs(mean) + 1e-3))) return;
    for (std::size_t f = 0; f < flights.size(); ++f) {
      values_[f].conservativeResize(column[f].size(), values_[f].cols() + 1);
      values_[f].rightCols(1) = (column[f].array() - mean) / sd;
    }
    functions_.push_back({name, quantity, kind});
  };
  append("1", "always", BasisFunction::constant);
  if (flights.empty()) return;
  for (std::size_t i = 0; i < functions.front().size(); ++i) {
    for (std::size_t f = 0; f < flights.size(); ++f) column[f] = functions[f][i].values;
    append(functions.front()[i].name, functions.front()[i].quantity, functions.front()[i].kind);
  }
  // an offset for each flight would otherwise look like an influence of that flight's height
  for (std::size_t offset = 1; offset < flights.size() && flights.front()->policy().flight_offsets; ++offset) {
    for (std::size_t f = 0; f < flights.size(); ++f) column[f].setConstant(f == offset ? 1 : 0);
    append("flight " + flights[offset]->name(), "flight", BasisFunction::flight);
  }
  // products of centred functions; none at all if one of the factors never changes
  const auto index = [&](const std::string& name) {
    return static_cast<int>(std::ranges::find(functions_, name, &Function::name) - functions_.begin());
  };
  const std::vector<std::pair<std::string, std::string>> products = flights.front()->products();
  if (std::ranges::any_of(products, [&](const auto& p) { return std::max(index(p.first), index(p.second)) >= size(); }))
    return;
  for (const auto& [a, b] : products) {
    const int i = index(a), j = index(b);
    for (std::size_t f = 0; f < flights.size(); ++f) column[f] = values_[f].col(i).cwiseProduct(values_[f].col(j));
    append(a + " " + b, quantity(j), BasisFunction::product);
  }
}

}  // namespace flappy::gap
