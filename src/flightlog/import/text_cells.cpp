#include "flightlog/import/text_cells.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <new>

namespace flappy::flightlog {
namespace {

bool is_one_of(std::string_view text, std::initializer_list<std::string_view> words) {
  const auto lower = [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; };
  return std::ranges::any_of(words, [&](std::string_view word) { return std::ranges::equal(text, word, {}, lower); });
}

/// Takes exactly `count` digits off the front of `text`.
std::optional<int> digits(std::string_view& text, std::size_t count) {
  int value = 0;
  if (text.size() < count) return std::nullopt;
  for (const char c : text.substr(0, count)) {
    if (c < '0' || c > '9') return std::nullopt;
    value = 10 * value + (c - '0');
  }
  text.remove_prefix(count);
  return value;
}

bool skip(std::string_view& text, char c) {
  if (!text.starts_with(c)) return false;
  text.remove_prefix(1);
  return true;
}

/// "2026-05-04", "2026/05/04", "04.05.2026": s from 1970.
std::optional<double> date_s(std::string_view& text) {
  const bool day_first = text.size() > 2 && text[2] == '.';
  const char between = day_first ? '.' : text.size() > 4 && text[4] == '/' ? '/' : '-';
  const auto first = digits(text, day_first ? 2 : 4);
  if (!first || !skip(text, between)) return std::nullopt;
  const auto month = digits(text, 2);
  if (!month || !skip(text, between)) return std::nullopt;
  const auto last = digits(text, day_first ? 4 : 2);
  if (!last) return std::nullopt;
  const auto &year = day_first ? last : first, &day = day_first ? first : last;
  const std::chrono::year_month_day date{std::chrono::year(*year), std::chrono::month(static_cast<unsigned>(*month)),
                                         std::chrono::day(static_cast<unsigned>(*day))};
  if (!date.ok()) return std::nullopt;
  return static_cast<double>(std::chrono::seconds(std::chrono::sys_days(date).time_since_epoch()).count());
}

/// "10:15", "10:15:00.25": s from midnight.
std::optional<double> time_of_day_s(std::string_view& text) {
  const auto hour = digits(text, 2);
  if (!hour || *hour > 24 || !skip(text, ':')) return std::nullopt;
  const auto minute = digits(text, 2);
  if (!minute || *minute > 59) return std::nullopt;
  double seconds = 3600.0 * *hour + 60.0 * *minute;
  if (!skip(text, ':')) return seconds;
  const auto second = digits(text, 2);
  if (!second || *second > 60) return std::nullopt;  // 60 is a leap second
  seconds += *second;
  if (!text.starts_with('.') && !text.starts_with(',')) return seconds;
  std::string fraction = ".";
  text.remove_prefix(1);
  while (!text.empty() && text.front() >= '0' && text.front() <= '9') fraction += text.front(), text.remove_prefix(1);
  return seconds + std::strtod(fraction.c_str(), nullptr);
}

/// "", "Z", "+02", "+0200", "+02:00": s that the clock is ahead of UTC.
std::optional<double> zone_s(std::string_view text) {
  if (text.empty() || text == "Z" || text == "z") return 0;
  const double sign = text.front() == '-' ? -1 : 1;
  if (!skip(text, '+') && !skip(text, '-')) return std::nullopt;
  const auto hours = digits(text, 2);
  if (!hours) return std::nullopt;
  skip(text, ':');
  const auto minutes = text.empty() ? std::optional(0) : digits(text, 2);
  if (!minutes || !text.empty()) return std::nullopt;
  return sign * (3600.0 * *hours + 60.0 * *minutes);
}

constexpr std::string_view kOpen = "[({", kClose = "])}";

/// The text between the brackets of a list, or of "array([...])" as Python prints it. None: the text is no list.
std::optional<std::string_view> list_in(std::string_view text) {
  if (text.starts_with("array(") && text.ends_with(')')) {
    const std::size_t open = text.find('['), close = text.rfind(']');
    if (open >= close || close == std::string_view::npos) return std::nullopt;
    return text.substr(open + 1, close - open - 1);
  }
  if (text.size() < 2 || kOpen.find(text.front()) == std::string_view::npos ||
      kOpen.find(text.front()) != kClose.find(text.back()))
    return std::nullopt;
  return text.substr(1, text.size() - 2);
}

}  // namespace

RowSplitter::RowSplitter(char separator) : merges_(separator == ' ') {
  if (csv_init(&parser_, CSV_EMPTY_IS_NULL) != 0) throw std::bad_alloc();
  csv_set_delim(&parser_, static_cast<unsigned char>(separator));
}

bool RowSplitter::take(std::string_view line) {
  if (whole_) count_ = 0;
  whole_ = false;
  parse(line);
  parse("\n");
  return whole_;
}

void RowSplitter::end_row() {
  csv_fini(&parser_, on_cell, on_row, this);
  whole_ = true;
}

void RowSplitter::parse(std::string_view text) {
  if (csv_parse(&parser_, text.data(), text.size(), on_cell, on_row, this) != text.size()) throw std::bad_alloc();
}

void RowSplitter::on_cell(void* text, std::size_t size, void* self) {
  auto& own = *static_cast<RowSplitter*>(self);
  if (own.merges_ && text == nullptr) return;  // empty cell between two blanks
  if (own.count_ == own.cells_.size()) own.cells_.emplace_back();
  own.cells_[own.count_++].assign(text == nullptr ? "" : static_cast<const char*>(text), size);
}

std::optional<Line> Lines::next() {
  if (rest_.empty()) return std::nullopt;
  const std::size_t end = rest_.find_first_of("\r\n");
  const std::string_view line = rest_.substr(0, end);
  const bool both = end != std::string_view::npos && rest_.substr(end, 2) == "\r\n";
  rest_.remove_prefix(end == std::string_view::npos ? rest_.size() : end + (both ? 2 : 1));
  return Line{line, ++number_};
}

bool is_blank(std::string_view line) { return line.find_first_not_of(" \t") == std::string_view::npos; }
bool is_comment(std::string_view line) {
  return line.substr(std::min(line.find_first_not_of(" \t"), line.size())).starts_with('#');
}

std::string_view uncommented(std::string_view line) {
  line.remove_prefix(std::min(line.find_first_not_of("# \t"), line.size()));
  return line;
}

char separator_of(std::string_view line) {
  std::array<std::size_t, 3> counts = {};
  constexpr std::string_view kSeparators = ",;\t";
  bool quoted = false, blanks = false;
  for (const char c : line) {
    if (c == '"') quoted = !quoted;
    if (quoted) continue;
    if (const std::size_t k = kSeparators.find(c); k != std::string_view::npos) ++counts[k];
    blanks |= c == ' ';
  }
  const auto most = std::ranges::max_element(counts);
  if (*most > 0) return kSeparators[static_cast<std::size_t>(most - counts.begin())];
  return blanks ? ' ' : ',';
}

Cells split(std::string_view line, char separator) {
  RowSplitter splitter(separator);
  if (!splitter.take(line)) splitter.end_row();
  return splitter.cells();
}

std::size_t used(const Cells& cells) {
  std::size_t width = cells.size();
  while (width > 0 && cells[width - 1].empty()) --width;
  return width;
}

double to_number(std::string_view text, bool decimal_comma) {
  std::string with_point;
  if (decimal_comma && std::ranges::count(text, ',') == 1) {
    with_point = text;
    std::ranges::replace(with_point, ',', '.');
    text = with_point;
  }
  if (text.starts_with('+')) text.remove_prefix(1);
  double value = 0;
  const auto [stop, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error == std::errc::result_out_of_range)
    value = std::strtod(std::string(text).c_str(), nullptr);  // underflow gives 0, overflow infinity
  if (error != std::errc::invalid_argument && stop == text.data() + text.size()) return value;
  if (is_one_of(text, {"", "na", "n/a", "none", "null"})) return kMissing;
  return kNoNumber;
}

std::optional<double> to_time_s(std::string_view text) {
  double seconds = 0;
  std::string_view rest = text;
  if (const auto date = date_s(rest)) {
    seconds = *date;
    if (rest.empty()) return seconds;
    if (!skip(rest, 'T') && !skip(rest, 't') && !skip(rest, ' ')) return std::nullopt;
  } else {
    rest = text;
  }
  const auto time = time_of_day_s(rest);
  if (!time) return std::nullopt;
  skip(rest, ' ');  // as Python prints before a zone
  const auto zone = zone_s(rest);
  if (!zone) return std::nullopt;
  return seconds + *time - *zone;
}

double list_element(std::string_view text, std::size_t index) {
  if (std::isnan(to_number(text, false))) return kMissing;
  const auto list = list_in(text);
  if (!list) return kNoNumber;
  text = *list;
  constexpr std::string_view kBetween = ", ;\t\r\n[]";
  for (std::size_t k = 0;; ++k) {
    text.remove_prefix(std::min(text.find_first_not_of(kBetween), text.size()));
    if (text.empty()) return kNoNumber;
    const std::size_t end = std::min(text.find_first_of(kBetween), text.size());
    if (k == index) {
      std::string_view element = text.substr(0, end);
      if (element.starts_with("np.") &&
          element.ends_with(')')) {  // "np.float64(0.1)", as NumPy prints its numbers in a list
        element.remove_prefix(std::min(element.find('(') + 1, element.size()));
        element.remove_suffix(element.empty() ? 0 : 1);
      }
      return to_number(element, false);
    }
    text.remove_prefix(end);
  }
}

bool is_word(std::string_view text, bool decimal_comma) {
  return std::isinf(to_number(text, decimal_comma)) && !to_time_s(text) && std::isinf(list_element(text, 0));
}

}  // namespace flappy::flightlog
