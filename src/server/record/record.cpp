#include "server/record/record.hpp"

#include <dds/ddsi/ddsi_serdata.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <optional>
#include <set>

#include "flightlog/ros/mcap.hpp"
#include "flightlog/ros/ros_messages.hpp"
#include "flightlog/ros/type_hash.hpp"
#include "io/log.hpp"
#include "io/progress.hpp"
#include "server/dds/participant.hpp"

namespace flappy::server {
namespace {

namespace fs = std::filesystem;
using namespace flightlog;

constexpr Quality kAll{false, false, 1000};  // best effort matches any writer; 1000 samples are kept between two looks
constexpr std::chrono::milliseconds kBetweenLooks{10};

/// The descriptor of the type `dds_name` if it is one of M; null otherwise.
template <class... M>
const dds_topic_descriptor_t* type_named(const std::string& dds_name) {
  const dds_topic_descriptor_t* found = nullptr;
  ((dds_name == descriptor<M>().m_typename ? void(found = &descriptor<M>()) : void()), ...);
  return found;
}

std::int64_t now_ns() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(std::chrono::system_clock::now().time_since_epoch())
      .count();
}

class Recording {
 public:
  Recording(const io::DdsConfig& dds, const Mapping& mapping, const RecordOptions& options)
      : options_(options),
        participant_(dds),
        waiting_(participant_),
        writers_(dds_create_reader(participant_.get(), DDS_BUILTIN_TOPIC_DCPSPUBLICATION, nullptr, nullptr),
                 "discovery"),
        file_(mcap_of(options.out)) {
    for (const auto& [channel, fields] : mapping.wanted()) wanted_.insert(channel);
  }

  Recorded run() {
    const double started_s = io::steady_seconds();
    double asked_s = started_s;
    for (;;) {
      find_topics();
      waiting_.wait(kBetweenLooks);
      for (Topic& topic : topics_) take(topic);
      const double now_s = io::steady_seconds();
      if (options_.duration_s > 0 && now_s - started_s >= options_.duration_s) break;
      if (now_s - asked_s < 0.1) continue;
      asked_s = now_s;
      if (options_.keep_going && !options_.keep_going(recorded_.messages)) break;
    }
    file_.finish();
    recorded_.mcap = mcap_of(options_.out);
    return recorded_;
  }

  static fs::path mcap_of(fs::path out) { return out += ".mcap"; }

 private:
  struct Topic {
    std::string name;
    Entity reader;
    std::uint16_t number;
  };

  /// Starts to read each wanted topic once a writer of it is discovered.
  void find_topics() {
    detail::take(writers_, [&](const void* sample, const dds_sample_info_t&) {
      const auto& w = *static_cast<const dds_builtintopic_endpoint_t*>(sample);
      const std::string topic = w.topic_name, type = w.type_name;
      if (!topic.starts_with("rt/") || wanted_.erase(topic.substr(2)) == 0) return;
      try {
        add(topic.substr(2), type);
      } catch (const io::InputError& e) {  // a topic that appears late does not end the recording
        if (std::ranges::all_of(recorded_.messages, [](const auto& m) { return m.second == 0; })) throw;
        io::log(io::LogLevel::warning, std::string(e.what()) + "; it is left out");
      }
    });
  }

  void add(const std::string& name, const std::string& type) {
    const dds_topic_descriptor_t* known =
        type_named<PoseStamped, Imu, JointState, BatteryState, TFMessage, WingInput>(type);
    if (known == nullptr)
      throw io::InputError(
          name + ": is a " + ros_name(type) +
          "; accepted: geometry_msgs/msg/PoseStamped, sensor_msgs/msg/Imu, JointState or BatteryState, "
          "tf2_msgs/msg/TFMessage, flappy_msgs/msg/WingInput; record others with ros2 bag and import them");
    const std::string ros = ros_name(type);
    const ros::Definitions& all = ros::standard_messages();
    const auto number = file_.add_topic(name, ros, all.concatenated(ros), ros::type_hash(*all.layout(ros)));
    topics_.push_back({name, detail::make_reader(participant_, *known, name, kAll), number});
    waiting_.add(topics_.back().reader);
    recorded_.messages[name] = 0;
  }

  /// Writes the messages that have arrived to the file, as they were on the wire.
  void take(const Topic& topic) {
    constexpr std::size_t kAtOnce = 64;
    std::array<ddsi_serdata*, kAtOnce> samples{};
    std::array<dds_sample_info_t, kAtOnce> info;
    for (int count; (count = dds_takecdr(topic.reader.get(), samples.data(), kAtOnce, info.data(), DDS_ANY_STATE)) > 0;)
      for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i) {
        if (info[i].valid_data) keep(topic, *samples[i], info[i].source_timestamp);
        ddsi_serdata_unref(samples[i]);
      }
  }

  void keep(const Topic& topic, ddsi_serdata& sample, std::int64_t sent_ns) {
    const std::size_t size = ddsi_serdata_size(&sample);
    if (size > kMaxBytes) return void(++recorded_.refused);
    std::string bytes(size, '\0');
    ddsi_serdata_to_ser(&sample, 0, size, bytes.data());
    file_.write(topic.number, now_ns(), sent_ns, bytes);
    ++recorded_.messages[topic.name];
  }

  const RecordOptions& options_;
  Participant participant_;
  WaitSet waiting_;
  Entity writers_;
  std::set<std::string> wanted_;  // topics that had no writer yet
  std::vector<Topic> topics_;
  ros::McapWriter file_;
  Recorded recorded_;
};

}  // namespace

Recorded record(const io::DdsConfig& dds, const Mapping& mapping, const RecordOptions& options) {
  if (options.out.has_parent_path()) io::make_folder(options.out.parent_path());
  if (const fs::path mcap = Recording::mcap_of(options.out); fs::exists(mcap))
    throw io::InputError(mcap.string() +
                         ": exists, and a flight cannot be recorded twice; accepted: a name that is not in use");
  Recorded recorded = Recording(dds, mapping, options).run();
  try {
    recorded.report = import_recording({recorded.mcap}, mapping, options.out).report;
  } catch (const io::InputError& error) {
    throw io::InputError(std::string(error.what()) + "; the messages are in " + recorded.mcap.string());
  }
  return recorded;
}

}  // namespace flappy::server
