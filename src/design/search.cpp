#include "design/search.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>
#include <pagmo/utils/hypervolume.hpp>
#include <set>
#include <sstream>

#include "design/nsga2.hpp"
#include "io/parallel.hpp"
#include "io/progress.hpp"
#include "io/refuse.hpp"
#include "sim/random.hpp"

namespace flappy::design {
namespace {

constexpr const char* kStages[] = {"built", "stand", "hover", "escape", "effects"};
constexpr double kAway = 0.1;                   // sd of first designs about the published one, in shares of each range
constexpr std::uint32_t kNearBuilt = 1U << 31;  // takes the place of a generation in the keys of their random numbers
constexpr double kRefused =
    10;  // an objective of refused designs, more for each stage that they miss: worse than any other

struct Stopped {};

bool beats(const std::vector<double>& a, const std::vector<double>& b) {
  bool better = false;
  for (std::size_t i = 0; i < a.size(); ++i) {
    if (a[i] > b[i]) return false;
    better = better || a[i] < b[i];
  }
  return better;
}

double number_in(const std::string& text) {
  if (text.empty()) return std::numeric_limits<double>::quiet_NaN();
  double value = 0;
  const auto read = std::from_chars(text.data(), text.data() + text.size(), value);
  if (read.ec != std::errc{} || read.ptr != text.data() + text.size()) throw std::invalid_argument(text);
  return value;
}

Record read_record(const std::string& line) {
  std::istringstream in(line);
  const auto cell = [&] {
    std::string text;
    if (!std::getline(in, text, ',')) throw std::invalid_argument("too few cells");
    return text;
  };
  Record r;
  for (double& v : r.values) v = number_in(cell());
  for (double& f : r.figures) f = number_in(cell());
  const auto stage = std::ranges::find(kStages, cell());
  if (stage == std::end(kStages)) throw std::invalid_argument("stage");
  r.reached = static_cast<Stage>(stage - kStages);
  r.flown_s = number_in(cell());
  std::getline(in, r.refused);
  return r;
}

}  // namespace

bool beats_published(const std::vector<double>& objectives) {
  return std::ranges::all_of(objectives, [](double x) { return x < 0; });
}

Record record_of(const Judged& j) { return {j.robot.values, j.figures, j.reached, j.flown_s, j.refused}; }

std::string record_head() {
  std::string head;
  for (std::size_t i = 0; i < kQuantities; ++i) head += info_of(static_cast<Quantity>(i)).name + std::string(",");
  for (std::size_t i = 0; i < kFigures; ++i) head += info_of(static_cast<Figure>(i)).name + std::string(",");
  return head + "reached,flown_s,refused";
}

std::string record_line(const Record& r) {
  std::string line;
  for (const double v : r.values) line += io::shortest_digits(v) + ",";
  for (const double f : r.figures) line += (std::isnan(f) ? "" : io::shortest_digits(f)) + ",";
  return line + kStages[static_cast<std::size_t>(r.reached)] + "," + io::shortest_digits(r.flown_s) + "," + r.refused;
}

std::vector<Record> read_records(const std::filesystem::path& file) {
  std::istringstream in(io::read_text(file));
  std::vector<Record> records;
  std::string line;
  for (int number = 1; std::getline(in, line); ++number) try {
      if (number > 1) records.push_back(read_record(line));
      else if (line != record_head()) throw std::invalid_argument("head");
    } catch (const std::invalid_argument&) {
      io::refuse(file, "line " + std::to_string(number) + " is no record of a design", "what flappy-design wrote");
    }
  return records;
}

Search::Search(const Judge& judge, SearchConfig config, const std::vector<Record>& known)
    : judge_(judge), config_(std::move(config)), upto_(Stage::built) {
  for (const Figure f : config_.objectives) upto_ = std::max(upto_, info_of(f).stage);
  for (const Limit& l : judge_.config().limits) upto_ = std::max(upto_, info_of(l.figure).stage);
  for (const Record& r : known) known_.emplace(r.values, r);
  published_ = record_of(judge_.judge_published(upto_));
}

std::vector<double> Search::objectives(const Record& r) const {
  std::vector<double> f;
  for (const Figure figure : config_.objectives) {
    if (!r.refused.empty()) {
      f.push_back(kRefused * (1 + static_cast<double>(upto_) - static_cast<double>(r.reached)));
      continue;
    }
    const double was = figure_of(published_.figures, figure), is = figure_of(r.figures, figure);
    const double scale = is_share(figure) || was == 0 ? 1 : std::abs(was);
    // a power or a time that the published robot never has: any is better, a lower one more so
    const double worse = std::isfinite(was) ? (is - was) / scale : -1 / (1 + is);
    const double change = info_of(figure).more_is_better ? -worse : worse;
    f.push_back(std::isfinite(change) ? std::min(change, kRefused / 2) : kRefused / 2);
  }
  return f;
}

void Search::judge_missing(const std::vector<Values>& missing) {
  const auto [first, last] = io::own_share(config_.ranks, missing.size());
  std::vector<Record> found(last - first);
  std::vector<char> done(last - first, 0);
  io::parallel_for(found.size(), config_.threads, [&](std::size_t i) {
    if (io::interrupted()) return;
    found[i] = record_of(judge_.judge(missing[first + i], upto_));
    done[i] = 1;
  });
  std::string text;
  for (std::size_t i = 0; i < found.size(); ++i)
    if (done[i]) text += record_line(found[i]) + "\n";
  if (config_.ranks != nullptr) {
    std::string all;
    for (const auto& bytes : config_.ranks->gather(std::as_bytes(std::span(text))))
      all.append(reinterpret_cast<const char*>(bytes.data()), bytes.size());
    text = all;
  }
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    Record r = read_record(line);
    known_.emplace(r.values, std::move(r));
  }
  if (io::any(config_.ranks, io::interrupted())) throw Stopped{};
}

