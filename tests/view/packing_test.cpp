// That a page finds the numbers again that were packed.
#include "view/packing.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <numeric>
#include <stdexcept>

namespace flappy::view {
namespace {

TEST(Base64, IsThatOfRfc4648) {
  EXPECT_EQ(base64(""), "");
  EXPECT_EQ(base64("f"), "Zg==");
  EXPECT_EQ(base64("fo"), "Zm8=");
  EXPECT_EQ(base64("foo"), "Zm9v");
  EXPECT_EQ(base64("foob"), "Zm9vYg==");
  EXPECT_EQ(base64("foobar"), "Zm9vYmFy");
  EXPECT_EQ(base64("\xff\xfe\xfd"), "//79");
}

TEST(Packing, SaysWhereColumnsLie) {
  Packing packing;
  const std::vector<double> first = {0, 0.1, 0.2}, second = {-1, 1000, -1000};
  EXPECT_EQ(packing.add(first, 0.1).dump(), R"({"at":0,"count":3,"step":0.1})");
  // differences 0, 1, 1 take a byte each; -100, 100100, -200000 take two, three and three
  EXPECT_EQ(packing.add(second, 0.01).dump(), R"({"at":3,"count":3,"step":0.01})");
  EXPECT_EQ(packing.add({}, 1).dump(), R"({"at":11,"count":0,"step":1.0})");
}

TEST(Packing, HasATextThatJavaScriptReads) {
  Packing packing;
  packing.add(std::vector{0.0, 0.1, 0.2}, 0.1);
  packing.add(std::vector{-1.0, 1000.0, -1000.0}, 0.01);
  EXPECT_EQ(packing.text(), "eJxjYGI6ztgxh+f/FgkAEVkDyA==");  // web_test.mjs reads the same
}

TEST(Packing, RefusesWhatIsNoNumber) {
  Packing packing;
  for (const double bad : {std::nan(""), static_cast<double>(INFINITY), 1e16})
    EXPECT_THROW(packing.add(std::vector{bad}, 1), std::invalid_argument);
}

TEST(Packing, LeavesLessThanAByteOfARegularClock) {
  std::vector<double> t_s(10'000);
  for (std::size_t i = 0; i < t_s.size(); ++i) t_s[i] = 0.002 * static_cast<double>(i);
  Packing packing;
  packing.add(t_s, 1e-6);
  EXPECT_LT(packing.text().size(), 1000u);
}

}  // namespace
}  // namespace flappy::view
