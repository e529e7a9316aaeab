#include <algorithm>
#include <cmath>

#include "gap/evidence/evidence.hpp"

namespace flappy::gap {

RegimeBasis::RegimeBasis(const std::vector<PredictedFlight>& flights) {
  values_.resize(flights.size());
  std::vector<std::vector<RegimeFunction>> functions;
  std::vector<Eigen::VectorXd> column;
  for (const PredictedFlight& f : flights) {
    functions.push_back(f.functions());
    column.push_back(Eigen::VectorXd::Ones(static_cast<Eigen::Index>(f.beats())));
  }
  // centred and of rms 1, but for the constant; what never changes is the constant
  const auto append = [&](const std::string& name, BasisFunction kind) {
    double sum = 0, squares = 0, n = 0;
    for (const Eigen::VectorXd& v : column)
      sum += v.sum(), squares += v.squaredNorm(), n += static_cast<double>(v.size());
    const bool constant = names_.empty();
    const double mean = constant ? 0 : sum / n;
    const double sd = constant ? 1 : std::sqrt(std::max(0.0, squares / n - mean * mean));
    if (!(sd > 1e-9 * (std::abs(mean) + 1e-3))) return;
    for (std::size_t f = 0; f < flights.size(); ++f) {
      values_[f].conservativeResize(column[f].size(), values_[f].cols() + 1);
      values_[f].rightCols(1) = (column[f].array() - mean) / sd;
    }
    names_.push_back(name);
    kinds_.push_back(kind);
  };
  append("1", BasisFunction::constant);
  if (flights.empty()) return;
  for (std::size_t i = 0; i < functions.front().size(); ++i) {
    for (std::size_t f = 0; f < flights.size(); ++f) column[f] = functions[f][i].values;
    append(functions.front()[i].name, functions.front()[i].kind);
  }
  // what changes from flight to flight, and would else look like a height at which one of them flew
  for (std::size_t own = 1; own < flights.size() && flights.front().within_the_beat(); ++own) {
    for (std::size_t f = 0; f < flights.size(); ++f) column[f].setConstant(f == own ? 1 : 0);
    append("flight " + flights[own].name(), BasisFunction::flight);
  }
  // of what is already centred, so that a product says what its factors do not
  const auto index = [&](const std::string& name) {
    return static_cast<Eigen::Index>(std::ranges::find(names_, name) - names_.begin());
  };
  // none of them where a factor never changes
  const std::vector<std::pair<std::string, std::string>> products = flights.front().products();
  if (std::ranges::any_of(products, [&](const auto& p) { return std::max(index(p.first), index(p.second)) >= size(); }))
    return;
  for (const auto& [a, b] : products) {
    const Eigen::Index i = index(a), j = index(b);
    for (std::size_t f = 0; f < flights.size(); ++f) column[f] = values_[f].col(i).cwiseProduct(values_[f].col(j));
    append(a + " " + b, BasisFunction::product);
  }
}

}  // namespace flappy::gap
