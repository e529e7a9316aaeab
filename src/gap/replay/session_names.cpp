#include "gap/replay/session_names.hpp"

#include <map>

namespace flappy::gap {

std::vector<std::string> session_names(const FlightList& flights) {
  std::vector<std::string> names;
  for (const auto& flight : flights) names.push_back(flight->session());
  return names;
}

std::vector<int> session_numbers(const std::vector<std::string>& names) {
  std::vector<int> of;
  std::map<std::string, int> named;
  int next = 0;
  for (const std::string& name : names) {
    const auto [at, fresh] = named.try_emplace(name.empty() ? "/" + std::to_string(next) : name, next);
    next += fresh;
    of.push_back(at->second);
  }
  return of;
}

}  // namespace flappy::gap
