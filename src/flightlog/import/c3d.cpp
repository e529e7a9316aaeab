#include "flightlog/import/c3d.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <set>

#include "flightlog/import/bytes.hpp"
#include "io/files.hpp"
#include "io/text.hpp"

namespace flappy::flightlog {
namespace {

constexpr std::size_t kC3dBlock = 512;
constexpr char kC3dMark = 0x50;                              ///< second byte of the header
constexpr unsigned char kIntel = 84, kDec = 85, kMips = 86;  ///< processors
constexpr std::size_t kRotationNumbers = 17;  ///< a matrix of 4 x 4, column by column, and its reliability
constexpr double kMaxFrames = 1e9;            ///< more are a damaged count

/// Numbers in the order of the processor that wrote them.
class C3dNumbers {
 public:
  C3dNumbers(std::string_view bytes, unsigned char processor) : bytes_(bytes), processor_(processor) {}

  bool has(std::size_t at, std::size_t size) const { return at <= bytes_.size() && size <= bytes_.size() - at; }
  std::uint16_t word(std::size_t at) const {
    const auto value = number_at<std::uint16_t>(bytes_.data() + at);
    return processor_ == kMips ? __builtin_bswap16(value) : value;
  }
  int integer(std::size_t at) const { return static_cast<std::int16_t>(word(at)); }
  double real(std::size_t at) const {
    auto bits = number_at<std::uint32_t>(bytes_.data() + at);
    if (processor_ == kMips) bits = __builtin_bswap32(bits);
    if (processor_ != kDec) return std::bit_cast<float>(bits);
    // VAX F: halves swapped, an exponent that is larger by 2 (Digital, VAX Architecture Reference Manual); none is 0
    bits = std::rotl(bits, 16);
    return (bits & 0x7f800000u) == 0 ? 0.0
                                     : std::bit_cast<float>(bits & 0x7fffffffu) / 4.0 * ((bits >> 31) != 0 ? -1 : 1);
  }

 private:
  std::string_view bytes_;
  unsigned char processor_;
};

/// A parameter: numbers, or texts.
struct C3dParameter {
  std::vector<double> numbers;
  std::vector<std::string> texts;
  bool real = false;
};

std::string without_blanks(std::string_view text) {
  text = text.substr(0, text.find('\0'));
  const std::size_t first = text.find_first_not_of(" \t\r\n");
  return first == std::string_view::npos
             ? ""
             : std::string(text.substr(first, text.find_last_not_of(" \t\r\n") - first + 1));
}

class C3dReader {
 public:
  C3dReader(std::string_view bytes, const std::string& name, const std::string& channel, Channels& channels,
            std::vector<std::string>& warnings)
      : bytes_(bytes),
        parameters_at_(kC3dBlock * (static_cast<unsigned char>(bytes[0]) - 1)),
        numbers_(bytes, static_cast<unsigned char>(bytes[parameters_at_ + 3])),
        name_(name),
        channel_(channel),
        channels_(channels),
        warnings_(warnings) {}

  void read() {
    read_parameters();
    read_sizes();
    read_frames();
    read_rotations();
  }

 private:
  [[noreturn]] void refuse(const std::string& what, const std::string& accepted) const {
    throw io::InputError(name_ + ": " + what + "; accepted: " + accepted);
  }
  void warn(const std::string& what) const { warnings_.push_back(name_ + ": " + what); }

  // ---- parameters

  void read_parameters() {
    std::map<int, std::string> groups;
    std::vector<std::tuple<int, std::string, C3dParameter>> found;
    std::size_t at = parameters_at_ + 4;
    while (numbers_.has(at, 2)) {
      const int size = std::abs(static_cast<signed char>(bytes_[at])), group = static_cast<signed char>(bytes_[at + 1]);
      if (size == 0) break;
      const std::size_t behind = at + 2 + static_cast<std::size_t>(size);
      if (!numbers_.has(behind, 2)) return damaged(at);
      std::string key(bytes_.substr(at + 2, static_cast<std::size_t>(size)));
      std::ranges::transform(key, key.begin(),
                             [](char c) { return c >= 'a' && c <= 'z' ? static_cast<char>(c - 32) : c; });
      const std::size_t step = numbers_.word(behind);
      if (group < 0) {
        groups[-group] = key;
      } else if (auto parameter = parameter_at(behind + 2)) {
        found.emplace_back(group, key, std::move(*parameter));
      } else {
        damaged(at);
      }
      if (step == 0) break;
      if (step < 2) return damaged(at);
      at = behind + step;
    }
    // a parameter may come before its group
    for (auto& [group, key, parameter] : found) parameters_[groups[group] + ":" + key] = std::move(parameter);
    if (!numbers_.has(at, 1)) damaged(at);
  }

