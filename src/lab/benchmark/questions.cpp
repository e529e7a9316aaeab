#include "lab/benchmark/questions.hpp"

#include <sstream>

#include "io/files.hpp"
#include "io/sha256.hpp"

namespace flappy::benchmark {

namespace fs = std::filesystem;

fs::path BenchQuestions::vehicle_of(const Manifest& manifest) const {
  return vehicle.empty() ? fs::path(manifest.vehicle) : vehicle;
}

std::string BenchQuestions::other_option(const fs::path& file) const {
  std::string now;
  for (const auto& [option, path] : {std::pair{"--priors", priors},
                                     {"--discrepancy", discrepancy},
                                     {"--sessions", sessions},
                                     {"--verdict", verdict}})
    now += std::string(option) + " " + (path.empty() ? "default" : io::sha256(io::read_text(path))) + "\n";
  if (!fs::exists(file)) {
    io::write_atomically(file, now);
    return {};
  }
  std::istringstream kept(io::read_text(file)), asked(now);
  for (std::string before, line; std::getline(asked, line);)
    if (!std::getline(kept, before) || before != line) return line.substr(0, line.find(' '));
  return {};
}

Question BenchQuestions::question(const fs::path& folder, const Manifest& manifest, const PublicCase& of) const {
  Question q;
  q.flights = of.flights(folder);
  q.reference = of.references(folder);
  q.vehicle = vehicle_of(manifest);
  q.priors = priors;
  q.discrepancy = discrepancy;
  q.verdict = verdict;
  q.sessions = sessions;
  return q;
}

}  // namespace flappy::benchmark
