// Options and commands of a program. Hides CLI11, whose templates take seconds to compile in every file.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace CLI {
class App;
class Option;
}  // namespace CLI

namespace flappy::io {

/// An option. Its functions add conditions or display settings and return the option itself.
class Option {
 public:
  Option() = default;
  explicit Option(CLI::Option* option) : option_(option) {}

  Option required() const;
  Option range(int low, int high) const;
  Option range(std::uint64_t low, std::uint64_t high) const;
  Option range(double low, double high) const;
  Option one_of(const std::vector<std::string>& accepted) const;
  /// Shows the variable's present value as the default in --help.
  Option shows_default() const;
  Option needs(Option other) const;
  Option excludes(Option other) const;
  /// For a list: the option takes one value each time it is given, so that words after it go to other options.
  Option one_at_a_time() const;
  Option separated_by(char separator) const;

  bool given() const;

 private:
  CLI::Option* option_ = nullptr;
};

/// The command line of a program or of one of its commands.
class Command {
 public:
  explicit Command(CLI::App* app) : app_(app) {}

  /// T: int, unsigned, uint64_t, double, string, path, vector of strings, doubles or paths. No dashes: positional.
  template <class T>
  Option option(const std::string& name, T& value, const std::string& help) const;
  Option flag(const std::string& name, bool& value, const std::string& help) const;  ///< "!--name" sets false
  Command command(const std::string& name, const std::string& help) const;
  void expect_commands(std::size_t least, std::size_t most) const;

  bool given() const;

 private:
  CLI::App* app_;
};

}  // namespace flappy::io