  void damaged(std::size_t at) const { warn("has damaged parameters at byte " + std::to_string(at)); }

  /// A parameter at its type, number of sizes and sizes.
  std::optional<C3dParameter> parameter_at(std::size_t at) const {
    if (!numbers_.has(at, 2)) return std::nullopt;
    const int type = static_cast<signed char>(bytes_[at]);
    const std::size_t rank = static_cast<unsigned char>(bytes_[at + 1]), sizes = at + 2, size = std::abs(type);
    if ((type != -1 && type != 1 && type != 2 && type != 4) || !numbers_.has(sizes, rank)) return std::nullopt;
    const std::size_t data = sizes + rank, left = bytes_.size() - data;
    std::size_t count = 1;
    for (std::size_t k = 0; k < rank; ++k) {
      count *= static_cast<unsigned char>(bytes_[sizes + k]);
      if (count * size > left) return std::nullopt;
    }
    if (count * size > left) return std::nullopt;
    C3dParameter parameter;
    parameter.real = type == 4;
    if (type == -1) {
      const std::size_t length = rank == 0 ? 1 : static_cast<unsigned char>(bytes_[sizes]);
      for (std::size_t k = 0; length > 0 && k < count / length; ++k)
        parameter.texts.push_back(without_blanks(bytes_.substr(data + k * length, length)));
    }
    for (std::size_t k = 0; type != -1 && k < count; ++k) {
      const std::size_t place = data + k * size;
      parameter.numbers.push_back(type == 4   ? numbers_.real(place)
                                  : type == 2 ? numbers_.integer(place)
                                              : static_cast<unsigned char>(bytes_[place]));
    }
    return parameter;
  }

  const C3dParameter* find(const std::string& key) const {
    const auto found = parameters_.find(key);
    return found == parameters_.end() ? nullptr : &found->second;
  }
  /// A number; integers are without sign, as counts beyond 32767 need them.
  std::optional<double> number(const std::string& key) const {
    const C3dParameter* found = find(key);
    if (!found || found->numbers.empty() || !std::isfinite(found->numbers[0])) return std::nullopt;
    const double value = found->numbers[0];
    return !found->real && value < 0 ? value + 65536 : value;
  }
  std::string text(const std::string& key) const {
    const C3dParameter* found = find(key);
    return found && !found->texts.empty() ? found->texts[0] : "";
  }
  /// Lists of more than 255 go on in KEY2, KEY3, ...
  template <class T>
  std::vector<T> listed(const std::string& key, std::vector<T> C3dParameter::*part) const {
    std::vector<T> all;
    for (int k = 1; const C3dParameter* found = find(k == 1 ? key : key + std::to_string(k)); ++k)
      all.insert(all.end(), (found->*part).begin(), (found->*part).end());
    return all;
  }

  std::size_t count(const std::string& key, std::size_t of_header) const {
    const auto found = number(key);
    return found && *found >= 0 && *found < 65536 ? static_cast<std::size_t>(*found) : of_header;
  }

  /// Two words: the lower one first (c3d.org multiplies the upper one by 65535; programs write 65536).
  std::optional<double> field_number(const std::string& key) const {
    const C3dParameter* found = find(key);
    if (!found || found->numbers.empty()) return std::nullopt;
    const auto whole = [&](double value) { return !found->real && value < 0 ? value + 65536 : value; };
    return found->numbers.size() < 2 ? found->numbers[0] : whole(found->numbers[0]) + 65536 * whole(found->numbers[1]);
  }

  // ---- sizes

  /// Labels of `used` columns: "#3" for one without, "LABEL#4" for one that another has.
  std::vector<std::string> labels(const std::string& group, std::size_t used) const {
    std::vector<std::string> given = listed(group + ":LABELS", &C3dParameter::texts), unique;
    given.resize(used);
    std::map<std::string, int> seen;
    for (std::size_t k = 0; k < used; ++k) {
      const bool again = seen[given[k]]++ > 0, none = given[k].empty();
      unique.push_back(none || again ? given[k] + "#" + std::to_string(k + 1) : given[k]);
      if (again && !none)
        warn("has two labels " + io::shortened(given[k]) + ": the later one is " + io::shortened(unique.back()));
    }
    return unique;
  }

