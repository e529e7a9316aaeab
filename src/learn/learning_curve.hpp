// The learning curve of one configuration over several seeds: interquartile mean with its bootstrap interval
// (Agarwal et al., Deep reinforcement learning at the edge of the statistical precipice, NeurIPS 2021).
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "io/statistics.hpp"

namespace flappy::learn {

/// One evaluation of a run.
struct CurvePoint {
  std::uint64_t update = 0;
  double wall_s = 0;
  double score = 0;  ///< success rate, return, ...
};

struct SeedCurve {
  std::uint64_t seed = 0;
  std::vector<CurvePoint> points;
};

/// The evaluations of a run folder: its records in which the column `score` is there, with the column `wall_s` of
/// timing.jsonl. InputError as read_metrics().
SeedCurve read_seed_curve(const std::filesystem::path& run, std::uint64_t seed, const std::string& score);

/// Mean of what is left when a quarter (rounded down) is cut off at each end; at least one value.
double interquartile_mean(std::vector<double> values);

/// 95 % percentile interval of the interquartile mean over 10,000 resamples of the values; the same bytes everywhere.
io::Interval bootstrap_interval(std::span<const double> values);

struct CurveRow {
  std::uint64_t update = 0;
  double median_wall_s = 0, mean = 0, iqm = 0;
  io::Interval interval;
  std::vector<double> scores;  ///< one for each seed, in the order given
};

struct LearningCurve {
  std::vector<std::uint64_t> seeds;
  std::vector<CurveRow> rows;
};

/// InputError unless there are runs, all evaluated at the same updates, with finite scores.
LearningCurve learning_curve(std::span<const SeedCurve> runs);

/// update,median_wall_s,mean,iqm,low,high,seed_N,...
void write_curve_csv(const std::filesystem::path& path, const LearningCurve& curve);

/// Draws interval, interquartile mean and seeds with gnuplot; the same bytes from the same gnuplot.
/// InputError when gnuplot is missing or fails, or the file cannot be written.
void write_curve_svg(const std::filesystem::path& path, const LearningCurve& curve, const std::string& score);

}  // namespace flappy::learn