std::vector<std::vector<double>> Search::judge_all(const std::vector<std::vector<double>>& points) {
  std::vector<Values> values, missing;
  std::set<Values> asked;
  for (const std::vector<double>& p : points) {
    values.push_back(judge_.config().space.values(p));
    if (asked.insert(values.back()).second && !known_.contains(values.back())) missing.push_back(values.back());
  }
  if (!missing.empty()) judge_missing(missing);
  std::vector<std::vector<double>> f;
  const std::set<Values> ordered(order_.begin(), order_.end());
  std::set<Values> now;
  for (const Values& v : values) {
    if (!ordered.contains(v) && now.insert(v).second) order_.push_back(v);
    f.push_back(objectives(known_.at(v)));
  }
  return f;
}

bool Search::report(unsigned number, const std::function<bool(const Generation&)>& progress) {
  Generation g{number, order_.size(), front().size(), 0, hypervolume()};
  for (const Values& v : order_) g.flown_s += known_.at(v).flown_s;
  return !io::any(config_.ranks, !progress(g));
}

bool Search::run(const std::function<bool(const Generation&)>& progress) try {
  const std::size_t n = judge_.config().space.variables.size();
  const auto drawn = [&](unsigned generation) {
    std::vector<std::vector<double>> list;
    for (unsigned i = 0; i < config_.population; ++i) {
      const sim::RandomKey key{config_.seed, i, generation, sim::Stream::design};
      list.emplace_back();
      for (std::size_t k = 0; k < n; ++k)
        list.back().push_back(sim::uniform_pair(key, static_cast<std::uint32_t>(k)).first);
    }
    return list;
  };
  if (config_.random) {
    for (unsigned g = 0; g < config_.generations; ++g) {
      judge_all(drawn(g));
      if (!report(g + 1, progress)) return false;
    }
    return true;
  }
  Points first = drawn(0);
  const std::vector<double> built = judge_.config().space.unit(judge_.config().space.built);
  for (unsigned i = 0; i < config_.population / 2; ++i)
    for (std::size_t k = 0; k < n; ++k) {
      const sim::RandomKey key{config_.seed, i, kNearBuilt, sim::Stream::design};
      const double away = i == 0 ? 0 : kAway * sim::normal(key, static_cast<std::uint32_t>(k));
      first[i][k] = std::clamp(built[k] + away, 0.0, 1.0);
    }
  Points points = std::move(first), f = judge_all(points);
  if (!report(1, progress)) return false;
  for (unsigned g = 1; g < config_.generations; ++g) {
    const Points children = children_of(points, f, static_cast<unsigned>(config_.seed) * 1000003U + g);
    const Points theirs = judge_all(children);
    Points all = std::move(points), all_f = std::move(f);
    all.insert(all.end(), children.begin(), children.end());
    all_f.insert(all_f.end(), theirs.begin(), theirs.end());
    points.clear(), f.clear();
    for (const std::size_t i : best_of(all_f, config_.population)) points.push_back(all[i]), f.push_back(all_f[i]);
    if (!report(g + 1, progress)) return false;
  }
  return true;
} catch (const Stopped&) {
  return false;
}

std::vector<Record> Search::records() const {
  std::vector<Record> list;
  const std::set<Values> ordered(order_.begin(), order_.end());
  for (const Values& v : order_) list.push_back(known_.at(v));
  for (const auto& [v, record] : known_)  // a stopped generation judged some that no point has asked for since
    if (!ordered.contains(v)) list.push_back(record);
  return list;
}

std::vector<Record> Search::front() const {
  std::vector<std::pair<std::vector<double>, const Record*>> kept;
  for (const Values& v : order_) {
    const Record& r = known_.at(v);
    if (!r.refused.empty()) continue;
    const std::vector<double> f = objectives(r);
    if (std::ranges::any_of(kept, [&](const auto& k) { return k.first == f || beats(k.first, f); })) continue;
    std::erase_if(kept, [&](const auto& k) { return beats(f, k.first); });
    kept.emplace_back(f, &r);
  }
  std::ranges::sort(kept, {}, [](const auto& k) { return k.first; });
  std::vector<Record> list;
  for (const auto& [f, record] : kept) list.push_back(*record);
  return list;
}

double Search::hypervolume() const {
  std::vector<std::vector<double>> better;
  for (const Record& r : front()) {
    const std::vector<double> f = objectives(r);
    if (beats_published(f)) better.push_back(f);
  }
  if (better.empty()) return 0;
  return pagmo::hypervolume(better, true).compute(std::vector<double>(config_.objectives.size(), 0));
}

}  // namespace flappy::design
