#include "flightlog/import/sources.hpp"

#include <algorithm>
#include <map>
#include <optional>

#include "flightlog/import/gzip.hpp"
#include "flightlog/import/message_rows.hpp"
#include "flightlog/import/ulog.hpp"
#include "flightlog/ros/bag.hpp"
#include "io/csv.hpp"
#include "io/mapped_file.hpp"

namespace flappy::flightlog {
namespace {

namespace fs = std::filesystem;

void read_bag(const fs::path& file, Channels& channels, std::vector<std::string>& warnings) {
  struct Reader {
    std::optional<MessageRows> rows;  ///< none where messages are not wanted or cannot be read
    std::size_t bad = 0;
    std::string first_fault;
  };
  const auto bag = ros::Bag::open(file);
  std::map<std::string, Reader> readers;
  while (const auto message = bag->next()) {
    const std::string& topic = message->topic->name;
    auto found = readers.find(topic);
    if (found == readers.end()) {
      found = readers.try_emplace(topic).first;
      channels.add(topic);
      if (channels.wants(topic)) try {
          found->second.rows.emplace(ros::layout_of(*message->topic));
        } catch (const ros::MessageError& error) {
          warnings.push_back(file.string() + ": " + topic + ": " + error.what() + ": left out");
        }
    }
    Reader& reader = found->second;
    if (!reader.rows) continue;
    try {
      const Row& row = reader.rows->read(message->bytes);
      channels.add(topic, message->received_ns, reader.rows->stamp_ns(), row);
    } catch (const ros::MessageError& error) {
      if (reader.bad++ == 0) reader.first_fault = error.what();
    }
  }
  for (const std::string& warning : bag->warnings()) warnings.push_back(warning);
  for (const auto& [topic, reader] : readers)
    if (reader.bad > 0)
      warnings.push_back(file.string() + ": " + topic + ": " + std::to_string(reader.bad) +
                         " messages left out, the first because " + reader.first_fault);
}

/// Without a last line that its writer did not finish.
std::string_view whole_lines(std::string_view text) {
  const auto cells = [](std::string_view line) { return std::ranges::count(line, ','); };
  const std::size_t last = text.rfind('\n');
  if (last == std::string_view::npos || last + 1 == text.size()) return text;
  return cells(text.substr(last)) < cells(text.substr(0, text.find('\n'))) ? text.substr(0, last + 1) : text;
}

void read_table(const fs::path& file, std::string_view bytes, Channels& channels, std::vector<std::string>& warnings) {
  const bool packed = is_gzip(bytes);
  // "camera" of "camera.csv" and of "camera.csv.gz"
  const std::string channel = (packed && file.extension() == ".gz" ? file.stem() : file).stem().string();
  channels.add(channel);
  if (!channels.wants(channel)) return;
  const std::string unpacked = packed ? gunzipped(bytes, file.string(), warnings) : "";
  const std::string_view text = packed ? unpacked : bytes, whole = whole_lines(text);
  if (whole.size() < text.size()) warnings.push_back(file.string() + ": its last line was cut off: left out");
  const io::CsvTable table = io::parse_csv(whole, file.string(), io::Missing::nan);
  Row row;
  for (const std::string& name : table.names) row.push_back({name, 0});
  for (std::size_t i = 0; i < table.columns.front().size(); ++i) {
    for (std::size_t k = 0; k < row.size(); ++k) row[k].value = table.columns[k][i];
    channels.add(channel, kNoTime, kNoTime, row);
  }
}

}  // namespace

void read_source(const fs::path& file, Channels& channels, std::vector<std::string>& warnings) {
  std::error_code ignored;
  if (fs::is_directory(file, ignored) || ros::Bag::is_bag(file)) return read_bag(file, channels, warnings);
  const io::MappedFile mapped(file);
  if (is_ulog(mapped.bytes())) return read_ulog(mapped.bytes(), file.string(), channels, warnings);
  for (const char* ending : {".mcap", ".db3", ".ulg"})
    if (file.extension() == ending)
      throw io::InputError(file.string() + ": does not begin as a " + ending +
                           " file; accepted: a bag, a ULog or a CSV");
  read_table(file, mapped.bytes(), channels, warnings);
}

}  // namespace flappy::flightlog
