#include "identify/measured_map.hpp"

#include <gtest/gtest.h>

#include <filesystem>

#include "identify/force_sensor.hpp"
#include "refusal.hpp"
#include "vehicles.hpp"

namespace flappy::identify::measured_map_test {
namespace {

const std::string kHeader =
    "amplitude_V,difference_V,bias_V,split_cycle,force_x_N,force_y_N,force_z_N,torque_x_Nm,torque_y_Nm,torque_z_Nm";
const std::string kSd = ",force_x_sd_N,force_y_sd_N,force_z_sd_N,torque_x_sd_Nm,torque_y_sd_Nm,torque_z_sd_Nm";

MeasuredMap parse(const std::string& text) { return parse_measured_map(text, "m.csv", test::nominal().driver); }
std::string refused(const std::string& text) {
  return test::refusal([&] { parse(text); });
}
std::string replaced(std::string text, const std::string& from, const std::string& to) {
  return text.replace(text.find(from), from.size(), to);
}

TEST(MeasuredMap, ReadsWhatItWrites) {
  const MeasuredMap plain = parse(kHeader + "\n10,1,-2,0.1,1,2,3,4,5,6\n");
  EXPECT_EQ(plain.inputs[0].bias_V, -2);
  EXPECT_EQ(plain.wrenches[0], (Wrench{1, 2, 3, 4, 5, 6}));
  EXPECT_TRUE(plain.sd.empty());
  MeasuredMap full = parse(kHeader + kSd + "\n10,1,-2,0.1,1,2,3,4,5,6,.1,.2,.3,.4,.5,.6\n");
  EXPECT_EQ(full.sd[0], (Wrench{.1, .2, .3, .4, .5, .6}));
  const auto path = std::filesystem::temp_directory_path() / "measured_map_test.csv";
  write_measured_map(path, full);
  const MeasuredMap back = read_measured_map(path, test::nominal().driver);
  EXPECT_EQ(back.wrenches, full.wrenches);
  EXPECT_EQ(back.sd, full.sd);
  EXPECT_EQ(back.inputs[0].split_cycle, 0.1);
  std::filesystem::remove(path);
}

TEST(MeasuredMap, SaysWhatIsWrongAndWhere) {
  const std::string row = "\n10,1,-2,0.1,1,2,3,4,5,6\n", list = replaced(kHeader, ",", ", ");
  EXPECT_EQ(refused(replaced(kHeader, ",torque_z_Nm", "") + "\n10,1,-2,0.1,1,2,3,4,5\n").substr(0, 45),
            "m.csv:1: torque_z_Nm: column is missing; acce");
  EXPECT_EQ(refused(replaced(kHeader, "torque_x_Nm", "torque_x_mNm") + row),
            "m.csv:1: torque_x_mNm: wrong unit mNm, expected Nm; accepted: torque_x_Nm");
  EXPECT_EQ(refused(replaced(kHeader, "torque_x_Nm", "torque_x_Nmm") + row),
            "m.csv:1: torque_x_Nmm: wrong unit Nmm, expected Nm; accepted: torque_x_Nm");
  EXPECT_EQ(refused(replaced(kHeader, "force_z_N", "force_z_gf") + row),
            "m.csv:1: force_z_gf: wrong unit gf, expected N; accepted: force_z_N");
  const std::string none = refused(kHeader + ",force_x_sd\n10,1,-2,0.1,1,2,3,4,5,6,7\n");
  EXPECT_TRUE(none.starts_with("m.csv:1: force_x_sd: unknown column; accepted: ")) << none;
  const std::string unknown = refused(replaced(kHeader, "force_z_N", "force_zz_N") + row);
  EXPECT_TRUE(unknown.starts_with("m.csv:1: force_zz_N: unknown column; accepted: amplitude_V, ")) << unknown;
  EXPECT_TRUE(unknown.ends_with("; did you mean \"force_z_N\"?")) << unknown;
  EXPECT_EQ(refused(kHeader + "\n10,1,-2,0.1,1,2,nan,4,5,6\n"), "m.csv:1: has no rows; accepted: a row for each input");
  EXPECT_EQ(refused(kHeader + "\n10,1,-2,0.1,1,2,3,4,5\n"),
            "m.csv:2:22: row has 9 cells; accepted: 10, as in the header");
  EXPECT_EQ(refused(kHeader + row + "10,1,-4,0.1,1,2,3,4,5,6\n"),
            "m.csv:3: bias_V: -4 is beyond the vehicle's limits; accepted: -3.5 to 3.5");
  EXPECT_EQ(refused(kHeader + "\n-1,1,-2,0.1,1,2,3,4,5,6\n"),
            "m.csv:2: amplitude_V: -1 is beyond the vehicle's limits; accepted: 0 to 18");
  EXPECT_EQ(refused(kHeader + "\n"), "m.csv:1: has no rows; accepted: a row for each input");
  EXPECT_EQ(refused(kHeader + kSd + "\n10,1,-2,0.1,1,2,3,4,5,6,.1,.2,0,.4,.5,.6\n"),
            "m.csv:2: force_z_sd_N: 0 is no standard deviation; accepted: a number above 0");
  EXPECT_EQ(refused(kHeader + ",force_x_sd_N\n10,1,-2,0.1,1,2,3,4,5,6,.1\n").substr(0, 45),
            "m.csv:1: force_y_sd_N: column is missing; acc");
}

// As flappy-gap import reads its tables.
TEST(MeasuredMap, DoesWithoutOtherColumnsAndIncompleteRows) {
  testing::internal::CaptureStderr();
  const MeasuredMap map = parse("note,temperature_C," + kHeader +
                                "\nfirst,20,10,1,-2,0.1,1,2,3,4,5,6\n,,10,1,-2,0.1,1,2,nan,4,5,6\n"
                                ",21,10,1,-2,0.1,1,2,3,4,5,\nlast,nan,11,1,-2,0.1,1,2,3,4,5,7\n");
  const std::string said = testing::internal::GetCapturedStderr();
  ASSERT_EQ(map.size(), 2u);
  EXPECT_EQ(map.line(0), 2u);
  EXPECT_EQ(map.line(1), 5u);
  EXPECT_EQ(map.wrenches[1][5], 7);
  EXPECT_NE(said.find("m.csv: columns that are not read: note, temperature_C\n"), std::string::npos) << said;
  EXPECT_NE(said.find("m.csv: 2 of 4 rows left out; force_z_N is no number in line 3\n"), std::string::npos) << said;
}

TEST(MeasuredMap, HoldsOutEvenly) {
  MeasuredMap map{"m", {}, {}, {}};
  for (int i = 0; i < 10; ++i) map.inputs.push_back({static_cast<double>(i), 0, 0, 0}), map.wrenches.push_back({});
  const MeasuredMap held = hold_out(map, 3);
  EXPECT_EQ(held.size(), 3u);
  EXPECT_EQ(map.size(), 7u);
  EXPECT_EQ(held.inputs[0].amplitude_V, 3);
  EXPECT_EQ(held.inputs[2].amplitude_V, 9);
  EXPECT_EQ(held.line(0), 5u);
  EXPECT_EQ(map.line(6), 10u);
}

TEST(MeasuredMap, NoRowIsBothFittedAndHeldOut) {
  const std::string rows = kHeader + "\n10,0,0,0,1,2,3,4,5,6\n11,0,0,0,1,2,3,4,5,6\n12,0,0,0,1,2,3,4,5,6\n";
  const MeasuredMap fitted = parse(rows);
  const auto refused_beside = [&](const std::string& text) {
    return test::refusal(
        [&] { check_held_out(fitted, parse_measured_map(kHeader + text, "h.csv", test::nominal().driver)); });
  };
  EXPECT_EQ(refused_beside("\n10,0,0,0,1,2,3,4,5,6.1\n9,0,0,0,1,2,3,4,5,6\n"), "accepted");
  EXPECT_EQ(refused_beside("\n9,0,0,0,1,2,3,4,5,6\n12,0,0,0,1,2,3,4,5,6\n"),
            "h.csv:3: is line 4 of m.csv; accepted: measurements that are not fitted");
}

}  // namespace
}  // namespace flappy::identify::measured_map_test
