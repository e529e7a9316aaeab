#include "flightlog/import/sparse_points.hpp"

#include <array>
#include <cmath>
#include <map>
#include <optional>

#include "flightlog/import/text_cells.hpp"
#include "io/config.hpp"
#include "io/text.hpp"

namespace flappy::flightlog {
namespace {

constexpr double kMaxDigitised = 2e6;  // a film of minutes at kHz; a damaged head must not fill the memory
constexpr double kMaxDigitisedFields = 3e4;

/// The three numbers of a line; nothing where it holds something else.
std::optional<std::array<double, 3>> triple(std::string_view line) {
  const Cells cells = split(line, '\t');
  if (used(cells) != 3) return std::nullopt;
  std::array<double, 3> numbers{};
  for (std::size_t k = 0; k < 3; ++k) {
    numbers[k] = to_number(cells[k], false);
    if (!std::isfinite(numbers[k])) return std::nullopt;
  }
  return numbers;
}

bool is_count(double value, double most) { return value >= 1 && value <= most && value == std::floor(value); }

struct SparseHead {
  double frames, columns, entries;
};

/// The second line, if it is a head.
std::optional<SparseHead> head_of_sparse(Lines& lines) {
  const auto title = lines.next();
  if (!title || triple(title->text)) return std::nullopt;
  const auto sizes = lines.next();
  const auto numbers = sizes ? triple(sizes->text) : std::nullopt;
  if (!numbers) return std::nullopt;
  const auto [frames, columns, entries] = *numbers;
  if (!is_count(frames, 1e15) || !is_count(columns, kMaxDigitisedFields) || !is_count(entries, frames * columns))
    return std::nullopt;
  return SparseHead{frames, columns, entries};
}

}  // namespace

bool is_sparse_points(std::string_view text) {
  Lines lines(text);
  const auto head = head_of_sparse(lines);
  if (!head) return false;
  double before = 0, count = 0;  // entries stand column by column, which rows of another table hardly do
  for (auto line = lines.next(); line; line = lines.next()) {
    if (is_blank(line->text)) continue;
    const auto entry = triple(line->text);
    if (!entry) return lines.next() == std::nullopt && count > 0;  // a last line that was cut off
    const auto [frame, column, value] = *entry;
    const double place = (column - 1) * head->frames + frame;
    if (!is_count(frame, head->frames) || !is_count(column, head->columns) || place <= before) return false;
    before = place;
    if (++count > head->entries) return false;
  }
  return count > 0;
}

void read_sparse_points(std::string_view text, const std::string& name, const std::string& channel, Channels& channels,
                        std::vector<std::string>& warnings) {
  if (channel.ends_with("xypts"))
    throw io::InputError(name + ": holds points of pictures; accepted: points in space, as in xyzpts.tsv");
  Lines lines(text);
  const SparseHead head = *head_of_sparse(lines);
  if (head.frames > kMaxDigitised)
    throw io::InputError(name + ":2:1: says " + io::format("%.0f", head.frames) + " frames; accepted: at most " +
                         io::format("%.0f", kMaxDigitised));
  std::vector<std::string> fields;
  for (std::size_t k = 0; k < static_cast<std::size_t>(head.columns); ++k)
    fields.push_back("pt" + std::to_string(k / 3 + 1) + "_" + "XYZ"[k % 3]);
  channels.add(channel, fields);
  if (!channels.wants(channel)) return;
  const auto frames = static_cast<std::size_t>(head.frames);
  std::map<std::size_t, std::vector<double>> wanted;  // by column
  for (std::size_t k = 0; k < fields.size(); ++k)
    if (channels.wants(channel, fields[k])) wanted[k].assign(frames, kMissing);
  double count = 0;
  for (auto line = lines.next(); line; line = lines.next()) {
    const auto entry = triple(line->text);
    if (!entry) continue;
    ++count;
    const auto [frame, column, value] = *entry;
    if (const auto found = wanted.find(static_cast<std::size_t>(column) - 1); found != wanted.end())
      found->second[static_cast<std::size_t>(frame) - 1] = value;
  }
  if (count < head.entries)
    warnings.push_back(name + ": the head says " + io::format("%.0f", head.entries) + " numbers; " +
                       io::format("%.0f", count) + " are there");
  const auto* own = channels.wanted(channel);
  const bool wanted_frame = own && own->contains(kFrame);
  Row row;
  for (const auto& [k, values] : wanted) row.push_back({fields[k], 0});
  if (wanted_frame) row.push_back({kFrame, 0});
  for (std::size_t i = 0; i < frames; ++i) {
    std::size_t k = 0;
    for (const auto& [column, values] : wanted) row[k++].value = values[i];
    if (wanted_frame) row[k].value = static_cast<double>(i);
    channels.add(channel, kNoTime, kNoTime, row);
  }
}

}  // namespace flappy::flightlog
