#include "flightlog/ros/type_hash.hpp"

#include <gtest/gtest.h>

#include "flightlog/ros/ros_messages.hpp"
#include "io/files.hpp"

namespace flappy::flightlog::ros {
namespace {

struct Known {
  const char *type, *hash;
};

/// Those of ROS 2 as Humble and Jazzy have them; all by the Python package rosbags 0.11.9.
constexpr Known kKnown[] = {
    {"builtin_interfaces/msg/Time", "RIHS01_b106235e25a4c5ed35098aa0a61a3ee9c9b18d197f398b0e4206cea9acf9c197"},
    {"builtin_interfaces/msg/Duration", "RIHS01_e8d009f659816f758b75334ee1a9ca5b5c0b859843261f14c7f937349599d93b"},
    {"std_msgs/msg/Header", "RIHS01_f49fb3ae2cf070f793645ff749683ac6b06203e41c891e17701b1cb597ce6a01"},
    {"std_msgs/msg/MultiArrayDimension", "RIHS01_5e773a60a4c7fc8a54985f307c7837aa2994252a126c301957a24e31282c9cbe"},
    {"std_msgs/msg/MultiArrayLayout", "RIHS01_4c66e6f78e740ac103a94cf63259f968e48c617e7699e829b63c21a5cb50dac6"},
    {"std_msgs/msg/Float64MultiArray", "RIHS01_1025ddc6b9552d191f89ef1a8d2f60f3d373e28b283d8891ddcc974e8c55397f"},
    {"geometry_msgs/msg/Point", "RIHS01_6963084842a9b04494d6b2941d11444708d892da2f4b09843b9c43f42a7f6881"},
    {"geometry_msgs/msg/Vector3", "RIHS01_cc12fe83e4c02719f1ce8070bfd14aecd40f75a96696a67a2a1f37f7dbb0765d"},
    {"geometry_msgs/msg/Quaternion", "RIHS01_8a765f66778c8ff7c8ab94afcc590a2ed5325a1d9a076ffff38fbce36f458684"},
    {"geometry_msgs/msg/Pose", "RIHS01_d501954e9476cea2996984e812054b68026ae0bfae789d9a10b23daf35cc90fa"},
    {"geometry_msgs/msg/PoseStamped", "RIHS01_10f3786d7d40fd2b54367835614bff85d4ad3b5dab62bf8bca0cc232d73b4cd8"},
    {"geometry_msgs/msg/PoseWithCovariance", "RIHS01_9a7c0fd234b7f45c6098745ecccd773ca1085670e64107135397aee31c02e1bb"},
    {"geometry_msgs/msg/Accel", "RIHS01_dc448243ded9b1fcbcca24aba0c22f013dae06c354ba2d849571c0a2a3f57ca0"},
    {"geometry_msgs/msg/AccelStamped", "RIHS01_ef1df9eabae0a708cc049a061ebcddc4e2a5f745730100ba680e086a9698b165"},
    {"geometry_msgs/msg/Twist", "RIHS01_9c45bf16fe0983d80e3cfe750d6835843d265a9a6c46bd2e609fcddde6fb8d2a"},
    {"geometry_msgs/msg/TwistWithCovariance",
     "RIHS01_49f574f033f095d8b6cd1beaca5ca7925e296e84af1716d16c89d38b059c8c18"},
    {"geometry_msgs/msg/Transform", "RIHS01_beb83fbe698636351461f6f35d1abb20010c43d55374d81bd041f1ba2581fddc"},
    {"geometry_msgs/msg/TransformStamped", "RIHS01_0a241f87d04668d94099cbb5ba11691d5ad32c2f29682e4eb5653424bd275206"},
    {"nav_msgs/msg/Odometry", "RIHS01_3cc97dc7fb7502f8714462c526d369e35b603cfc34d946e3f2eda2766dfec6e0"},
    {"sensor_msgs/msg/Imu", "RIHS01_7d9a00ff131080897a5ec7e26e315954b8eae3353c3f995c55faf71574000b5b"},
    {"sensor_msgs/msg/JointState", "RIHS01_a13ee3a330e346c9d87b5aa18d24e11690752bd33a0350f11c5882bc9179260e"},
    {"sensor_msgs/msg/BatteryState", "RIHS01_4bee5dfce981c98faa6828b868307a0a73f992ed0789f374ee96c8f840e69741"},
    {"tf2_msgs/msg/TFMessage", "RIHS01_e369d0f05a23ae52508854b66f6aa0437f3449d652e8cbf22d5abe85d020f087"},
    {"rosgraph_msgs/msg/Clock", "RIHS01_692f7a66e93a3c83e71765d033b60349ba68023a8c689a79e48078bcb5c58564"},
    {"diagnostic_msgs/msg/KeyValue", "RIHS01_d68081eaa540288c5440753baecef0c4e16e81a5f78ad68902ded5100413bb42"},
    {"diagnostic_msgs/msg/DiagnosticStatus", "RIHS01_b0e3e692ea2d54a8af2f4ef1930e81556a2db55216b771f8a7d2724ed47bf0e4"},
    {"diagnostic_msgs/msg/DiagnosticArray", "RIHS01_5a8a36efb05fb25070fa0fb3810290c0e6cd4862b54a8fb975a1ee8dc55a333e"},
    {"flappy_msgs/msg/WingInput", "RIHS01_76ec0876742ebe870164ee1988ae6d520858db186866214c9920e0688c83ae39"},
    {"flappy_msgs/msg/WingLoads", "RIHS01_328727bed8fdb3067d2b00af678400425bec14888d6258916f8b906f294cbe90"},
    {"flappy_msgs/msg/Tick", "RIHS01_4e640bc98920a6e7f6d279cb27c32cb3e0faf853545a3b37e553adc089a065b1"},
    {"flappy_msgs/msg/FileChunk", "RIHS01_75dbe1f2d05377189803ca776ab72fcd0ef6fc91808f63f6569b02ff9f2fb2f2"},
    {"flappy_msgs/msg/TrainingMetrics", "RIHS01_7a3128f71c52a18cc588ac1c5f045f6d78e765ba7922698ced1893a1195c9785"},
    {"flappy_msgs/msg/JobStatus", "RIHS01_1fe92e02681ffc894d92924649633287afb4b4bfdaa1a16a8432c92aebfff09d"},
    {"flappy_msgs/msg/Watch", "RIHS01_dce66d00161926bcdc4ab102153afc2cd164084483aa7b1ef7e64e185de9a1e0"},
    {"flappy_msgs/msg/Command", "RIHS01_952ce31af573884834ccbd89e1ec3bd1515bc44a7adc098135ec563ca98321e3"},
    {"flappy_msgs/msg/CommandResult", "RIHS01_5954a0fc60d1337acc823ebef7017540717b426c2a8c1a69ddf7dd90786a80d9"},
};

TEST(TypeHash, IsThatOfRos2) {
  for (const Known& known : kKnown)
    EXPECT_EQ(type_hash(*standard_messages().layout(known.type)), known.hash) << known.type;
}

TEST(TypeHash, IsKnownOfAllMessages) { EXPECT_EQ(standard_messages().names().size(), std::size(kKnown)); }

/// What a ROS 2 machine builds from, beside what is compiled in here.
TEST(TypeHash, IsThatOfThePackageForRos2) {
  std::size_t count = 0;
  for (const auto& entry : std::filesystem::directory_iterator(FLAPPY_SOURCE_DIR "/examples/ros2/flappy_msgs/msg")) {
    const std::string stem = entry.path().stem(), type = "flappy_msgs/msg/" + stem;
    Definitions fresh;
    fresh.add(type, io::read_text(entry.path()));
    for (const char* other : {"std_msgs/msg/Header", "builtin_interfaces/msg/Time", "geometry_msgs/msg/Vector3"})
      fresh.add(other, standard_messages().concatenated(other));
    EXPECT_EQ(type_hash(*fresh.layout(type)), type_hash(*standard_messages().layout(type))) << type;
    ++count;
  }
  EXPECT_EQ(count, 9U);
}

TEST(TypeHash, IsOfJsonWithSpacesAndTypesByName) {
  Definitions d;
  d.add("p/msg/Both", "Later b\nEmpty[2] a\nstring<=5[<=3] words\nbyte[] raw\n");
  d.add("p/msg/Later", "bool on\n");
  d.add("p/msg/Empty", "# nothing\n");
  EXPECT_EQ(
      type_description(*d.layout("p/Both")),
      R"({"type_description": {"type_name": "p/msg/Both", "fields": [)"
      R"({"name": "b", "type": {"type_id": 1, "capacity": 0, "string_capacity": 0, "nested_type_name": "p/msg/Later"}}, )"
      R"({"name": "a", "type": {"type_id": 49, "capacity": 2, "string_capacity": 0, "nested_type_name": "p/msg/Empty"}}, )"
      R"({"name": "words", "type": {"type_id": 117, "capacity": 3, "string_capacity": 5, "nested_type_name": ""}}, )"
      R"({"name": "raw", "type": {"type_id": 160, "capacity": 0, "string_capacity": 0, "nested_type_name": ""}}]}, )"
      R"("referenced_type_descriptions": [{"type_name": "p/msg/Empty", "fields": [)"
      R"({"name": "structure_needs_at_least_one_member", "type": {"type_id": 3, "capacity": 0, "string_capacity": 0, )"
      R"("nested_type_name": ""}}]}, {"type_name": "p/msg/Later", "fields": [)"
      R"({"name": "on", "type": {"type_id": 15, "capacity": 0, "string_capacity": 0, "nested_type_name": ""}}]}]})");
}

}  // namespace
}  // namespace flappy::flightlog::ros
