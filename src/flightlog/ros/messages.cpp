#include "flightlog/ros/ros_messages.hpp"

namespace flappy::flightlog::ros {
namespace {

struct Text {
  const char *name, *members;
};

constexpr Text kTexts[] = {
    {"builtin_interfaces/msg/Time", "int32 sec\nuint32 nanosec\n"},
    {"builtin_interfaces/msg/Duration", "int32 sec\nuint32 nanosec\n"},
    {"std_msgs/msg/Header", "builtin_interfaces/Time stamp\nstring frame_id\n"},
    {"std_msgs/msg/MultiArrayDimension", "string label\nuint32 size\nuint32 stride\n"},
    {"std_msgs/msg/MultiArrayLayout", "MultiArrayDimension[] dim\nuint32 data_offset\n"},
    {"std_msgs/msg/Float64MultiArray", "MultiArrayLayout layout\nfloat64[] data\n"},
    {"geometry_msgs/msg/Point", "float64 x\nfloat64 y\nfloat64 z\n"},
    {"geometry_msgs/msg/Vector3", "float64 x\nfloat64 y\nfloat64 z\n"},
    {"geometry_msgs/msg/Quaternion", "float64 x 0\nfloat64 y 0\nfloat64 z 0\nfloat64 w 1\n"},
    {"geometry_msgs/msg/Pose", "Point position\nQuaternion orientation\n"},
    {"geometry_msgs/msg/PoseStamped", "std_msgs/Header header\nPose pose\n"},
    {"geometry_msgs/msg/PoseWithCovariance", "Pose pose\nfloat64[36] covariance\n"},
    {"geometry_msgs/msg/Twist", "Vector3 linear\nVector3 angular\n"},
    {"geometry_msgs/msg/Accel", "Vector3 linear\nVector3 angular\n"},
    {"geometry_msgs/msg/AccelStamped", "std_msgs/Header header\nAccel accel\n"},
    {"geometry_msgs/msg/TwistWithCovariance", "Twist twist\nfloat64[36] covariance\n"},
    {"geometry_msgs/msg/Transform", "Vector3 translation\nQuaternion rotation\n"},
    {"geometry_msgs/msg/TransformStamped", "std_msgs/Header header\nstring child_frame_id\nTransform transform\n"},
    {"nav_msgs/msg/Odometry",
     "std_msgs/Header header\nstring child_frame_id\ngeometry_msgs/PoseWithCovariance pose\n"
     "geometry_msgs/TwistWithCovariance twist\n"},
    {"sensor_msgs/msg/Imu",
     "std_msgs/Header header\ngeometry_msgs/Quaternion orientation\nfloat64[9] orientation_covariance\n"
     "geometry_msgs/Vector3 angular_velocity\nfloat64[9] angular_velocity_covariance\n"
     "geometry_msgs/Vector3 linear_acceleration\nfloat64[9] linear_acceleration_covariance\n"},
    {"sensor_msgs/msg/JointState",
     "std_msgs/Header header\nstring[] name\nfloat64[] position\nfloat64[] velocity\nfloat64[] effort\n"},
    {"sensor_msgs/msg/BatteryState",
     "std_msgs/Header header\nfloat32 voltage\nfloat32 temperature\nfloat32 current\nfloat32 charge\nfloat32 capacity\n"
     "float32 design_capacity\nfloat32 percentage\nuint8 power_supply_status\nuint8 power_supply_health\n"
     "uint8 power_supply_technology\nbool present\nfloat32[] cell_voltage\nfloat32[] cell_temperature\n"
     "string location\nstring serial_number\n"},
    {"tf2_msgs/msg/TFMessage", "geometry_msgs/TransformStamped[] transforms\n"},
    {"rosgraph_msgs/msg/Clock", "builtin_interfaces/Time clock\n"},
    {"diagnostic_msgs/msg/KeyValue", "string key\nstring value\n"},
    {"diagnostic_msgs/msg/DiagnosticStatus",
     "byte level\nstring name\nstring message\nstring hardware_id\nKeyValue[] values\n"},
    {"diagnostic_msgs/msg/DiagnosticArray", "std_msgs/Header header\nDiagnosticStatus[] status\n"},
    {"flappy_msgs/msg/WingInput",
     "std_msgs/Header header\nuint64 tick\nfloat64 amplitude_v\nfloat64 difference_v\nfloat64 bias_v\n"
     "float64 split_cycle\nfloat64 left_voltage_v\nfloat64 right_voltage_v\nfloat64 phase_rad\n"},
    {"flappy_msgs/msg/WingLoads",
     "std_msgs/Header header\ngeometry_msgs/Vector3 left_force_n\ngeometry_msgs/Vector3 left_moment_nm\n"
     "float64 left_lift_n\nfloat64 left_drag_n\nfloat64 left_aerodynamic_power_w\nfloat64 left_mechanical_power_w\n"
     "geometry_msgs/Vector3 right_force_n\ngeometry_msgs/Vector3 right_moment_nm\n"
     "float64 right_lift_n\nfloat64 right_drag_n\nfloat64 right_aerodynamic_power_w\n"
     "float64 right_mechanical_power_w\n"},
    {"flappy_msgs/msg/Tick",
     "builtin_interfaces/Time stamp\nbuiltin_interfaces/Time until\nuint64 tick\nuint32 imu\nuint32 poses\nuint8 "
     "wish\n"},
    {"flappy_msgs/msg/TrainingMetrics",
     "std_msgs/Header header\nstring run\nuint64 update\nuint64 updates\nuint64 episodes\nuint64 env_steps\n"
     "float64 mean_return\nfloat64 success\nfloat64 updates_per_s\nfloat64 env_steps_per_s\n"},
    {"flappy_msgs/msg/JobStatus",
     "std_msgs/Header header\nuint64 id\nstring<=64 kind\nstring<=256 config\nstring<=16 state\nuint32 attempts\n"
     "int32 exit_code\nfloat64 progress\nstring<=1024 message\nstring<=256 folder\n"},
    {"flappy_msgs/msg/Watch", "uint32 flapper\n"},
    {"flappy_msgs/msg/Command",
     "builtin_interfaces/Time stamp\nstring<=64 id\nstring<=16 verb\nstring<=64 kind\nstring<=256 config\nuint64 job\n"
     "string<=256[<=32] overrides\n"},
    {"flappy_msgs/msg/FileChunk",
     "string<=64 id\nuint64 job\nstring<=1024 name\nuint64 size\nuint64 offset\nuint32 left\nuint8[<=65536] data\n"},
    {"flappy_msgs/msg/CommandResult", "string<=64 id\nbool accepted\nuint64 job\nstring<=1024 message\n"},
};

}  // namespace

const Definitions& standard_messages() {
  static const Definitions all = [] {
    Definitions d;
    for (const Text& text : kTexts) d.add(text.name, text.members);
    return d;
  }();
  return all;
}

}  // namespace flappy::flightlog::ros
