// Cyclone DDS as ROS 2 uses it: names, quality of service, type hashes. Failures of network or keys: InputError.
#pragma once

#include <dds/dds.h>

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "io/dds_config.hpp"
#include "server/dds/messages.hpp"

namespace flappy::server {

/// Quality of service of a topic, chosen so that ROS 2's usual subscriptions of such a topic match.
struct Quality {
  bool reliable, kept;  ///< kept: readers that join late get the last `depth` messages
  int depth;            ///< kAllOfIt: nothing is dropped, and a writer waits for slow readers
};
inline constexpr int kAllOfIt = 0;
inline constexpr Quality kSensorData{false, false, 5}, kReliable{true, false, 10}, kLatched{true, true, 1};
/// For commands, their results and files: server and client use the same quality.
inline constexpr Quality kAnswers{true, false, 1000}, kPieces{true, false, kAllOfIt};

std::string topic_name(const std::string& name_space, std::size_t slot, const std::string& name);  ///< "/flappy_3/pose"

/// Cyclone DDS's XML configuration of interfaces and peers; empty where the environment configures it.
std::string cyclone_xml(const io::DdsConfig& config);

/// Owns an entity of Cyclone DDS; deletes it together with the entities that it contains.
class Entity {
 public:
  Entity() = default;
  /// Throws InputError "dds: what: reason" where `handle` is an error code.
  Entity(dds_entity_t handle, const std::string& what);
  ~Entity();
  Entity(Entity&& other) noexcept : handle_(std::exchange(other.handle_, 0)) {}
  Entity& operator=(Entity&& other) noexcept {
    std::swap(handle_, other.handle_);
    return *this;
  }
  dds_entity_t get() const { return handle_; }

 private:
  dds_entity_t handle_ = 0;
};

/// This process as a participant of a DDS domain. It must outlive its writers and readers.
class Participant {
 public:
  explicit Participant(const io::DdsConfig& config);
  dds_entity_t get() const { return participant_.get(); }

 private:
  std::shared_ptr<const Entity> domain_;  // shared by all participants of this process in that domain
  Entity participant_;
};

namespace detail {
/// `name` is the ROS 2 name, such as "/flappy/pose".
Entity make_writer(const Participant&, const dds_topic_descriptor_t&, const std::string& name, const Quality&);
Entity make_reader(const Participant&, const dds_topic_descriptor_t&, const std::string& name, const Quality&);
bool write(const Entity&, const void* message);
std::size_t matched(const Entity&, bool writer);
bool reaches(const Entity& writer, const std::string& participant);
/// Takes all messages that have arrived, oldest first; returns their number.
std::size_t take(const Entity&, const std::function<void(const void*, const dds_sample_info_t&)>& see);
}  // namespace detail

/// Identifies the participant that wrote a message, by its DDS key in hexadecimal; empty where it is gone.
std::string writer_of(const Entity& reader, const dds_sample_info_t& info);

template <class M>
class Writer {
 public:
  Writer(const Participant& p, const std::string& name, const Quality& quality)
      : writer_(detail::make_writer(p, descriptor<M>(), name, quality)) {}
  /// Copies the message and what it points to. Returns false where it could not be handed over within 0.1 s.
  bool write(const M& message) const { return detail::write(writer_, &message); }
  std::size_t readers() const { return detail::matched(writer_, true); }
  /// Whether a reader of that participant (writer_of()) is matched, and so gets what is written from now on; of an unknown
  /// one, whether any is. A command arrives as soon as its own writer is matched, which may be before that.
  bool reaches(const std::string& participant) const { return detail::reaches(writer_, participant); }
  const Entity& entity() const { return writer_; }

 private:
  Entity writer_;
};

template <class M>
class Reader {
 public:
  Reader(const Participant& p, const std::string& name, const Quality& quality)
      : reader_(detail::make_reader(p, descriptor<M>(), name, quality)) {}
  /// Calls `see(message, info)`, which must copy what it keeps, for each message that has arrived; returns how many.
  std::size_t take(const auto& see) const {
    return detail::take(reader_, [&](const void* m, const dds_sample_info_t& i) { see(*static_cast<const M*>(m), i); });
  }
  std::size_t writers() const { return detail::matched(reader_, false); }
  const Entity& entity() const { return reader_; }

 private:
  Entity reader_;
};

/// Waits until one of several readers has a message to take.
class WaitSet {
 public:
  explicit WaitSet(const Participant& p);
  void add(const Entity& reader);
  bool wait(std::chrono::nanoseconds at_most) const;  ///< false: none arrived

 private:
  Entity set_;
  std::vector<Entity> conditions_;
};

}  // namespace flappy::server
