#include "flightlog/import/channels.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace flappy::flightlog::channels_test {
namespace {

using Values = std::vector<double>;

TEST(Channels, KeepRowsWhoseFieldsComeAndGo) {
  Channels channels;
  channels.add("/a", 1, 2, {{"x", 1}, {"y", 2}});
  channels.add("/a", 3, kNoTime, {{"y", 4}, {"z", 5}});
  channels.add("/a", 5, 6, {{"x", 7}});
  const Channel& a = *channels.find("/a");
  EXPECT_EQ(a.received_ns(), (std::vector<std::int64_t>{1, 3, 5}));
  EXPECT_EQ(a.stamp_ns(), (std::vector<std::int64_t>{2, kNoTime, 6}));
  const Values& x = *a.column("x");
  EXPECT_TRUE(x[0] == 1 && std::isnan(x[1]) && x[2] == 7);
  const Values& y = *a.column("y");
  EXPECT_TRUE(y[0] == 2 && y[1] == 4 && std::isnan(y[2]));
  const Values& z = *a.column("z");
  EXPECT_TRUE(std::isnan(z[0]) && z[1] == 5 && std::isnan(z[2]));
}

TEST(Channels, KeepWhatIsWanted) {
  Channels channels(Wanted{{"/a", {"x"}}, {"b", {"y"}}});
  channels.add("/a", 1, 1, {{"x", 1}, {"y", 2}});
  channels.add("/other", 1, 1, {{"x", 1}});
  channels.add("b[0]", 1, 1, {{"x", 1}, {"y", 2}});
  EXPECT_EQ(*channels.find("/a")->column("x"), Values{1});
  EXPECT_EQ(channels.find("/a")->column("y"), nullptr);
  EXPECT_EQ(channels.find("/a")->fields(), (std::vector<std::string>{"x", "y"}));
  EXPECT_EQ(channels.find("/other"), nullptr);
  EXPECT_EQ(*channels.find("b")->column("y"), Values{2});
}

TEST(Channels, TakeNoTimeThatHasNoDifferences) {
  Channels channels;
  channels.add("/a", INT64_MAX, INT64_MIN + 1, {{"x", 1}});
  EXPECT_EQ(channels.find("/a")->received_ns()[0], kNoTime);
  EXPECT_EQ(channels.find("/a")->stamp_ns()[0], kNoTime);
}

}  // namespace
}  // namespace flappy::flightlog::channels_test
