// The search for designs that no other design beats in every objective: NSGA-II (nsga2.hpp) over the unit cube of the
// variables, half of whose first generation is near the published robot; or random points of it. Each point is rounded
// to the workshop's steps and judged once. A search is a function of its configuration: one that was stopped takes the
// designs that it judged from its record and goes the same way again.
#pragma once

#include <functional>
#include <map>

#include "design/judge.hpp"
#include "io/ranks.hpp"

namespace flappy::design {

struct SearchConfig {
  bool random = false;  ///< random points, to compare with
  unsigned population = 0, generations = 0;
  std::uint64_t seed = 0;
  std::vector<Figure> objectives;
  int threads = 0;
  io::Ranks* ranks = nullptr;  ///< each rank judges its share of a generation
};

/// A judged design, as designs.csv keeps it.
struct Record {
  Values values;
  Figures figures;
  Stage reached = Stage::built;
  double flown_s = 0;
  std::string refused;
};

Record record_of(const Judged& judged);
/// Head and lines of a table of records; a line reads back as the same record.
std::string record_head();
std::string record_line(const Record& record);
/// Throws io::InputError, which names file and line, for anything else.
std::vector<Record> read_records(const std::filesystem::path& file);

struct Generation {
  unsigned number = 0;
  std::size_t designs = 0, front = 0;
  double flown_s = 0;  ///< time that all designs have flown so far
  double hypervolume = 0;
};

/// Whether objectives, as Search::objectives() gives them, are all better than those of the published robot.
bool beats_published(const std::vector<double>& objectives);

class Search {
 public:
  /// `known`: records of a search that was stopped.
  Search(const Judge& judge, SearchConfig config, const std::vector<Record>& known = {});

  /// Runs all generations. `progress` is called after each; false ends the search. Returns false if it was stopped.
  bool run(const std::function<bool(const Generation&)>& progress);

  const SearchConfig& config() const { return config_; }
  Stage upto() const { return upto_; }  ///< the last stage that objectives and limits need
  /// Its figures are known even where it misses limits; `refused` says which.
  const Record& published() const { return published_; }
  /// All designs, in the order in which they were asked for.
  std::vector<Record> records() const;
  /// Those that no other beats: as good in every objective, better in one. Ordered by the first objective.
  std::vector<Record> front() const;
  /// Objectives to be minimised, as changes against the published robot in shares of it; negative: better.
  std::vector<double> objectives(const Record& record) const;
  /// Volume of objectives that the front dominates and that dominate the published robot.
  double hypervolume() const;

 private:
  std::vector<std::vector<double>> judge_all(const std::vector<std::vector<double>>& points);
  void judge_missing(const std::vector<Values>& missing);
  bool report(unsigned number, const std::function<bool(const Generation&)>& progress);

  const Judge& judge_;
  SearchConfig config_;
  Stage upto_;
  Record published_;
  std::map<Values, Record> known_;
  std::vector<Values> order_;
};

}  // namespace flappy::design
