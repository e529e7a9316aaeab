#include "flightlog/import/table.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <optional>
#include <set>

#include "flightlog/import/mocap_export.hpp"
#include "flightlog/import/table_head.hpp"
#include "flightlog/import/text_cells.hpp"
#include "io/config.hpp"
#include "io/files.hpp"
#include "io/text.hpp"

namespace flappy::flightlog {
namespace {

struct LeftOut {
  std::size_t count = 0, first_line = 0;
  std::string first;
  void add(std::size_t line, const std::string& what) {
    if (count++ == 0) first_line = line, first = what;
  }
};

class TableReader {
 public:
  /// `above` lines of the file stand before the text.
  TableReader(std::string_view text, std::size_t above, std::string name, std::string channel, Channels& channels)
      : text_(text),
        above_(above),
        name_(std::move(name)),
        channel_(std::move(channel)),
        channels_(channels),
        head_(is_qtm(text) ? qtm_head(text, name_)
                           : head_of(below_first_lines(text), name_, above + first_lines_of(text))),
        labels_(head_.columns),
        export_(mocap_export_of(text, head_, name_)) {
    std::vector<std::string> fields;
    for (std::size_t k = 0; k < head_.columns.size(); ++k) {
      fields.push_back(labels_.own(k));
      if (!fields.back().empty()) named_ = k + 1;
    }
    channels_.add(channel_, fields);
    const std::set<std::string>* wanted = channels_.wanted(channel_);
    const std::set<std::string> all(fields.begin(), fields.end());
    for (const std::string& field : wanted && !wanted->empty() ? *wanted : all) want(field);
    if (export_) want_bodies(wanted);
    if (wanted && wanted->contains(kFrame))
      frame_ = row_.size(), row_.push_back({kFrame, 0}), channels_.add(channel_, {kFrame});
    not_numbers_.resize(cells_.size());
  }

  void read(std::vector<std::string>& warnings) {
    constexpr std::size_t kMaxLinesOfARow = 50;
    RowSplitter splitter(head_.separator);
    Lines lines(text_, above_);
    std::vector<Line> row;  // lines of the current row: several if a quoted cell contains line ends
    for (auto line = lines.next(); line; line = lines.next()) {
      if (line->number <= head_.end) continue;
      if (is_blank(line->text)) {
        blank_ += rows_ + other_width_.count > 0 && row.empty();
        continue;
      }
      if (row.empty() && is_comment(line->text)) {
        if (rows_ > 0) comments_.add(line->number, "");
        continue;
      }
      row.push_back(*line);
      if (splitter.take(line->text)) {
        add(splitter, row.front().number);
        row.clear();
      } else if (row.size() == kMaxLinesOfARow) {
        split_apart(splitter, row);
      }
    }
    if (!row.empty()) split_apart(splitter, row);
    refuse_other_widths();
    warn(warnings);
  }

 private:
  struct WantedCell {
    std::size_t column;
    std::optional<std::size_t> element;  ///< of the list in the cell
    bool is_time;
  };

  /// Looks a field up among the columns; one that is not there is left to who asks for it.
  void want(const std::string& field) {
    if (field.empty()) return;
    std::vector<std::size_t> columns = labels_.find(field);
    std::optional<std::size_t> element;
    if (columns.empty()) {  // "name[2]": an element of a list
      const std::size_t bracket = field.find_last_of('[');
      std::size_t index = 0;
      const char* end = field.data() + field.size();
      if (bracket == std::string::npos || !field.ends_with(']') ||
          std::from_chars(field.data() + bracket + 1, end, index).ptr != end - 1)
        return;
      columns = labels_.find(field.substr(0, bracket));
      element = index;
    }
    if (columns.size() > 1) {
      std::vector<std::string> names;
      for (const std::size_t k : columns) names.push_back("\"" + labels_.own(k) + "\"");
      throw io::InputError(name_ + ":" + std::to_string(std::max<std::size_t>(head_.line, 1)) + ":1: " + field +
                           ": column name is given " + (names.size() == 2 ? "twice" : "several times") +
                           "; accepted: " + io::shortened(io::joined(names), 300));
    }
    if (columns.empty()) return;
    row_.push_back({field, 0});
    cells_.push_back({columns.front(), element, channels_.wants_time(channel_, field)});
    channels_.add_unit(channel_, field, head_.columns[columns.front()].unit);
  }

  /// The bodies and markers of which a field is wanted; all are registered.
  void want_bodies(const std::set<std::string>* wanted) {
    Capture capture{export_->program, export_->says_up, {}, {}};
    for (std::size_t i = 0; i < export_->bodies.size(); ++i) {
      const MocapBody& body = export_->bodies[i];
      (body.kind == MocapBody::Rotation::none ? capture.markers : capture.bodies).push_back(body.name);
      const std::vector<std::string> fields = fields_of(body);
      channels_.add(channel_, fields);
      if (wanted && !wanted->empty() &&
          std::ranges::none_of(fields, [&](const std::string& field) { return wanted->contains(field); }))
        continue;
      bodies_.emplace_back(i, row_.size());
      for (const std::string& field : fields) row_.push_back({field, 0});
    }
    channels_.describe(channel_, std::move(capture));
  }

