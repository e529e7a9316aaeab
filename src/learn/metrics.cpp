#include "learn/metrics.hpp"

#include <chrono>
#include <cmath>
#include <functional>
#include <limits>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string_view>
#include <utility>

#include "io/files.hpp"
#include "io/tensorboard.hpp"

namespace flappy::learn {
namespace {

constexpr double kMissing = std::numeric_limits<double>::quiet_NaN();

double now_s() { return std::chrono::duration<double>(std::chrono::system_clock::now().time_since_epoch()).count(); }

/// Shortest digits of a value, but whole numbers without exponent: 1000000, not 1e+06. `missing` if it is not finite.
std::string digits(double value, const char* missing) {
  if (!std::isfinite(value)) return missing;
  constexpr double kAllWhole = 0x1p53;
  if (value == std::trunc(value) && std::abs(value) < kAllWhole)
    return std::to_string(static_cast<std::int64_t>(value));
  return io::shortest_digits(value);
}

std::string json_line(std::span<const std::string> names, std::span<const double> values) {
  std::string line;
  for (std::size_t i = 0; i < values.size(); ++i)
    line += (i == 0 ? "{\"" : ",\"") + names[i] + "\":" + digits(values[i], "null");
  return line + "}\n";
}

std::string csv_header(const std::vector<std::string>& names) {
  std::string line;
  for (const auto& name : names) line += (line.empty() ? "" : ",") + name;
  return line + "\n";
}

/// Length in bytes of the text's first line with its line end; 0 if there is no complete line.
std::size_t line_size(std::string_view text) { return text.find('\n') + 1; }

/// Length of the first headers + records pieces of a file; `piece_size`: of a text's first piece, in bytes.
std::uint64_t kept_bytes(const std::filesystem::path& file, std::size_t (*piece_size)(std::string_view),
                         std::uint64_t records, std::uint64_t headers) {
  const std::string text = io::read_text(file);
  std::size_t bytes = 0;
  for (std::uint64_t i = 0; i < records + headers; ++i) {
    const std::size_t piece = piece_size(std::string_view(text).substr(bytes));
    if (piece == 0)
      throw io::InputError(file.string() + ": has " + std::to_string(i < headers ? 0 : i - headers) +
                           " records; accepted: at least the " + std::to_string(records) + " of the checkpoint");
    bytes += piece;
  }
  return bytes;
}

constexpr std::array kFiles = {"metrics.jsonl", "metrics.csv", "timing.jsonl", "events.out.tfevents.flappy"};

/// Lengths to which the files are cut for a resumed run. All are checked before the first is cut.
std::array<std::uint64_t, 4> all_kept_bytes(const std::filesystem::path& run, const MetricsColumns& columns,
                                            std::uint64_t records) {
  if (records == 0) return {};
  const std::string header = csv_header(columns.metrics);
  if (!io::read_text(run / kFiles[1]).starts_with(header))
    throw io::InputError((run / kFiles[1]).string() +
                         ":1: has other columns; accepted: " + header.substr(0, header.size() - 1));
  return {kept_bytes(run / kFiles[0], line_size, records, 0), kept_bytes(run / kFiles[1], line_size, records, 1),
          kept_bytes(run / kFiles[2], line_size, records, 0), kept_bytes(run / kFiles[3], io::event_size, records, 1)};
}

}  // namespace

void Metrics::check(const std::filesystem::path& run, const MetricsColumns& columns, std::uint64_t records) {
  all_kept_bytes(run, columns, records);
}

Metrics::Metrics(const std::filesystem::path& run, const MetricsColumns& columns, std::uint64_t records)
    : Metrics(run, columns, records, all_kept_bytes(run, columns, records)) {}

Metrics::Metrics(const std::filesystem::path& run, const MetricsColumns& columns, std::uint64_t records,
                 const std::array<std::uint64_t, 4>& kept_bytes)
    : columns_(columns),
      records_(records),
      jsonl_(run / kFiles[0], kept_bytes[0]),
      csv_(run / kFiles[1], kept_bytes[1]),
      timing_(run / kFiles[2], kept_bytes[2]),
      events_(run / kFiles[3], kept_bytes[3]) {
  if (records > 0) return;
  csv_.write(csv_header(columns_.metrics));
  events_.write(io::event_file_start(now_s()));
}

void Metrics::record(std::span<const double> metrics, std::span<const double> timing) {
  if (metrics.size() != columns_.metrics.size() || timing.size() != columns_.timing.size())
    throw std::logic_error("metrics: a record must have one value for each column");
  const double step = metrics.front();
  std::vector<std::string> names = {columns_.metrics.front()};
  std::vector<double> values = {step};
  names.insert(names.end(), columns_.timing.begin(), columns_.timing.end());
  values.insert(values.end(), timing.begin(), timing.end());

  std::string row;
  for (const double value : metrics) row += digits(value, "") + ",";
  row.back() = '\n';
  jsonl_.write(json_line(columns_.metrics, metrics));
  csv_.write(row);
  timing_.write(json_line(names, values));

  // the step is the axis of TensorBoard's charts, not a chart
  names.erase(names.begin());
  values.erase(values.begin());
  names.insert(names.begin(), columns_.metrics.begin() + 1, columns_.metrics.end());
  values.insert(values.begin(), metrics.begin() + 1, metrics.end());
  events_.write(io::scalar_event(now_s(), static_cast<std::int64_t>(step), names, values));
  ++records_;
}

std::uint64_t Metrics::sync() {
  for (io::AppendFile* file : {&jsonl_, &csv_, &timing_, &events_}) file->sync();
  return records_;
}

const std::vector<double>& MetricsTable::column(const std::string& name) const {
  for (std::size_t i = 0; i < names.size(); ++i)
    if (names[i] == name) return columns[i];
  throw io::InputError(file + ": " + name + ": column is missing; columns here: " + io::joined(names) +
                       io::did_you_mean(name, names));
}

MetricsTable read_metrics(const std::filesystem::path& file) {
  MetricsTable table{.file = file.string(), .names = {}, .columns = {}};
  const std::string text = io::read_text(file);
  std::string_view rest = text;
  for (std::size_t number = 1; !rest.empty(); ++number) {
    const std::size_t size = line_size(rest);
    const auto refuse = [&](const std::string& what) {
      throw io::InputError(table.file + ":" + std::to_string(number) + ": " + what);
    };
    if (size == 0) refuse("the line has no end; accepted: whole lines");
    const auto record = nlohmann::ordered_json::parse(rest.substr(0, size), nullptr, false);
    rest.remove_prefix(size);
    if (!record.is_object()) refuse("is no record; accepted: {\"name\":number,...}");
    if (number == 1) {
      for (const auto& item : record.items()) table.names.push_back(item.key());
      table.columns.resize(table.names.size());
    }
    std::size_t column = 0;
    for (const auto& item : record.items()) {
      const bool value = item.value().is_number() || item.value().is_null();
      if (!value || column == table.names.size() || item.key() != table.names[column])
        refuse(item.key() + ": is not what the first line has here; accepted: the same columns, numbers or null");
      table.columns[column++].push_back(item.value().is_null() ? kMissing : item.value().get<double>());
    }
    if (column != table.names.size()) refuse(table.names[column] + ": column is missing");
  }
  return table;
}

}  // namespace flappy::learn
