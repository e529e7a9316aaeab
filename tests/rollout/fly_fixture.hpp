// What the tests of whole flights share.
#pragma once

#include <filesystem>
#include <fstream>
#include <numbers>

#include "rollout/fly_config.hpp"
#include "vehicles.hpp"

namespace flappy::flight {

namespace fs = std::filesystem;
using test::source_path;
inline constexpr double kPi = std::numbers::pi;

/// Gone at the end of its test.
class Folder {
 public:
  Folder() : path_(fs::temp_directory_path() / ("fly_test_" + std::to_string(++count_))) {
    fs::create_directories(path_);
  }
  ~Folder() { fs::remove_all(path_); }
  fs::path operator/(const std::string& name) const { return path_ / name; }
  std::string write(const std::string& name, const std::string& text) const {
    std::ofstream(path_ / name) << text;
    return (path_ / name).string();
  }

 private:
  static inline int count_ = 0;
  fs::path path_;
};

inline const std::string kHover = source_path("configs/fly/hover.toml");

inline std::string message(const auto& action) {
  try {
    action();
    return "accepted";
  } catch (const io::InputError& e) {
    return e.what();
  }
}
inline std::string refusal(const std::vector<std::string>& overrides, const std::string& path = kHover) {
  return message([&] { rollout::read_fly_config(path, overrides); });
}

}  // namespace flappy::flight