  void read_sizes() {
    const std::size_t block = count("POINT:DATA_START", numbers_.word(16));
    if (block < 2 || kC3dBlock * (block - 1) > bytes_.size())
      refuse("has its frames at block " + std::to_string(block), "blocks of 512 bytes within the file");
    data_at_ = kC3dBlock * (block - 1);
    points_ = count("POINT:USED", numbers_.word(2));
    const double scale = number("POINT:SCALE").value_or(numbers_.real(12));
    rate_Hz_ = number("POINT:RATE").value_or(numbers_.real(20));
    if (!(rate_Hz_ > 0) || !(rate_Hz_ < 1e6))
      refuse("has a rate of " + io::shortest_digits(rate_Hz_) + " Hz", "a rate above 0");
    if (!std::isfinite(scale) || scale == 0) refuse("has a scale of " + io::shortest_digits(scale), "another than 0");
    real_ = scale < 0;
    scale_ = std::abs(scale);
    const double analog_Hz = number("ANALOG:RATE").value_or(0);
    const std::size_t of_header = numbers_.word(4), times = numbers_.word(18);
    analogs_ = count("ANALOG:USED", times > 0 ? of_header / times : 0);
    const double ratio = std::round(analog_Hz / rate_Hz_);
    samples_ = ratio >= 1 && ratio < 65536 ? static_cast<std::size_t>(ratio) : std::max<std::size_t>(times, 1);
    if (analogs_ == 0) samples_ = 0;
    if (analogs_ * samples_ != of_header) {
      const bool header =
          times > 0 && of_header % times == 0 && fills_file(of_header) && !fills_file(analogs_ * samples_);
      warn("has " + std::to_string(of_header) + " analog samples in a frame by its header, " +
           std::to_string(analogs_ * samples_) + " by its parameters: taken as the " +
           (header ? "header says" : "parameters say"));
      if (header) samples_ = times, analogs_ = of_header / times;
    }
    const std::string unit = text("POINT:UNITS");
    static const std::map<std::string, double> kMetres = {{"m", 1},     {"dm", 0.1},    {"cm", 0.01},  {"mm", 1e-3},
                                                          {"um", 1e-6}, {"in", 0.0254}, {"ft", 0.3048}};
    if (const auto known = kMetres.find(unit); known != kMetres.end()) metres_ = known->second;
    else
      warn("has the unit \"" + io::shortened(unit) +
           "\": its lengths are as they stand; accepted: m, dm, cm, mm, um, in, ft");
    first_ = field_number("TRIAL:ACTUAL_START_FIELD").value_or(numbers_.word(6));
  }

  std::size_t word_size() const { return real_ ? 4 : 2; }
  std::size_t frame_size() const { return (4 * points_ + analogs_ * samples_) * word_size(); }
  /// Whether the frames that are declared, with so many analog samples each, are what the file holds.
  bool fills_file(std::size_t samples) const {
    const double size = static_cast<double>((4 * points_ + samples) * word_size()) * declared_frames(),
                 left = static_cast<double>(bytes_.size() - data_at_);
    return size <= left && size + 2 * kC3dBlock > left;
  }

  double declared_frames() const {
    const double frames = number("POINT:FRAMES").value_or(numbers_.word(8) - numbers_.word(6) + 1);
    if (const auto all = number("POINT:LONG_FRAMES")) return *all;
    const auto first = field_number("TRIAL:ACTUAL_START_FIELD"), last = field_number("TRIAL:ACTUAL_END_FIELD");
    const double trial = first && last ? *last - *first + 1 : 0;
    return trial > 65535 || (trial > 0 && frames == 65535) ? trial : frames;  // FRAMES has 16 bits
  }

  // ---- data

  void read_frames() {
    const double declared = declared_frames();
    if (!(declared >= 0) || declared > kMaxFrames)
      refuse("has " + io::shortest_digits(declared) + " frames", "up to 1e9");
    const std::size_t size = frame_size();
    if (size == 0) return;
    const std::size_t there = (bytes_.size() - data_at_) / size,
                      frames = std::min(there, static_cast<std::size_t>(declared));
    if (frames < static_cast<std::size_t>(declared))
      warn("ends after " + std::to_string(frames) + " of " + io::shortest_digits(declared) +
           " frames: read as far as it goes");
    const std::size_t behind = bytes_.size() - data_at_ - frames * size;
    if (frames == static_cast<std::size_t>(declared) && !find("ROTATION:USED") && behind >= 2 * kC3dBlock + size)
      warn("has " + std::to_string(behind) + " bytes behind the " + std::to_string(frames) +
           " frames that it declares: left out");
    add_points(frames);
    add_analog(frames);
  }

