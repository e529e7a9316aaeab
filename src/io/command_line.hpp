// Options and commands of a program. CLI11 parses them; it stands behind this wall because its templates take seconds in every
// file that includes them.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace CLI {
class App;
class Option;
}  // namespace CLI

namespace flappy::io {

/// An option, and what else is asked of it; each of these returns the option itself.
class Option {
 public:
  Option() = default;
  explicit Option(CLI::Option* option) : option_(option) {}

  Option required() const;
  Option range(int low, int high) const;
  Option range(std::uint64_t low, std::uint64_t high) const;
  Option range(double low, double high) const;
  Option one_of(const std::vector<std::string>& accepted) const;
  /// Its value before parsing is the default that --help shows.
  Option shows_default() const;
  Option needs(Option other) const;
  Option excludes(Option other) const;
  /// A list that takes one value each time it is given, so that what follows is left to others.
  Option one_at_a_time() const;
  /// A list that one value holds whole.
  Option separated_by(char separator) const;

  bool given() const;

 private:
  CLI::Option* option_ = nullptr;
};

/// A program's command line, or that of one of its commands.
class Command {
 public:
  explicit Command(CLI::App* app) : app_(app) {}

  /// T: int, unsigned, std::uint64_t, double, std::string, std::filesystem::path, or a vector of strings, doubles or paths. A name without dashes
  /// is a place on the command line.
  template <class T>
  Option option(const std::string& name, T& value, const std::string& help) const;
  /// "!--name" clears `value`.
  Option flag(const std::string& name, bool& value, const std::string& help) const;
  /// A flag that --help does not show: where it is given, InputError says its new name.
  void renamed_flag(const std::string& name, const std::string& now) const;
  Command command(const std::string& name, const std::string& help) const;
  /// A command that --help does not show, with any arguments: what a name of old is met with.
  Command hidden_command(const std::string& name) const;
  /// From `least` to `most` of its commands are to be given.
  void expect_commands(std::size_t least, std::size_t most) const;

  bool given() const;

 private:
  CLI::App* app_;
};

}  // namespace flappy::io
