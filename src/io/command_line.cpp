#include "io/command_line.hpp"

#include <CLI/CLI.hpp>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <type_traits>

#include "io/files.hpp"

namespace flappy::io {

Option Option::required() const {
  option_->required();
  return *this;
}
Option Option::range(int low, int high) const {
  option_->check(CLI::Range(low, high));
  return *this;
}
Option Option::range(std::uint64_t low, std::uint64_t high) const {
  option_->check(CLI::Range(low, high));
  return *this;
}
Option Option::range(double low, double high) const {
  option_->check(CLI::Range(low, high));
  return *this;
}
Option Option::one_of(const std::vector<std::string>& accepted) const {
  option_->check(CLI::IsMember(accepted));
  return *this;
}
Option Option::shows_default() const {
  option_->capture_default_str();
  return *this;
}
Option Option::needs(Option other) const {
  option_->needs(other.option_);
  return *this;
}
Option Option::excludes(Option other) const {
  option_->excludes(other.option_);
  return *this;
}
Option Option::one_at_a_time() const {
  option_->allow_extra_args(false);
  return *this;
}
Option Option::separated_by(char separator) const {
  option_->delimiter(separator);
  return *this;
}
bool Option::given() const { return option_->count() > 0; }

template <class T>
Option Command::option(const std::string& name, T& value, const std::string& help) const {
  CLI::Option* const option = app_->add_option(name, value, help);
  constexpr bool is_text = std::is_same_v<T, std::string> || std::is_same_v<T, std::filesystem::path> ||
                           std::is_same_v<T, std::vector<std::string>> ||
                           std::is_same_v<T, std::vector<std::filesystem::path>>;
  if constexpr (is_text)  // as of --out "$OUT" where OUT is not set, which must not stand for the default
    option->check([](const std::string& text) { return text.empty() ? "is empty; accepted: a value" : ""; });
  if constexpr (std::is_unsigned_v<T> || std::is_same_v<T, std::vector<std::uint64_t>>)  // CLI11 would accept -1
    option->check([](const std::string& text) {
      return text.find('-') == std::string::npos ? "" : "Value " + text + " is below 0";
    });
  if constexpr (std::is_same_v<T, double> || std::is_same_v<T, std::vector<double>>)  // ranges of CLI11 hold NaN
    option->check([](const std::string& text) {
      double x = 0;
      const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), x);
      return error != std::errc() || std::isfinite(x) ? "" : "Value " + text + " is not finite";
    });
  return Option(option);
}
template Option Command::option(const std::string&, int&, const std::string&) const;
template Option Command::option(const std::string&, unsigned&, const std::string&) const;
template Option Command::option(const std::string&, std::uint64_t&, const std::string&) const;
template Option Command::option(const std::string&, double&, const std::string&) const;
template Option Command::option(const std::string&, std::string&, const std::string&) const;
template Option Command::option(const std::string&, std::filesystem::path&, const std::string&) const;
template Option Command::option(const std::string&, std::vector<std::string>&, const std::string&) const;
template Option Command::option(const std::string&, std::vector<double>&, const std::string&) const;
template Option Command::option(const std::string&, std::vector<std::uint64_t>&, const std::string&) const;
template Option Command::option(const std::string&, std::vector<std::filesystem::path>&, const std::string&) const;

Option Command::flag(const std::string& name, bool& value, const std::string& help) const {
  return Option(app_->add_flag(name, value, help));
}
Command Command::command(const std::string& name, const std::string& help) const {
  return Command(app_->add_subcommand(name, help));
}
void Command::expect_commands(std::size_t least, std::size_t most) const { app_->require_subcommand(least, most); }
bool Command::given() const { return app_->parsed(); }

}  // namespace flappy::io