  void add_points(std::size_t frames) {
    if (points_ == 0) return;
    Row row = {{"t", 0}, {"frame", 0}};
    const std::vector<std::string> names = labels("POINT", points_);
    for (const std::string& label : names)
      for (const char* part : {".x", ".y", ".z", ".residual"}) row.push_back({label + part, 0});
    declare(channel_, row);
    channels_.describe(channel_, {"C3D", false, {}, names});
    if (!channels_.wants(channel_)) return;
    const std::vector<std::size_t> of_markers = add_markers(names, row);
    for (std::size_t f = 0; f < frames; ++f) {
      row[0].value = static_cast<double>(f) / rate_Hz_;
      row[1].value = first_ + static_cast<double>(f);
      for (std::size_t p = 0; p < points_; ++p) {
        const std::size_t at = data_at_ + f * frame_size() + 4 * p * word_size();
        for (std::size_t k = 0; k < 3; ++k)
          row[2 + 4 * p + k].value =
              metres_ * (real_ ? numbers_.real(at + 4 * k) : scale_ * numbers_.integer(at + 2 * k));
        // the lower byte is the residual, the upper one the cameras; below 0: not seen
        const double word = real_ ? numbers_.real(at + 12) : numbers_.integer(at + 6);
        const bool seen = word >= 0 && word < 32768;
        row[2 + 4 * p + 3].value = seen ? metres_ * scale_ * (static_cast<int>(word) & 0xff) : 0;
        for (std::size_t k = 0; k < 4 && !seen; ++k)
          row[2 + 4 * p + k].value = std::numeric_limits<double>::quiet_NaN();
      }
      for (std::size_t k = 0; k < of_markers.size(); ++k)
        row[row.size() - of_markers.size() + k].value = row[of_markers[k]].value;
      add(channel_, row);
    }
  }

  /// Adds the wanted fields of markers as a mapping calls them, `nose.x_m`, behind a row; returns which of its numbers
  /// they are.
  std::vector<std::size_t> add_markers(const std::vector<std::string>& names, Row& row) const {
    std::vector<std::size_t> copied;
    const std::set<std::string>* wanted = channels_.wanted(channel_);
    for (std::size_t p = 0; wanted && p < names.size(); ++p)
      for (std::size_t k = 0; k < 3; ++k)
        if (const std::string field = names[p] + kPointAxes[k]; wanted->contains(field)) {
          row.push_back({field, 0});
          copied.push_back(2 + 4 * p + k);
        }
    return copied;
  }

  void add_analog(std::size_t frames) {
    if (analogs_ == 0) return;
    const std::string channel = channel_ + ".analog";
    Row row = {{"t", 0}};
    for (const std::string& label : labels("ANALOG", analogs_)) row.push_back({label, 0});
    declare(channel, row);
    if (!channels_.wants(channel)) return;
    const bool no_sign = text("ANALOG:FORMAT") == "UNSIGNED";
    std::vector<double> scales = listed("ANALOG:SCALE", &C3dParameter::numbers),
                        offsets = listed("ANALOG:OFFSET", &C3dParameter::numbers);
    if (scales.size() < analogs_)
      warn("has no ANALOG:SCALE for " + std::to_string(analogs_ - scales.size()) + " channels: taken as 1");
    scales.resize(analogs_, 1), offsets.resize(analogs_, 0);
    for (double& offset : offsets)
      if (no_sign && offset < 0) offset += 65536;
    const C3dParameter* general = find("ANALOG:GEN_SCALE");
    const double all = general && !general->numbers.empty() ? general->numbers[0] : 1;
    for (std::size_t f = 0; f < frames; ++f)
      for (std::size_t s = 0; s < samples_; ++s) {
        row[0].value = static_cast<double>(f * samples_ + s) / (rate_Hz_ * static_cast<double>(samples_));
        for (std::size_t k = 0; k < analogs_; ++k) {
          const std::size_t at = data_at_ + f * frame_size() + (4 * points_ + s * analogs_ + k) * word_size();
          const double raw = real_ ? numbers_.real(at) : no_sign ? numbers_.word(at) : numbers_.integer(at);
          row[1 + k].value = (raw - offsets[k]) * scales[k] * all;
        }
        add(channel, row);
      }
  }

