// Learning curve of one configuration over several seeds: interquartile mean with its bootstrap interval
// (Agarwal et al., Deep reinforcement learning at the edge of the statistical precipice, NeurIPS 2021).
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "io/statistics.hpp"

namespace flappy::learn {

struct CurvePoint {
  std::uint64_t update = 0;
  double wall_s = 0;
  double score = 0;  ///< value of the chosen column, as success rate or return
};

struct SeedCurve {
  std::uint64_t seed = 0;
  std::vector<CurvePoint> points;
};

/// Reads the records with a value in column `score`, with `wall_s` of timing.jsonl. Throws as read_metrics().
SeedCurve read_seed_curve(const std::filesystem::path& run, std::uint64_t seed, const std::string& score);

/// Mean of the values without the lowest and the highest quarter (rounded down). Needs at least one value.
double interquartile_mean(std::vector<double> values);

/// 95 % percentile interval of the interquartile mean over 10,000 resamples; the same bits on every machine.
io::Interval bootstrap_interval(std::span<const double> values);

struct CurveRow {
  std::uint64_t update = 0;
  double median_wall_s = 0, mean = 0, iqm = 0;
  io::Interval interval;
  std::vector<double> scores;  ///< [seed], in the order of LearningCurve::seeds
};

struct LearningCurve {
  std::vector<std::uint64_t> seeds;
  std::vector<CurveRow> rows;
};

/// Throws io::InputError unless there is a run, and all runs have finite scores at the same updates.
LearningCurve learning_curve(std::span<const SeedCurve> runs);

/// Writes columns update, median_wall_s, mean, iqm, low, high, and seed_N for each seed.
void write_curve_csv(const std::filesystem::path& path, const LearningCurve& curve);

/// Draws with gnuplot, whose version fixes the bytes. Throws io::InputError if it is missing, fails or cannot write.
void write_curve_svg(const std::filesystem::path& path, const LearningCurve& curve, const std::string& score);

}  // namespace flappy::learn
