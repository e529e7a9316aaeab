// What the head of a motion-capture export says: which columns hold which rigid body or marker, in which units.
//
// Motive's CSV (OptiTrack; format versions 1.1x to 1.25), QTM's TSV, 3D and 6D (Qualisys), and blocks of Vicon's CSV
// (Tracker, Nexus). Sources: docs.optitrack.com, "Data Export: CSV"; docs.qualisys.com, "Motion data (.tsv)", "Rotation
// angle calculations in QTM". What became of each:
//
//   fields NAME.x_m, .y_m, .z_m              of each body and marker, in the program's world
//   fields NAME.qw, .qx, .qy, .qz            of each body: quaternions as they are; of Motive's angles, R = R1 R2 R3 in the
//                                            order of its Rotation Type; of QTM's matrix, which the definition of Euler
//                                            angles that its user may set leaves alone
//   fields NAME.rx_rad, .ry_rad, .rz_rad     of a body of Vicon's with three numbers of which the file does not say what
//                                            they are
//   stamp of each row                        the time of the frame, or frame by rate
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "flightlog/import/channels.hpp"
#include "flightlog/import/table_head.hpp"
#include "flightlog/import/text_cells.hpp"

namespace flappy::flightlog {

struct MocapBody {
  enum class Rotation { none, quaternion, angles, matrix, unsaid };
  std::string name;
  std::array<std::size_t, 3> position;  ///< columns of x, y, z
  double length_m = 1;                  ///< of their unit
  Rotation kind = Rotation::none;
  std::vector<std::size_t> rotation;  ///< columns: x, y, z, w; about the axes of `order`; matrix by columns; x, y, z
  std::string order;                  ///< axes of the angles, as "XYZ"
  double angle_rad = 1;               ///< of their unit
};

struct MocapExport {
  std::string program;  ///< "Motive", "QTM", "Vicon"
  std::vector<MocapBody> bodies;
  bool says_up = true;                  ///< whether the program's world has z up unless its user chose otherwise
  bool zero_is_lost = false;            ///< whether a position of three zeros is one that was not seen
  std::optional<std::size_t> time;      ///< column of the time, s
  std::optional<std::size_t> frame;     ///< column of the number of the frame, from `first_frame` at 0 s
  double first_frame = 0, rate_hz = 0;  ///< 0: not said
  std::size_t frames = 0;               ///< rows that the head says there are; 0: not said

  /// Writes the numbers of row `cells` of body `body` to `items`, as many as fields_of() it. NaN for what was not seen.
  void read(std::size_t body, const RowSplitter& cells, Item* items) const;
  /// The time of a row, ns; `index` counts rows from 0. kNoTime where the head does not lead to one.
  std::int64_t stamp_ns(const RowSplitter& cells, std::size_t index) const;
};

/// Names of the fields of a body, after that of the body.
std::vector<std::string> fields_of(const MocapBody& body);

/// Lines at the begin of an export that belong to no table: Motive's first, title and rate of a block of Vicon's.
std::size_t first_lines_of(std::string_view text);
/// The text below them.
std::string_view below_first_lines(std::string_view text);

bool is_qtm(std::string_view text);
/// The head of a TSV of QTM, whose names stand in a line or in the head alone. InputError for one without frames.
TableHead qtm_head(std::string_view text, const std::string& name);

/// A block of a file of Vicon's: Objects, Segments, Trajectories, Devices, ...
struct TextBlock {
  std::string title;
  std::string_view text;
  std::size_t line;  ///< number of lines before it
};
/// The blocks of a file of Vicon's; one without title for any other text.
std::vector<TextBlock> blocks_of(std::string_view text);

/// What the head of an export says; nothing for a table of another program. `name` is the file in messages. InputError for
/// units that are not known.
std::optional<MocapExport> mocap_export_of(std::string_view text, const TableHead& head, const std::string& name);

}  // namespace flappy::flightlog
