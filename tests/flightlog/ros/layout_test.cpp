#include "flightlog/ros/layout.hpp"

#include <gtest/gtest.h>

#include "flightlog/ros/ros_messages.hpp"
#include "flightlog/ros/type_hash.hpp"

namespace flappy::flightlog::ros::layout_test {
namespace {

std::string fault(const std::string& text) {
  Definitions d;
  d.add("p/msg/M", text);
  try {
    d.layout("p/msg/M");
    return "accepted";
  } catch (const MessageError& error) {
    return error.what();
  }
}

TEST(Layout, ReadsMembersPastConstantsDefaultsAndComments) {
  Definitions d;
  d.add("p/msg/M",
        "# a comment = 3\r\n"
        "uint8 STATUS_UNKNOWN=0\n"
        "string NAME = \"a b\"  # and why\n"
        "\n"
        "  float64  gain 2.5   # default\n"
        "string<=10 label \"x = 1 # no comment\"\n"
        "int32[3] triple [1, 2, 3]\n"
        "char[<=4] few\n"
        "float32[] many# close\n");
  const auto layout = d.layout("p/M");
  ASSERT_EQ(layout->fields.size(), 5u);
  const auto& f = layout->fields;
  EXPECT_TRUE(f[0].name == "gain" && f[0].kind == Kind::float64 && f[0].many == Many::one);
  EXPECT_TRUE(f[1].name == "label" && f[1].kind == Kind::string && f[1].string_capacity == 10);
  EXPECT_TRUE(f[2].name == "triple" && f[2].many == Many::array && f[2].capacity == 3);
  EXPECT_TRUE(f[3].name == "few" && f[3].kind == Kind::uint8 && f[3].many == Many::bounded && f[3].capacity == 4);
  EXPECT_TRUE(f[4].name == "many" && f[4].kind == Kind::float32 && f[4].many == Many::unbounded);
}

TEST(Layout, FindsTypesInThePackageAndElsewhere) {
  Definitions d;
  const std::string line(80, '=');
  d.add("p/M", "Header header\nOwn own\nq/Other[] other\nq/msg/Other another\n" + line + "\nMSG: p/Own\nint8 a\n" +
                   line + "\nMSG: q/Other\nint8 b\n" + line + "\nMSG: std_msgs/Header\nuint32 seq\n");
  const auto layout = d.layout("p/msg/M");
  EXPECT_EQ(layout->fields[0].message->name, "std_msgs/msg/Header");
  EXPECT_EQ(layout->fields[1].message->fields[0].name, "a");
  EXPECT_EQ(layout->fields[2].message->name, "q/msg/Other");
  EXPECT_EQ(layout->fields[3].message->fields[0].name, "b");
}

TEST(Layout, IsReadBackFromTheWholeDefinition) {
  for (const std::string& name : standard_messages().names()) {
    Definitions d;
    d.add(name, standard_messages().concatenated(name));
    EXPECT_EQ(type_hash(*d.layout(name)), type_hash(*standard_messages().layout(name))) << name;
  }
}

TEST(Layout, RefusesWhatItCannotRead) {
  EXPECT_EQ(fault("Gone x\n"), "p/msg/Gone has no definition");
  EXPECT_EQ(fault("M again\n"), "p/msg/M contains itself");
  EXPECT_EQ(fault("int8\n"), "\"int8\" is no member");
  EXPECT_EQ(fault("int8] x\n"), "\"int8] x\" has a stray ]");
  EXPECT_EQ(fault("int8[x] y\n"), "\"int8[x] y\" has no size where one is needed");
  EXPECT_EQ(fault("int8<=3 y\n"), "\"int8<=3 y\" bounds what is no string");
  EXPECT_EQ(fault("wstring y\n"), "y is a wstring, which is not read");
  EXPECT_EQ(fault("struct Point { double x; };\n"), "p/msg/struct has no definition");
}

}  // namespace
}  // namespace flappy::flightlog::ros::layout_test
