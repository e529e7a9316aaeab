#include "flightlog/import/matlab.hpp"

#include <algorithm>
#include <array>
#include <cstring>
#include <functional>
#include <limits>
#include <map>
#include <numeric>

#include "flightlog/import/bytes.hpp"
#include "flightlog/import/in_child.hpp"
#include "flightlog/import/matlab_file.hpp"
#include "io/files.hpp"
#include "io/plugin.hpp"
#include "io/text.hpp"

namespace flappy::flightlog {
namespace {

constexpr std::size_t kMaxColumns = 4096;  // of one array, as numbers of one message of ULog
const std::string kMatlabAccepted = "what save of MATLAB wrote";

/// How an array is a table.
struct Shape {
  std::string channel;
  std::vector<std::string> fields;
  std::vector<std::size_t> begins;  ///< index of the first number of each field
  std::size_t rows = 0, step = 1;   ///< of a field's numbers
};

std::size_t numbers_in(const MatlabArray& array) {
  return std::accumulate(array.sizes.begin(), array.sizes.end(), std::size_t{1}, std::multiplies<>());
}

Shape shape_of(const MatlabArray& array, const std::string& stem) {
  Shape shape;
  const std::size_t dot = array.name.find('.');
  shape.channel = dot == std::string::npos ? stem : array.name.substr(0, dot);
  const auto longest = std::ranges::max_element(array.sizes);
  shape.rows = longest == array.sizes.end() ? 0 : *longest;
  if (shape.rows < 2) return {shape.channel, {}, {}, 0, 1};
  shape.fields = {dot == std::string::npos ? array.name : array.name.substr(dot + 1)};
  shape.begins = {0};
  std::size_t step = 1;
  for (auto side = array.sizes.begin(); side != array.sizes.end(); step *= *side++) {
    if (side == longest) shape.step = step;
    if (side == longest || *side == 1) continue;
    std::vector<std::string> fields;
    std::vector<std::size_t> begins;
    for (std::size_t f = 0; f < shape.fields.size(); ++f)
      for (std::size_t k = 0; k < *side; ++k) {
        fields.push_back(shape.fields[f] + "[" + std::to_string(k) + "]");
        begins.push_back(shape.begins[f] + k * step);
      }
    shape.fields = std::move(fields), shape.begins = std::move(begins);
  }
  return shape;
}

bool is_wide(const MatlabArray& array) {
  const std::size_t rows = array.sizes.empty() ? 0 : std::ranges::max(array.sizes);
  return rows > 0 && numbers_in(array) / rows > kMaxColumns;
}

// What the child sends: a letter, then texts and numbers, each text and list with its size before it.
constexpr char kArray = 'a', kLeftOut = 'o', kWarned = 'w';

class ToParent : public MatlabSink {
 public:
  ToParent(const Channels& channels, std::string stem, const Send& send)
      : channels_(channels), stem_(std::move(stem)), send_(send) {}

  bool wants(const MatlabArray& array) override {
    if (is_wide(array)) return false;
    const Shape shape = shape_of(array, stem_);
    return channels_.wants(shape.channel) &&
           std::ranges::any_of(shape.fields, [&](const auto& f) { return channels_.wants(shape.channel, f); });
  }
  void take(const MatlabArray& array, const std::vector<double>& values) override {
    if (is_wide(array)) return leave_out(array.name, "more than " + std::to_string(kMaxColumns) + " columns");
    begin(kArray);
    text(array.name);
    list(array.sizes.data(), array.sizes.size());
    list(values.data(), wants(array) ? values.size() : 0);
  }
  void leave_out(const std::string& name, const std::string& kind) override {
    begin(kLeftOut);
    text(name + " (" + kind + ")");
  }
  void warn(const std::string& what) override {
    begin(kWarned);
    text(what);
  }

 private:
  void begin(char letter) { send_({&letter, 1}); }
  template <class T>
  void list(const T* values, std::size_t count) {
    send_({reinterpret_cast<const char*>(&count), sizeof count});
    send_({reinterpret_cast<const char*>(values), count * sizeof(T)});
  }
  void text(const std::string& words) { list(words.data(), words.size()); }

  const Channels& channels_;
  std::string stem_;
  const Send& send_;
};

/// Takes what a ToParent sent; bytes that none sent give empty texts and lists.
class FromChild {
 public:
  explicit FromChild(std::string_view bytes) : rest_(bytes) {}

  bool more() const { return !rest_.empty(); }
  char letter() {
    const char found = rest_.front();
    rest_.remove_prefix(1);
    return found;
  }
  template <class T>
  std::vector<T> list() {
    const std::string_view raw = content(sizeof(T));
    std::vector<T> values(raw.size() / sizeof(T));
    if (!raw.empty()) std::memcpy(values.data(), raw.data(), raw.size());
    return values;
  }
  std::string text() { return std::string(content(1)); }