  /// InputError where no row has the cells of the names.
  void refuse_other_widths() const {
    if (rows_ > 0 || other_width_.count == 0) return;
    throw io::InputError(name_ + ":" + std::to_string(other_width_.first_line) + ":1: " + other_width_.first +
                         ", and no row is otherwise; accepted: rows of as many cells");
  }

  /// Treats each line as a row of its own, because one opens quotes that are never closed; leaves that one out.
  void split_apart(RowSplitter& splitter, std::vector<Line>& lines) {
    splitter.end_row();
    for (const Line& line : lines) {
      const bool whole = splitter.take(line.text);
      if (whole) {
        add(splitter, line.number);
      } else {
        splitter.end_row();
        other_width_.add(line.number, "quotes that are not closed");
      }
    }
    lines.clear();
  }

  void add(const RowSplitter& cells, std::size_t line) {
    std::size_t width = cells.size(), filled = 0;
    while (filled < width && cells[filled].empty()) ++filled;
    if (filled == width) return;                                 // as a spreadsheet leaves at the end
    while (width > named_ && cells[width - 1].empty()) --width;  // ignore separators at the end
    if (width < named_ || width > std::max(named_, head_.columns.size()))
      return other_width_.add(line, std::to_string(width) + (width == 1 ? " cell for " : " cells for ") +
                                        std::to_string(named_) + " names");
    ++rows_;
    for (std::size_t k = 0; k < cells_.size(); ++k) {
      const auto& [column, element, is_time] = cells_[k];
      const std::string& cell = cells[column];
      points_ |= !element && cell.find('.') != std::string::npos;
      row_[k].value = element ? list_element(cell, *element) : to_number(cell, head_.separator != ',' && !points_);
      if (is_time && std::isinf(row_[k].value)) row_[k].value = to_time_s(cell).value_or(kNoNumber);
      if (std::isinf(row_[k].value)) not_numbers_[k].add(line, cell);
    }
    for (const auto& [body, at] : bodies_) export_->read(body, cells, &row_[at]);
    if (frame_) row_[*frame_].value = static_cast<double>(rows_ - 1 + other_width_.count + blank_);
    channels_.add(channel_, kNoTime, export_ ? export_->stamp_ns(cells, rows_ - 1) : kNoTime, row_);
  }

  void warn(std::vector<std::string>& warnings) const {
    const auto say = [&](const std::string& what) { warnings.push_back(name_ + ": " + what); };
    const auto first = [](const LeftOut& left) {
      return std::string(left.count > 1 ? ", the first in line " : ", in line ") + std::to_string(left.first_line);
    };
    if (other_width_.count > 0)
      say(std::to_string(other_width_.count) + " of " + std::to_string(rows_ + other_width_.count) + " rows left out" +
          first(other_width_) + ": " + other_width_.first);
    if (export_ && export_->frames > 0 && export_->frames != rows_)
      say("the head says " + std::to_string(export_->frames) + " frames; " + std::to_string(rows_) + " are there");
    if (comments_.count > 0)
      say(std::to_string(comments_.count) + " comments among the rows left out" + first(comments_));
    for (std::size_t k = 0; k < not_numbers_.size(); ++k)
      if (const LeftOut& left = not_numbers_[k]; left.count > 0)
        say(row_[k].name + ": " + std::to_string(left.count) + " of " + std::to_string(rows_) +
            " cells are no numbers" + first(left) + ": \"" + left.first.substr(0, 40) + "\"");
  }

  std::string_view text_;
  std::size_t above_;
  std::string name_, channel_;
  Channels& channels_;
  TableHead head_;
  ColumnLabels labels_;
  std::optional<MocapExport> export_;
  Row row_;                                                  ///< wanted cells of the current row
  std::vector<std::pair<std::size_t, std::size_t>> bodies_;  ///< wanted bodies of export_, and where they begin in row_
  std::vector<WantedCell> cells_;                            ///< where each of them stands
  std::size_t named_ = 0;                                    ///< number of columns up to the last that has a name
  std::optional<std::size_t> frame_;                         ///< place of kFrame in row_
  std::size_t rows_ = 0, blank_ = 0;                         ///< blank lines among the rows
  bool points_ = false;             ///< whether a cell had a point: then a comma is no decimal comma
  LeftOut other_width_, comments_;  ///< other_width_ includes rows with quotes that are never closed
  std::vector<LeftOut> not_numbers_;
};

}  // namespace

void read_table(std::string_view text, const std::string& name, const std::string& channel, Channels& channels,
                std::vector<std::string>& warnings) {
  constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";
  if (text.starts_with(kByteOrderMark)) text.remove_prefix(kByteOrderMark.size());
  const std::vector<TextBlock> blocks = blocks_of(text);
  for (const TextBlock& block : blocks) {
    const std::string own = blocks.size() > 1 ? channel + "/" + block.title : channel;
    if (channels.wants(own)) TableReader(block.text, block.line, name, own, channels).read(warnings);
    else channels.add(own);
  }
}

}  // namespace flappy::flightlog
