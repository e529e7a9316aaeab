// That vehicles are drawn as their files have them, everywhere the same.
#include "view/shape.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "flappy/vehicle_file.hpp"
#include "view/page_files.hpp"

namespace flappy::view {
namespace {

using Json = nlohmann::ordered_json;

model::Vehicle shipped(const std::string& name) {
  return model::read_any_vehicle(FLAPPY_SOURCE_DIR "/configs/vehicles/" + name);
}

TEST(Shape, HasTheMomentsOfThePlanform) {
  const model::Planform p = shipped("hummingbird_nominal.toml").left.planform;
  constexpr int kCount = 2000;
  double moments[3] = {};
  for (int k = 0; k < kCount; ++k)
    for (int order = 0; order < 3; ++order) {
      const double share = (k + 0.5) / kCount;
      moments[order] += std::pow(share, order) * chord_at(p, share) / kCount;
    }
  EXPECT_NEAR(moments[0], p.r00, 1e-6);
  EXPECT_NEAR(moments[1], p.r11, 1e-6);
  EXPECT_NEAR(moments[2], p.r22, 1e-6);
  EXPECT_NEAR(chord_at(p, 0.25), 1.1461, 1e-3);  // its wing tapers straight
  const Json wing = shape_of(shipped("hummingbird_nominal.toml")).at("left");
  EXPECT_EQ(wing.at("outline_m").back(), Json({0.07, 0.0}));
}

TEST(Shape, GrowsWithTheWings) {
  model::Vehicle v = shipped("hummingbird_nominal.toml");
  v.left.planform.wing_length_m = v.right.planform.wing_length_m = 0.14;
  const Json shape = shape_of(v);
  EXPECT_EQ(shape.at("profile_m").back(), Json({0.075, 0.0}));
  EXPECT_EQ(shape.at("right").at("outline_m").back(), Json({0.14, 0.0}));
}

/// Numbers of both to 1e-9; the rest to the letter.
void expect_same(const Json& a, const Json& b, const std::string& at) {
  if (a.is_number()) {
    EXPECT_NEAR(a.get<double>(), b.get<double>(), 1e-9) << at;
  } else if (a.is_structured()) {
    ASSERT_EQ(a.size(), b.size()) << at;
    for (const auto& [key, value] : a.items())
      expect_same(value, b.is_array() ? b.at(std::stoul(key)) : b.at(key), at + "/" + key);
  } else {
    EXPECT_EQ(a, b) << at;
  }
}

TEST(Shape, IsTheOneThatPagesKnowByThemselves) {
  const std::string_view text = kPageFiles.at("geometry.js");
  const std::string_view name = "kHummingbird = ";
  const std::size_t from = text.find(name) + name.size();
  expect_same(shape_of(shipped("hummingbird_nominal.toml")),
              Json::parse(text.substr(from, text.find(';', from) - from)), "");
}

}  // namespace
}  // namespace flappy::view