 private:
  std::string_view content(std::size_t size) {
    if (rest_.size() < sizeof(std::size_t)) return rest_ = {};
    const auto count = number_at<std::size_t>(rest_.data());
    rest_.remove_prefix(sizeof count);
    if (count > rest_.size() / size) return rest_ = {};
    const std::string_view found = rest_.substr(0, count * size);
    rest_.remove_prefix(found.size());
    return found;
  }

  std::string_view rest_;
};

/// The columns of a channel, which are rows once all are there.
struct MatlabColumns {
  std::vector<std::string> fields;
  Row row;
  std::vector<std::vector<double>> values;  ///< of each item of the row
  std::size_t rows = 0;

  void add(const Shape& shape, const std::vector<double>& numbers, const Channels& channels) {
    fields.insert(fields.end(), shape.fields.begin(), shape.fields.end());
    if (channels.wants(shape.channel)) rows = std::max(rows, shape.rows);
    for (std::size_t f = 0; f < shape.fields.size() && !numbers.empty(); ++f) {
      if (!channels.wants(shape.channel, shape.fields[f])) continue;
      row.push_back({shape.fields[f], 0});
      auto& column = values.emplace_back();
      for (std::size_t k = 0; k < shape.rows; ++k) column.push_back(numbers[shape.begins[f] + k * shape.step]);
    }
  }
};

}  // namespace

bool is_matlab(std::string_view bytes) {
  return bytes.starts_with("MATLAB 5.0 MAT-file") || bytes.starts_with("MATLAB 7.3 MAT-file");
}

bool is_matlab_4(std::string_view bytes) {
  constexpr std::size_t kWords = 5, kMaxName = 64;  // MATLAB's names have at most 63 letters
  if (bytes.size() < 4 * kWords) return false;
  std::array<std::uint32_t, kWords> words;  // kind, rows, columns, whether complex, letters of the name
  for (std::size_t k = 0; k < kWords; ++k) words[k] = number_at<std::uint32_t>(bytes.data() + 4 * k);
  if (words[0] >= 5000)  // written with the other byte order
    for (std::uint32_t& word : words) word = __builtin_bswap32(word);
  const std::uint32_t kind = words[0], letters = words[4];
  return kind < 5000 && kind / 100 % 10 == 0 && kind / 10 % 10 <= 5 && kind % 10 <= 2 && words[3] <= 1 && letters > 1 &&
         letters <= kMaxName && bytes.size() >= 4 * kWords + letters &&
         bytes.substr(4 * kWords, letters).find('\0') == letters - 1;
}

void read_matlab(const std::filesystem::path& file, std::string_view bytes, Channels& channels,
                 std::vector<std::string>& warnings) {
  const std::string stem = file.stem().string();
  const auto* const functions = io::plugin<MatlabFunctions>(
      "matlab", "flappy_matlab_functions",
      file.string() +
          ": is a MATLAB file, which this installation does not read; accepted: one with lib/flappy/matlab.so");
  const std::string sent = read_in_child(file.string(), bytes.size(), kMatlabAccepted, [&](const Send& send) {
    ToParent sender(channels, stem, send);
    functions->read(file.string(), bytes, sender);
  });
  std::map<std::string, MatlabColumns> found;
  std::vector<std::string> left_out;
  for (FromChild received(sent); received.more();) {
    const char letter = received.letter();
    if (letter == kArray) {
      MatlabArray array{received.text(), {}};
      array.sizes = received.list<std::size_t>();
      const auto values = received.list<double>();
      const Shape shape = shape_of(array, stem);
      if (!shape.fields.empty() && (values.empty() || values.size() == numbers_in(array)))
        found[shape.channel].add(shape, values, channels);
    } else {
      const std::string words = received.text();
      if (letter == kLeftOut) left_out.push_back(io::shortened(words));
      else warnings.push_back(file.string() + ": " + words);
    }
  }
  if (!left_out.empty())
    warnings.push_back(file.string() +
                       ": left out, as no arrays of numbers: " + io::shortened(io::joined(left_out), 2000) +
                       "; accepted: as of seconds(t - t(1)), of table2struct(T, \"ToScalar\", true)");
  for (auto& [channel, columns] : found) {
    channels.add(channel, columns.fields);
    for (std::size_t k = 0; k < columns.rows; ++k) {
      for (std::size_t f = 0; f < columns.row.size(); ++f)
        columns.row[f].value =
            k < columns.values[f].size() ? columns.values[f][k] : std::numeric_limits<double>::quiet_NaN();
      channels.add(channel, kNoTime, kNoTime, columns.row);
    }
  }
}

}  // namespace flappy::flightlog