  /// Rotations of C-Motion's group: floats, `ratio` of each for a frame of points, in a section of their own.
  void read_rotations() {
    const std::size_t used = count("ROTATION:USED", 0), block = count("ROTATION:DATA_START", 0);
    if (used == 0) return;
    const double ratio =
        number("ROTATION:RATIO").value_or(std::round(number("ROTATION:RATE").value_or(rate_Hz_) / rate_Hz_));
    const std::size_t at = kC3dBlock * (std::max<std::size_t>(block, 1) - 1), size = 4 * kRotationNumbers * used;
    if (block == 0 || at > bytes_.size() || !(ratio >= 1) || ratio > 65535)
      return warn("has rotations at byte " + std::to_string(at) + ", " + io::shortest_digits(ratio) +
                  " in a frame: left out");
    const std::string channel = channel_ + ".rotation";
    Row row = {{"t", 0}};
    for (const std::string& label : labels("ROTATION", used))
      for (const char* part : {".x", ".y", ".z", ".qw", ".qx", ".qy", ".qz"}) row.push_back({label + part, 0});
    declare(channel, row);
    const std::size_t there = (bytes_.size() - at) / size;
    const double declared = declared_frames() * ratio;
    if (static_cast<double>(there) < declared)
      warn("ends after " + std::to_string(there) + " of " + io::shortest_digits(declared) +
           " rotations: read as far as it goes");
    const std::size_t rows = std::min(there, static_cast<std::size_t>(declared));
    if (!channels_.wants(channel)) return;
    std::size_t odd = 0;
    for (std::size_t f = 0; f < rows; ++f) {
      row[0].value = static_cast<double>(f) / (rate_Hz_ * ratio);
      for (std::size_t k = 0; k < used; ++k)
        odd += !rotation(at + f * size + 4 * kRotationNumbers * k, &row[1 + 7 * k]);
      add(channel, row);
    }
    if (odd > 0) warn("has " + std::to_string(odd) + " rotations whose matrix is none: taken as missing");
  }

  /// False where the matrix is no rotation; a reliability below 0 means that there was none to measure.
  bool rotation(std::size_t at, Item* items) const {
    constexpr double kTolerance = 1e-3;  // that of quaternions of an imported recording
    Eigen::Matrix4d matrix;
    for (std::size_t k = 0; k < 16; ++k) matrix.data()[k] = numbers_.real(at + 4 * k);
    const Eigen::Matrix3d turn = matrix.topLeftCorner<3, 3>();
    const bool seen = numbers_.real(at + 64) >= 0;
    const bool sound = (turn * turn.transpose() - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff() < kTolerance &&
                       turn.determinant() > 0;
    const Eigen::Quaterniond q(turn);
    const std::array<double, 7> values = {
        metres_ * matrix(0, 3), metres_ * matrix(1, 3), metres_ * matrix(2, 3), q.w(), q.x(), q.y(), q.z()};
    for (std::size_t k = 0; k < values.size(); ++k)
      items[k].value = seen && sound ? values[k] : std::numeric_limits<double>::quiet_NaN();
    return sound || !seen;
  }

  /// Adds a row whose first number is its time, s.
  void add(const std::string& channel, const Row& row) {
    const double t_ns = 1e9 * row[0].value;
    channels_.add(channel, kNoTime, t_ns < kLatest_ns ? std::llround(t_ns) : kNoTime, row);
  }

  void declare(const std::string& channel, const Row& row) {
    std::vector<std::string> fields;
    for (const Item& item : row) fields.push_back(item.name);
    channels_.add(channel, fields);
  }

  std::string_view bytes_;
  std::size_t parameters_at_;
  C3dNumbers numbers_;
  const std::string& name_;
  const std::string& channel_;
  Channels& channels_;
  std::vector<std::string>& warnings_;
  std::map<std::string, C3dParameter> parameters_;  ///< by "GROUP:NAME"
  std::size_t points_ = 0, analogs_ = 0, samples_ = 0, data_at_ = 0;
  double rate_Hz_ = 0, scale_ = 1, metres_ = 1, first_ = 1;
  bool real_ = false;
};

}  // namespace

bool is_c3d(std::string_view bytes) {
  if (bytes.size() < 2 * kC3dBlock || bytes[1] != kC3dMark || bytes[0] < 2) return false;
  const std::size_t at = kC3dBlock * (static_cast<unsigned char>(bytes[0]) - 1) + 3;
  if (at >= bytes.size() || bytes.substr(0, kC3dBlock).find('\0') == std::string_view::npos) return false;  // a text
  const auto processor = static_cast<unsigned char>(bytes[at]);
  return processor == kIntel || processor == kDec || processor == kMips;
}

void read_c3d(std::string_view bytes, const std::string& name, const std::string& channel, Channels& channels,
              std::vector<std::string>& warnings) {
  if (!is_c3d(bytes)) throw io::InputError(name + ": is no C3D; accepted: a file that begins as one");
  C3dReader(bytes, name, channel, channels, warnings).read();
}

}  // namespace flappy::flightlog
