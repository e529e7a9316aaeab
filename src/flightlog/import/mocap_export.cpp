#include "flightlog/import/mocap_export.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>

#include "flightlog/import/recorded_units.hpp"
#include "flightlog/rotation.hpp"
#include "io/files.hpp"

namespace flappy::flightlog {
namespace {

using Rotation = MocapBody::Rotation;
constexpr double kRadPerDegree = std::numbers::pi / 180;
constexpr double kPerMillimetre = 1e-3;  // m; QTM exports nothing else
/// Largest distance of R^T R from 1: matrices are printed with 5 digits, and those of lost frames are 0.
constexpr double kRotationTolerance = 1e-2;

std::string before(std::string_view text, std::string_view end) { return std::string(text.substr(0, text.find(end))); }

std::string_view first_line(std::string_view text) {
  const auto line = Lines(text).next();
  return line ? line->text : std::string_view();
}

std::string first_cell(std::string_view line, char separator) {
  const Cells cells = split(line, separator);
  return cells.empty() ? "" : cells.front();
}

/// What follows each cell in a line, as "Length Units,Meters": notes with commas may shift keys by one.
std::map<std::string, std::string> pairs_of(const Cells& cells) {
  std::map<std::string, std::string> pairs;
  for (std::size_t k = 0; k + 1 < cells.size(); ++k) pairs.try_emplace(cells[k], cells[k + 1]);
  return pairs;
}

double number_of(const std::map<std::string, std::string>& pairs, const std::string& key) {
  const auto found = pairs.find(key);
  const double value = found == pairs.end() ? kMissing : to_number(found->second, true);
  return std::isfinite(value) ? value : 0;
}

/// The factor of a unit of length or angle, or InputError.
double factor_of(const std::string& unit, std::string_view suffix, const std::string& where) {
  const auto known = recorded_unit(unit);
  if (!known || known->suffix != suffix)
    throw io::InputError(where + ": unit \"" + unit +
                         "\" is not known; accepted: " + (suffix == "_m" ? "m, cm, mm, in" : "rad, deg"));
  return known->factor;
}

// ---- Motive

MocapExport motive(std::string_view text, const TableHead& head, const std::string& name) {
  MocapExport e;
  e.program = "Motive";
  e.says_up = false;
  const std::string_view first = first_line(text);
  const std::map<std::string, std::string> said = pairs_of(split(first, separator_of(first)));
  const auto value = [&](const std::string& key, const std::string& fallback) {
    const auto found = said.find(key);
    return found == said.end() ? fallback : found->second;
  };
  if (value("Coordinate Space", "Global") != "Global")
    throw io::InputError(name + ":1:1: Coordinate Space is " + value("Coordinate Space", "") +
                         "; accepted: an export with Global");
  e.rate_hz = number_of(said, "Export Frame Rate");
  e.frames = static_cast<std::size_t>(std::max(0.0, number_of(said, "Total Exported Frames")));
  const double length_m = factor_of(value("Length Units", "Meters"), "_m", name + ":1:1");
  const std::string order = value("Rotation Type", "Quaternion");
  const auto is_type = [](const std::string& group) {
    return group == "Rigid Body" || group == "Marker" || group == "Rigid Body Marker" || group == "Bone" ||
           group == "Bone Marker";
  };
  std::map<std::string, std::pair<std::string, std::map<std::string, std::size_t>>> found;  // type, columns by use
  std::vector<std::string> names;
  for (std::size_t k = 0; k < head.columns.size(); ++k) {
    const auto& [axis, groups, unit] = head.columns[k];
    if (axis.starts_with("Time (")) e.time = k;
    if (axis == "Frame") e.frame = k;
    const auto type = std::ranges::find_if(groups, is_type);
    if (groups.end() - type < 3 || axis.size() != 1) continue;
    const std::string &body = *(type + 1), &use = groups.back();
    auto& [of, columns] = found[body];
    // of a marker, what was measured counts, not where the body's solution has it
    if (of.empty()) names.push_back(body);
    if (of.empty() || (of != *type && *type == "Marker")) of = *type, columns.clear();
    if (of == *type && (use == "Position" || use == "Rotation")) columns.try_emplace(use + axis, k);
  }
  for (const std::string& body : names) {
    const auto& columns = found.at(body).second;
    const auto all = [&](const std::string& use, std::string_view axes) {
      return std::ranges::all_of(axes, [&](char axis) { return columns.contains(use + axis); });
    };
    if (!all("Position", "XYZ")) continue;
    MocapBody b{body, {columns.at("PositionX"), columns.at("PositionY"), columns.at("PositionZ")}, length_m};
    const bool quaternion = all("Rotation", "XYZW");
    if (quaternion || (all("Rotation", "XYZ") && order.size() == 3)) {
      b.kind = quaternion ? Rotation::quaternion : Rotation::angles;
      b.order = quaternion ? "XYZW" : order;
      b.angle_rad = kRadPerDegree;
      for (const char axis : b.order) b.rotation.push_back(columns.at(std::string("Rotation") + axis));
    }
    e.bodies.push_back(std::move(b));
  }
  return e;
}

// ---- Qualisys

/// What a body of a 6D file has after its name, from its x on.
constexpr std::array kOfBody = {"X",      "Y",      "Z",      "Roll",   "Pitch",  "Yaw",    "Residual", "Rot[0]",
                                "Rot[1]", "Rot[2]", "Rot[3]", "Rot[4]", "Rot[5]", "Rot[6]", "Rot[7]",   "Rot[8]"};

struct QtmLines {
  std::map<std::string, Cells> said;
  std::size_t lines = 0;  ///< of the head, without a line of names
  Cells first;            ///< the line below
};

/// Lines of a key in capitals and its values.
QtmLines qtm_lines(std::string_view text) {
  QtmLines head;
  Lines lines(text);
  while (const auto line = lines.next()) {
    Cells cells = split(line->text, '\t');
    const bool key = !cells.empty() && cells.front().size() > 2 &&
                     std::ranges::all_of(cells.front(), [](char c) { return (c >= 'A' && c <= 'Z') || c == '_'; });
    if (!key && !is_blank(line->text)) {
      head.first = std::move(cells);
      return head;
    }
    head.lines = line->number;
    if (!key) continue;
    const std::string name = cells.front();
    cells.erase(cells.begin());
    cells.resize(used(cells));
    head.said[name] = std::move(cells);
  }
  return head;
}

MocapExport qtm(std::string_view text, const TableHead& head) {
  MocapExport e;
  e.program = "QTM";
  e.zero_is_lost = true;
  const QtmLines lines = qtm_lines(text);
  const auto number = [&](const std::string& key) {
    const auto found = lines.said.find(key);
    const double value = found == lines.said.end() || found->second.empty() ? 0 : to_number(found->second[0], true);
    return std::isfinite(value) ? value : 0;
  };
  e.rate_hz = number("FREQUENCY");
  e.frames = static_cast<std::size_t>(std::max(0.0, number("NO_OF_FRAMES")));
  e.first_frame = 1;
  const auto column = [&](const std::string& name, std::size_t from = 0) -> std::optional<std::size_t> {
    for (std::size_t k = from; k < head.columns.size(); ++k)
      if (head.columns[k].name == name) return k;
    return std::nullopt;
  };
  e.time = column("Time");
  e.frame = column("Frame");
  for (const char* key : {"MARKER_NAMES", "BODY_NAMES"}) {
    const auto names = lines.said.find(key);
    if (names == lines.said.end()) continue;
    for (const std::string& name : names->second) {
      const auto at = column(name + " X");
      if (!at || *at + 2 >= head.columns.size()) continue;
      MocapBody b{name, {*at, *at + 1, *at + 2}, kPerMillimetre};
      const auto is = [&](std::size_t k) {  // with or without the body's name
        const std::string& own = head.columns[*at + k].name;
        return own == kOfBody[k] || own == name + " " + kOfBody[k];
      };
      const bool whole = *at + kOfBody.size() <= head.columns.size() && is(7) && is(15);
      if (whole) b.kind = Rotation::matrix;
      for (std::size_t k = 0; whole && k < 9; ++k) b.rotation.push_back(*at + 7 + k);
      e.bodies.push_back(std::move(b));
    }
  }
  return e;
}

// ---- Vicon

/// "Global Angle (Quaternion) robot:robot": what its rotation is, and its name; a name twice is one.
std::pair<std::string, std::string> kind_and_name(std::string text) {
  std::string kind;
  constexpr std::string_view kAngle = "Global Angle";
  if (text.starts_with(kAngle)) {
    text.erase(0, kAngle.size());
    text.erase(0, std::min(text.find_first_not_of(' '), text.size()));
    if (text.starts_with('(')) {
      kind = before(text.substr(1), ")");
      text.erase(0, std::min(text.find(')') + 1, text.size()));
      text.erase(0, std::min(text.find_first_not_of(' '), text.size()));
    }
  }
  const std::size_t colon = text.find(':');
  if (colon != std::string::npos && text.substr(0, colon) == text.substr(colon + 1)) text.resize(colon);
  return {kind, text};
}

MocapExport vicon(std::string_view text, const TableHead& head, const std::string& name) {
  MocapExport e;
  e.program = "Vicon";
  e.first_frame = 1;
  Lines lines(text);
  lines.next();
  if (const auto rate = lines.next()) e.rate_hz = to_number(first_cell(rate->text, head.separator), true);
  const std::string where = name + ":" + std::to_string(head.end) + ":1";
  if (head.columns.empty() || head.columns.front().groups.empty()) return e;
  // By groups: all columns below one name; a marker's three may stand below an unlabelled number.
  for (std::size_t k = 0; k < head.columns.size();) {
    const std::string group = head.columns[k].groups.back();
    std::map<std::string, std::size_t> columns;
    const std::size_t first = k;
    for (; k < head.columns.size() && (k == first || head.columns[k].groups.back() == group); ++k)
      if (!columns.try_emplace(head.columns[k].name, k).second) break;
    if (first == 0 && columns.contains("Frame")) e.frame = columns.at("Frame");
    const auto all = [&](std::initializer_list<const char*> names) {
      return std::ranges::all_of(names, [&](const char* axis) { return columns.contains(axis); });
    };
    if (group.empty()) continue;
    const auto [kind, body] = kind_and_name(group);
    if (all({"X", "Y", "Z"})) {
      const double length_m = factor_of(head.columns[columns.at("X")].unit, "_m", where);
      e.bodies.push_back({body, {columns.at("X"), columns.at("Y"), columns.at("Z")}, length_m});
    } else if (all({"TX", "TY", "TZ", "RX", "RY", "RZ"})) {
      const double length_m = factor_of(head.columns[columns.at("TX")].unit, "_m", where);
      MocapBody b{body, {columns.at("TX"), columns.at("TY"), columns.at("TZ")}, length_m, Rotation::unsaid};
      b.rotation = {columns.at("RX"), columns.at("RY"), columns.at("RZ")};
      if (columns.contains("RW")) {
        b.kind = Rotation::quaternion;
        b.rotation.push_back(columns.at("RW"));
      } else {
        b.angle_rad = factor_of(head.columns[columns.at("RX")].unit, "_rad", where);
      }
      e.bodies.push_back(std::move(b));
    }
  }
  if (e.bodies.empty()) e.frame.reset();  // devices have several samples in a frame
  return e;
}

constexpr std::array<std::string_view, 6> kTitles = {"Objects", "Segments", "Trajectories",
                                                     "Devices", "Joints",   "Model Outputs"};

/// The title that stands alone in a line, before separators at most; empty for another line.
std::string_view title_of(std::string_view line) {
  const auto title = std::ranges::find_if(kTitles, [&](std::string_view t) {
    return line.starts_with(t) && line.find_first_not_of(" \t,;", t.size()) == std::string_view::npos;
  });
  return title == kTitles.end() ? std::string_view() : *title;
}

bool is_motive(std::string_view text) {
  constexpr std::string_view kBegins = "Format Version";
  return text.starts_with(kBegins) && text.find_first_of(",;\t") == kBegins.size();
}

}  // namespace

std::vector<std::string> fields_of(const MocapBody& body) {
  std::vector<std::string> fields = {".x_m", ".y_m", ".z_m"};
  if (body.kind == Rotation::unsaid) fields.insert(fields.end(), {".rx_rad", ".ry_rad", ".rz_rad"});
  else if (body.kind != Rotation::none) fields.insert(fields.end(), {".qw", ".qx", ".qy", ".qz"});
  for (std::string& field : fields) field = body.name + field;
  return fields;
}

void MocapExport::read(std::size_t body, const RowSplitter& cells, Item* items) const {
  const MocapBody& b = bodies[body];
  const auto number = [&](std::size_t column) {
    const double value = column < cells.size() ? to_number(cells[column], true) : kMissing;
    return std::isfinite(value) ? value : kMissing;
  };
  std::array<double, 3> at = {};
  for (std::size_t k = 0; k < 3; ++k) at[k] = number(b.position[k]);
  const bool lost = zero_is_lost && at == std::array<double, 3>{};
  std::vector<double> values;
  for (const double x : at) values.push_back(lost ? kMissing : b.length_m * x);
  std::vector<double> r;
  for (const std::size_t column : b.rotation) r.push_back(lost ? kMissing : number(column));
  Eigen::Quaterniond q(kMissing, 0, 0, 0);
  if (b.kind == Rotation::unsaid) {
    for (const double angle : r) values.push_back(b.angle_rad * angle);
  } else if (b.kind == Rotation::quaternion) {
    q = Eigen::Quaterniond(r[3], r[0], r[1], r[2]);
  } else if (b.kind == Rotation::angles) {
    q = Eigen::Quaterniond::Identity();
    for (std::size_t k = 0; k < 3; ++k)
      q = q * Eigen::Quaterniond(Eigen::AngleAxisd(b.angle_rad * r[k], Eigen::Vector3d::Unit(b.order[k] - 'X')));
  } else if (b.kind == Rotation::matrix) {
    const Eigen::Matrix3d m = Eigen::Map<const Eigen::Matrix3d>(r.data());  // by columns, as Eigen's
    if ((m.transpose() * m - Eigen::Matrix3d::Identity()).norm() < kRotationTolerance && m.determinant() > 0)
      q = Eigen::Quaterniond(m).normalized();
  }
  if (b.kind != Rotation::none && b.kind != Rotation::unsaid) values.insert(values.end(), {q.w(), q.x(), q.y(), q.z()});
  for (const double value : values) (items++)->value = value;
}

std::int64_t MocapExport::stamp_ns(const RowSplitter& cells, std::size_t index) const {
  double t_s = kMissing;
  if (time && *time < cells.size()) t_s = to_number(cells[*time], true);
  else if (rate_hz > 0 && frame && *frame < cells.size())
    t_s = (to_number(cells[*frame], true) - first_frame) / rate_hz;
  else if (rate_hz > 0) t_s = static_cast<double>(index) / rate_hz;
  return std::abs(t_s) * 1e9 < kLatest_ns ? std::llround(1e9 * t_s) : kNoTime;
}

std::size_t first_lines_of(std::string_view text) {
  return is_motive(text) ? 1 : title_of(first_line(text)).empty() ? 0 : 2;
}

std::string_view below_first_lines(std::string_view text) {
  Lines lines(text);
  for (std::size_t k = first_lines_of(text); k > 0; --k) lines.next();
  return lines.rest();
}

bool is_qtm(std::string_view text) {
  constexpr std::string_view kFirst = "FILE_VERSION\t", kFrames = "NO_OF_FRAMES\t";
  return text.starts_with(kFrames) || (text.starts_with(kFirst) && text.find(kFrames) != std::string_view::npos);
}

TableHead qtm_head(std::string_view text, const std::string& name) {
  const QtmLines lines = qtm_lines(text);
  TableHead head{'\t', lines.lines, lines.lines, {}};
  if (lines.first.empty())
    throw io::InputError(name + ":" + std::to_string(lines.lines) + ":1: holds no frames; accepted: a TSV with data");
  if (std::ranges::any_of(lines.first, [](const std::string& cell) { return is_word(cell, true); })) {
    head.line = head.end = lines.lines + 1;
    for (const std::string& column : lines.first) head.columns.push_back({column, {}, {}});
    return head;
  }
  std::vector<std::string> names;
  for (const auto& [key, parts] : {std::pair("MARKER_NAMES", std::size_t{3}), std::pair("BODY_NAMES", kOfBody.size())})
    if (const auto said = lines.said.find(key); said != lines.said.end())
      for (const std::string& body : said->second)
        for (std::size_t k = 0; k < parts; ++k)
          names.push_back(k == 0 || parts == 3 ? body + " " + kOfBody[k] : kOfBody[k]);
  // frame, and time, stand before them where they are exported
  const std::size_t width = used(lines.first), more = width > names.size() ? width - names.size() : 0;
  if (names.empty() || more > 2 || width < names.size())
    throw io::InputError(name + ":" + std::to_string(lines.lines + 1) + ":1: " + std::to_string(width) + " cells for " +
                         std::to_string(names.size()) +
                         " columns of the head; accepted: an export with a line of column names");
  if (more > 0) head.columns.push_back({"Frame", {}, {}});
  if (more > 1) head.columns.push_back({"Time", {}, {}});
  for (const std::string& column : names) head.columns.push_back({column, {}, {}});
  return head;
}

std::vector<TextBlock> blocks_of(std::string_view text) {
  std::vector<TextBlock> blocks;
  Lines lines(text);
  std::string_view above;
  while (const auto line = lines.next()) {
    const std::string cell = first_cell(line->text, separator_of(line->text));
    const bool rate = std::isfinite(to_number(cell, true)) && used(split(line->text, separator_of(line->text))) == 1;
    if (rate && !title_of(above).empty()) {
      blocks.push_back({std::string(title_of(above)), above, line->number - 2});
    } else if (blocks.empty() && !is_blank(line->text) && title_of(line->text).empty()) {
      return {{"", text, 0}};
    }
    above = line->text;
  }
  for (std::size_t k = 0; k < blocks.size(); ++k) {
    const char *from = blocks[k].text.data(),
               *to = k + 1 < blocks.size() ? blocks[k + 1].text.data() : text.data() + text.size();
    blocks[k].text = {from, static_cast<std::size_t>(to - from)};
  }
  return blocks.empty() ? std::vector<TextBlock>{{"", text, 0}} : blocks;
}

std::optional<MocapExport> mocap_export_of(std::string_view text, const TableHead& head, const std::string& name) {
  if (is_motive(text)) return motive(text, head, name);
  if (is_qtm(text)) return qtm(text, head);
  if (!title_of(first_line(text)).empty()) return vicon(text, head, name);
  return std::nullopt;
}

}  // namespace flappy::flightlog
