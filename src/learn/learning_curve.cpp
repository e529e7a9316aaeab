#include "learn/learning_curve.hpp"

#include <algorithm>
#include <cmath>
#include <random>
#include <stdexcept>

#include "io/files.hpp"
#include "io/gnuplot.hpp"
#include "io/statistics.hpp"
#include "learn/metrics.hpp"

namespace flappy::learn {
namespace {

constexpr std::size_t kResamples = 10000;

}  // namespace

SeedCurve read_seed_curve(const std::filesystem::path& run, std::uint64_t seed, const std::string& score) {
  const MetricsTable metrics = read_metrics(run / "metrics.jsonl"), timing = read_metrics(run / "timing.jsonl");
  const auto& scores = metrics.column(score);
  const auto& updates = metrics.column(metrics.names.front());
  const auto& wall_s = timing.column("wall_s");
  if (wall_s.size() < scores.size())
    throw io::InputError(timing.file + ": has fewer records than metrics.jsonl; accepted: files of one run");
  SeedCurve curve{seed, {}};
  for (std::size_t i = 0; i < scores.size(); ++i)
    if (std::isfinite(scores[i]))
      curve.points.push_back({static_cast<std::uint64_t>(updates[i]), wall_s[i], scores[i]});
  return curve;
}

double interquartile_mean(std::vector<double> values) {
  if (values.empty()) throw std::logic_error("interquartile mean of nothing");
  std::ranges::sort(values);
  const std::size_t cut = values.size() / 4;
  return io::mean(std::span(values).subspan(cut, values.size() - 2 * cut));
}

io::Interval bootstrap_interval(std::span<const double> values) {
  // Not std::uniform_int_distribution: the standard fixes the generator's numbers, not the distributions'.
  std::mt19937_64 generator(1);  // NOLINT(bugprone-random-generator-seed,cert-msc51-cpp): to be reproducible
  std::vector<double> resample(values.size()), means(kResamples);
  for (double& each : means) {
    for (double& value : resample) value = values[(generator() >> 32) * values.size() >> 32];
    each = interquartile_mean(resample);
  }
  return {io::quantile(means, 0.025), io::quantile(means, 0.975)};
}

LearningCurve learning_curve(std::span<const SeedCurve> runs) {
  if (runs.empty() || runs.front().points.empty())
    throw io::InputError("learning curve: no evaluations; accepted: at least one run with evaluations");
  LearningCurve curve;
  for (const auto& run : runs) {
    curve.seeds.push_back(run.seed);
    const auto same = [](const CurvePoint& a, const CurvePoint& b) { return a.update == b.update; };
    if (!std::ranges::equal(run.points, runs.front().points, same))
      throw io::InputError("learning curve: seed " + std::to_string(run.seed) + " has " +
                           std::to_string(run.points.size()) + " evaluations, seed " + std::to_string(curve.seeds[0]) +
                           " " + std::to_string(runs.front().points.size()) +
                           ", or at other updates; accepted: runs evaluated at the same updates");
    for (const auto& point : run.points)
      if (!std::isfinite(point.score))
        throw io::InputError("learning curve: seed " + std::to_string(run.seed) + ", update " +
                             std::to_string(point.update) + ": the score is not finite; accepted: a number");
  }
  for (std::size_t i = 0; i < runs.front().points.size(); ++i) {
    CurveRow row;
    row.update = runs.front().points[i].update;
    std::vector<double> wall_s;
    for (const auto& run : runs) {
      row.scores.push_back(run.points[i].score);
      wall_s.push_back(run.points[i].wall_s);
    }
    row.median_wall_s = io::median(wall_s);
    row.mean = io::mean(row.scores);
    row.iqm = interquartile_mean(row.scores);
    row.interval = bootstrap_interval(row.scores);
    curve.rows.push_back(std::move(row));
  }
  return curve;
}

void write_curve_csv(const std::filesystem::path& path, const LearningCurve& curve) {
  std::string text = "update,median_wall_s,mean,iqm,low,high";
  for (const auto seed : curve.seeds) text += ",seed_" + std::to_string(seed);
  for (const auto& row : curve.rows) {
    text += "\n" + std::to_string(row.update);
    for (const double value : {row.median_wall_s, row.mean, row.iqm, row.interval.low, row.interval.high})
      text += "," + io::shortest_digits(value);
    for (const double score : row.scores) text += "," + io::shortest_digits(score);
  }
  io::write_atomically(path, text + "\n");
}

void write_curve_svg(const std::filesystem::path& path, const LearningCurve& curve, const std::string& score) {
  std::string label;
  for (const char c : score) label += c == '_' || c == '\'' ? ' ' : c;
  std::string script =
      "set grid ytics lc '#dddddd' lt 1\nset key bottom right\nset rmargin 5\n"
      "set xlabel 'update'\nset ylabel '" +
      label + "'\n$rows << end_of_rows\n";
  for (const auto& row : curve.rows) {
    script += std::to_string(row.update);
    for (const double value : {row.iqm, row.interval.low, row.interval.high})
      script += " " + io::shortest_digits(value);
    for (const double value : row.scores) script += " " + io::shortest_digits(value);
    script += "\n";
  }
  script += "end_of_rows\nplot $rows using 1:3:4 with filledcurves fc '#c6dbef' title '95 % interval'";
  for (std::size_t i = 0; i < curve.seeds.size(); ++i)
    script += ", $rows using 1:" + std::to_string(5 + i) + " with lines lw 1 lc '#aaaaaa' " +
              (i == 0 ? "title 'each seed'" : "notitle");
  script += ", $rows using 1:2 with lines lw 2.5 lc '#08519c' title 'interquartile mean of " +
            std::to_string(curve.seeds.size()) + " seeds'\n";
  io::draw_svg(path, "learning_curve", 720, 432, script);
}

}  // namespace flappy::learn
