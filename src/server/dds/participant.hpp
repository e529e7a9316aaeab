// Cyclone DDS as ROS 2 uses it: names, quality of service, type hashes. What fails here is the user's network or keys: InputError.
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

/// As ROS 2 expects of a topic: what its subscriptions of that kind match.
struct Quality {
  bool reliable, kept;  ///< kept: late joiners get the last `depth`
  int depth;            ///< kAllOfIt: nothing is dropped, and a writer waits for who is slow
};
inline constexpr int kAllOfIt = 0;
inline constexpr Quality kSensorData{false, false, 5}, kReliable{true, false, 10}, kLatched{true, true, 1};
/// What both ends of a conversation offer and ask for.
inline constexpr Quality kAnswers{true, false, 1000}, kPieces{true, false, kAllOfIt};

/// "/flappy/pose" of the first flapper, "/flappy_3/pose" of the fourth.
std::string topic_name(const std::string& name_space, std::size_t slot, const std::string& name);

/// What Cyclone DDS is told of interfaces and peers; empty where the environment alone says it.
std::string cyclone_xml(const io::DdsConfig& config);

/// An entity of Cyclone DDS, and what it holds goes with it.
class Entity {
 public:
  Entity() = default;
  /// InputError "what: the reason" for a handle that is an error.
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

/// One process in a domain. It outlives its writers and readers.
class Participant {
 public:
  explicit Participant(const io::DdsConfig& config);
  dds_entity_t get() const { return participant_.get(); }

 private:
  std::shared_ptr<const Entity> domain_;  // of all participants of this process in it
  Entity participant_;
};

namespace detail {
/// `name` as ROS 2 writes it: "/flappy/pose".
Entity make_writer(const Participant&, const dds_topic_descriptor_t&, const std::string& name, const Quality&);
Entity make_reader(const Participant&, const dds_topic_descriptor_t&, const std::string& name, const Quality&);
bool write(const Entity&, const void* message);
std::size_t matched(const Entity&, bool writer);
/// Calls see for each message, oldest first.
std::size_t take(const Entity&, const std::function<void(const void*, const dds_sample_info_t&)>& see);
}  // namespace detail

/// The process that wrote a message that a reader took, as DDS knows it; empty where it is gone.
std::string writer_of(const Entity& reader, const dds_sample_info_t& info);

template <class M>
class Writer {
 public:
  Writer(const Participant& p, const std::string& name, const Quality& quality)
      : writer_(detail::make_writer(p, descriptor<M>(), name, quality)) {}
  /// False where it could not be handed over in time; text and lists that `message` points to are copied.
  bool write(const M& message) const { return detail::write(writer_, &message); }
  std::size_t readers() const { return detail::matched(writer_, true); }
  const Entity& entity() const { return writer_; }

 private:
  Entity writer_;
};

template <class M>
class Reader {
 public:
  Reader(const Participant& p, const std::string& name, const Quality& quality)
      : reader_(detail::make_reader(p, descriptor<M>(), name, quality)) {}
  /// Hands out what has arrived; `see(message, info)` must copy what it keeps. Returns how many there were.
  std::size_t take(const auto& see) const {
    return detail::take(reader_, [&](const void* m, const dds_sample_info_t& i) { see(*static_cast<const M*>(m), i); });
  }
  std::size_t writers() const { return detail::matched(reader_, false); }
  const Entity& entity() const { return reader_; }

 private:
  Entity reader_;
};

/// Waits until any of some readers has something to take.
class WaitSet {
 public:
  explicit WaitSet(const Participant& p);
  void add(const Entity& reader);
  /// False after the time.
  bool wait(std::chrono::nanoseconds at_most) const;

 private:
  Entity set_;
  std::vector<Entity> conditions_;
};

}  // namespace flappy::server
