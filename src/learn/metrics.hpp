// What a training run writes down as it goes, in its folder:
//   metrics.jsonl, metrics.csv    one record per report, the same figures in both; inside the determinism contract
//   timing.jsonl                  wall-clock figures of the same reports
//   events.out.tfevents.flappy    all of them for TensorBoard
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "io/append_file.hpp"

namespace flappy::learn {

/// Fixed for a run. The first column is the step (update) that places a record in TensorBoard and in timing.jsonl.
/// Figures that only some reports have, as those of an evaluation, are columns that the others leave empty.
struct MetricsColumns {
  std::vector<std::string> metrics, timing;
};

/// Whatever cannot be written is an InputError that names the file.
class Metrics {
 public:
  /// Starts the files anew, or goes on after the first `records` records, as sync() counted them for a checkpoint;
  /// what was written after them is cut off. InputError when a file holds fewer, or the columns are others.
  Metrics(const std::filesystem::path& run, const MetricsColumns& columns, std::uint64_t records = 0);

  /// One value for each column; NaN and infinity stand for "not available" (null, an empty cell, no event).
  /// On the way to the disk when it returns: a killed program loses nothing.
  void record(std::span<const double> metrics, std::span<const double> timing);

  /// Brings all records onto the disk and counts them. Call it for each checkpoint, before the checkpoint's commit().
  std::uint64_t sync();

 private:
  Metrics(const std::filesystem::path& run, const MetricsColumns& columns, std::uint64_t records,
          const std::array<std::uint64_t, 4>& kept_bytes);

  MetricsColumns columns_;
  std::uint64_t records_;
  io::AppendFile jsonl_, csv_, timing_, events_;
};

/// The records of a run, one vector for each column; NaN where not available.
struct MetricsTable {
  std::string file;  ///< for messages
  std::vector<std::string> names;
  std::vector<std::vector<double>> columns;

  /// InputError when there is no such column.
  const std::vector<double>& column(const std::string& name) const;
};

/// Reads metrics.jsonl or timing.jsonl. InputError with file and line.
MetricsTable read_metrics(const std::filesystem::path& file);

}  // namespace flappy::learn
