// Records of a training run, in its folder:
//   metrics.jsonl, metrics.csv    one record per report, the same bytes for any number of threads and resumptions
//   timing.jsonl                  wall-clock times of the same reports
//   events.out.tfevents.flappy    all values, for TensorBoard
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "io/append_file.hpp"

namespace flappy::learn {

/// Names of columns, fixed for a run. The first is the step (update), which orders records.
struct MetricsColumns {
  std::vector<std::string> metrics, timing;
};

/// Writer of the records. All functions throw io::InputError, with the file's name, if a file cannot be written.
class Metrics {
 public:
  /// Starts new files, or continues after `records` records, sync()'s count at a checkpoint, and cuts off later ones.
  /// Throws io::InputError if a file holds fewer records or has other columns.
  Metrics(const std::filesystem::path& run, const MetricsColumns& columns, std::uint64_t records = 0);

  /// Throws what the constructor would, and changes nothing.
  static void check(const std::filesystem::path& run, const MetricsColumns& columns, std::uint64_t records);

  /// Appends a record, one value per column; NaN and infinity: not available (null, empty cell, no event). The
  /// operating system has it on return, so a killed program loses nothing.
  void record(std::span<const double> metrics, std::span<const double> timing);

  /// Syncs to the disk; returns the number of records. Call for each checkpoint, before CheckpointWriter::commit().
  std::uint64_t sync();

 private:
  Metrics(const std::filesystem::path& run, const MetricsColumns& columns, std::uint64_t records,
          const std::array<std::uint64_t, 4>& kept_bytes);

  MetricsColumns columns_;
  std::uint64_t records_;
  io::AppendFile jsonl_, csv_, timing_, events_;
};

/// The records of a run; NaN where a value is not available.
struct MetricsTable {
  std::string file;  ///< file name, for error messages
  std::vector<std::string> names;
  std::vector<std::vector<double>> columns;  ///< [column][record]

  /// Throws io::InputError if there is no such column.
  const std::vector<double>& column(const std::string& name) const;
};

/// Reads metrics.jsonl or timing.jsonl. Throws io::InputError with file and line.
MetricsTable read_metrics(const std::filesystem::path& file);

}  // namespace flappy::learn
