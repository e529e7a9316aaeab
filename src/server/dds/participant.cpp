#include "server/dds/participant.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <map>
#include <mutex>

#include "flightlog/ros/ros_messages.hpp"
#include "flightlog/ros/type_hash.hpp"
#include "io/files.hpp"
#include "io/log.hpp"
#include "io/progress.hpp"

namespace flappy::server {
namespace {

namespace fs = std::filesystem;

constexpr int kMaxParticipants = 99;                // ports of a machine that ROS 2 processes without multicast probe
constexpr std::int32_t kMaxKept = 64;               // where no sample may be dropped
constexpr dds_duration_t kBlocks = DDS_MSECS(100);  // longest time for which a slow reader may block write()

struct QosDeleter {
  void operator()(dds_qos_t* q) const { dds_delete_qos(q); }
};
using Qos = std::unique_ptr<dds_qos_t, QosDeleter>;

Qos qos_of(const Quality& quality, const std::string& user_data) {
  Qos q(dds_create_qos());
  dds_qset_reliability(q.get(), quality.reliable ? DDS_RELIABILITY_RELIABLE : DDS_RELIABILITY_BEST_EFFORT, kBlocks);
  dds_qset_durability(q.get(), quality.kept ? DDS_DURABILITY_TRANSIENT_LOCAL : DDS_DURABILITY_VOLATILE);
  if (quality.depth == kAllOfIt) {
    dds_qset_history(q.get(), DDS_HISTORY_KEEP_ALL, 0);
    dds_qset_resource_limits(q.get(), kMaxKept, DDS_LENGTH_UNLIMITED, DDS_LENGTH_UNLIMITED);
  } else {
    dds_qset_history(q.get(), DDS_HISTORY_KEEP_LAST, quality.depth);
  }
  const dds_data_representation_id_t plain = DDS_DATA_REPRESENTATION_XCDR1;
  dds_qset_data_representation(q.get(), 1, &plain);
  if (!user_data.empty()) dds_qset_userdata(q.get(), user_data.data(), user_data.size());
  return q;
}

/// Configures DDS Security with the files of an enclave. Throws InputError where one is missing.
void secure(dds_qos_t* q, const fs::path& keys) {
  const auto file = [&](const char* property, const char* name) {
    const fs::path path = keys / name;
    io::read_text(path);  // throws where it is missing
    dds_qset_prop(q, property, ("file:" + fs::absolute(path).string()).c_str());
  };
  file("dds.sec.auth.identity_ca", "identity_ca.cert.pem");
  file("dds.sec.auth.identity_certificate", "cert.pem");
  file("dds.sec.auth.private_key", "key.pem");
  file("dds.sec.access.permissions_ca", "permissions_ca.cert.pem");
  file("dds.sec.access.governance", "governance.p7s");
  file("dds.sec.access.permissions", "permissions.p7s");
  const auto plugin = [&](const std::string& kind, const char* library, const std::string& names) {
    dds_qset_prop(q, ("dds.sec." + kind + ".library.path").c_str(),
                  (std::string(FLAPPY_DDS_SECURITY) + "/lib" + library + ".so").c_str());
    dds_qset_prop(q, ("dds.sec." + kind + ".library.init").c_str(), ("init_" + names).c_str());
    dds_qset_prop(q, ("dds.sec." + kind + ".library.finalize").c_str(), ("finalize_" + names).c_str());
  };
  plugin("auth", "dds_security_auth", "authentication");
  plugin("crypto", "dds_security_crypto", "crypto");
  plugin("access", "dds_security_ac", "access_control");
}

/// Logs Cyclone DDS's messages, at most one a second: otherwise malformed packets of a stranger would fill the log.
void hear_cyclone() {
  static std::mutex mutex;
  static io::CalmLog log;
  const auto sink = [](void*, const dds_log_data_t* said) {
    std::string line = said->message;
    if (line.find("is not multicast-capable") != std::string::npos) return;  // expected for the loopback interface
    while (line.ends_with('\n')) line.pop_back();
    const std::lock_guard lock(mutex);
    log.warn("dds: " + line.substr(0, 300), io::steady_seconds());
  };
  static std::once_flag once;
  std::call_once(once, [&] { dds_set_log_sink(sink, nullptr); });
}

/// The first participant of this process in a domain creates it with cyclone_xml(); it then ignores CYCLONEDDS_URI.
std::shared_ptr<const Entity> domain_of(const io::DdsConfig& c) {
  static std::mutex mutex;
  static std::map<int, std::weak_ptr<const Entity>> domains;
  const std::lock_guard lock(mutex);
  std::shared_ptr<const Entity> domain = domains[c.domain].lock();
  if (!domain)
    domains[c.domain] = domain =
        std::make_shared<const Entity>(dds_create_domain(static_cast<dds_domainid_t>(c.domain), cyclone_xml(c).c_str()),
                                       "domain " + std::to_string(c.domain));
  return domain;
}

/// The DDS name of a ROS 2 topic is "rt" and its name.
Entity make_topic(const Participant& p, const dds_topic_descriptor_t& type, const std::string& name) {
  return {dds_create_topic(p.get(), &type, ("rt" + name).c_str(), nullptr, nullptr), name};
}

/// A participant's DDS key in hexadecimal.
std::string digits_of(const dds_guid_t& key) {
  constexpr char kDigits[] = "0123456789abcdef";
  std::string text;
  for (const unsigned char byte : key.v) text += {kDigits[byte >> 4], kDigits[byte & 15]};
  return text;
}

/// User data of a reader or writer: the hash by which ROS 2, from Iron on, identifies the type.
std::string user_data(const dds_topic_descriptor_t& type) {
  using namespace flightlog::ros;
  return "typehash=" + type_hash(*standard_messages().layout(ros_name(type.m_typename))) + ";";
}

}  // namespace

std::string ros_name(const std::string& dds_name) {
  std::string name;
  for (std::size_t i = 0; i < dds_name.size();) {
    const bool between = dds_name.compare(i, 2, "::") == 0;
    name += between ? '/' : dds_name[i];
    i += between ? 2 : 1;
  }
  if (const std::size_t at = name.find("/dds_/"); at != std::string::npos) name.erase(at, 5);
  if (name.ends_with('_')) name.pop_back();
  return name;
}

Time time_of(double t_s) {
  const double whole = std::floor(t_s);
  const double nano = std::round((t_s - whole) * 1e9);
  if (nano >= 1e9) return {static_cast<std::int32_t>(whole) + 1, 0};
  return {static_cast<std::int32_t>(whole), static_cast<std::uint32_t>(nano)};
}

Time now() {
  return time_of(std::chrono::duration<double>(std::chrono::system_clock::now().time_since_epoch()).count());
}

double seconds_of(const Time& t) { return t.sec + 1e-9 * t.nanosec; }

std::string topic_name(const std::string& name_space, std::size_t slot, const std::string& name) {
  return "/" + name_space + (slot == 0 ? "" : "_" + std::to_string(slot)) + "/" + name;
}

Entity::Entity(dds_entity_t handle, const std::string& what) : handle_(handle) {
  if (handle < 0) {
    handle_ = 0;
    throw io::InputError("dds: " + what + ": " + dds_strretcode(-handle));
  }
}

Entity::~Entity() {
  if (handle_ > 0) dds_delete(handle_);
}

std::string cyclone_xml(const io::DdsConfig& c) {
  if (c.from_environment) return "";
  std::string interfaces, general, peers;
  // on an interface without multicast, Cyclone DDS probes ports one by one; so we have to use the first free ports, too
  const std::string ports = "<ParticipantIndex>auto</ParticipantIndex><MaxAutoParticipantIndex>" +
                            std::to_string(kMaxParticipants) + "</MaxAutoParticipantIndex>";
  switch (c.reach) {
    case io::Reach::loopback:
      interfaces = "<NetworkInterface address=\"127.0.0.1\"/>";
      general = "<AllowMulticast>false</AllowMulticast>";
      peers = "<Peer address=\"127.0.0.1\"/>";
      break;
    case io::Reach::host:
      interfaces = "<NetworkInterface autodetermine=\"true\"/>";
      general = "<AllowMulticast>spdp</AllowMulticast><MulticastTimeToLive>0</MulticastTimeToLive>";
      peers = "<Peer address=\"127.0.0.1\"/>";
      break;
    case io::Reach::network:
      interfaces = "<NetworkInterface autodetermine=\"true\"/>";
      peers = "<Peer address=\"127.0.0.1\"/>";
      for (const std::string& peer : c.peers) peers += "<Peer address=\"" + peer + "\"/>";
      break;
  }
  return "<CycloneDDS><Domain><General><Interfaces>" + interfaces + "</Interfaces>" + general +
         "</General><Discovery>" + ports + "<Peers>" + peers + "</Peers></Discovery></Domain></CycloneDDS>";
}

Participant::Participant(const io::DdsConfig& c) {
  hear_cyclone();
  const auto domain = static_cast<dds_domainid_t>(c.domain);
  if (!c.from_environment) domain_ = domain_of(c);
  Qos q(dds_create_qos());
  const std::string data = "enclave=/;";
  dds_qset_userdata(q.get(), data.data(), data.size());
  if (!c.keys.empty()) secure(q.get(), c.keys);
  participant_ = Entity(dds_create_participant(domain, q.get(), nullptr),
                        c.keys.empty() ? "domain " + std::to_string(c.domain) : "the keys in " + c.keys.string());
}

namespace detail {

Entity make_writer(const Participant& p, const dds_topic_descriptor_t& type, const std::string& name,
                   const Quality& quality) {
  const Entity topic = make_topic(p, type, name);
  return {dds_create_writer(p.get(), topic.get(), qos_of(quality, user_data(type)).get(), nullptr), name};
}

Entity make_reader(const Participant& p, const dds_topic_descriptor_t& type, const std::string& name,
                   const Quality& quality) {
  const Entity topic = make_topic(p, type, name);
  return {dds_create_reader(p.get(), topic.get(), qos_of(quality, user_data(type)).get(), nullptr), name};
}

bool write(const Entity& writer, const void* message) { return dds_write(writer.get(), message) == DDS_RETCODE_OK; }

std::size_t matched(const Entity& entity, bool writer) {
  const auto count = writer ? dds_get_matched_subscriptions(entity.get(), nullptr, 0)
                            : dds_get_matched_publications(entity.get(), nullptr, 0);
  return count > 0 ? static_cast<std::size_t>(count) : 0;
}

bool reaches(const Entity& writer, const std::string& participant) {
  std::vector<dds_instance_handle_t> readers(matched(writer, true));
  if (participant.empty()) return !readers.empty();
  const dds_return_t count = dds_get_matched_subscriptions(writer.get(), readers.data(), readers.size());
  readers.resize(std::min(readers.size(), static_cast<std::size_t>(std::max(count, 0))));
  return std::ranges::any_of(readers, [&](dds_instance_handle_t handle) {
    dds_builtintopic_endpoint_t* reader = dds_get_matched_subscription_data(writer.get(), handle);
    if (reader == nullptr) return false;
    const bool same = digits_of(reader->participant_key) == participant;
    dds_builtintopic_free_endpoint(reader);
    return same;
  });
}

std::size_t take(const Entity& reader, const std::function<void(const void*, const dds_sample_info_t&)>& see) {
  constexpr std::size_t kAtOnce = 64;
  std::size_t seen = 0;
  for (;;) {
    std::array<void*, kAtOnce> samples{};
    std::array<dds_sample_info_t, kAtOnce> info;
    const dds_return_t count = dds_take(reader.get(), samples.data(), info.data(), kAtOnce, kAtOnce);
    if (count <= 0) return seen;
    for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i)
      if (info[i].valid_data) see(samples[i], info[i]), ++seen;
    dds_return_loan(reader.get(), samples.data(), count);
  }
}

}  // namespace detail

std::string writer_of(const Entity& reader, const dds_sample_info_t& info) {
  dds_builtintopic_endpoint_t* writer = dds_get_matched_publication_data(reader.get(), info.publication_handle);
  if (writer == nullptr) return "";
  const std::string text = digits_of(writer->participant_key);
  dds_builtintopic_free_endpoint(writer);
  return text;
}

WaitSet::WaitSet(const Participant& p) : set_(dds_create_waitset(p.get()), "waiting") {}

void WaitSet::add(const Entity& reader) {
  conditions_.emplace_back(dds_create_readcondition(reader.get(), DDS_ANY_STATE), "waiting");
  if (dds_waitset_attach(set_.get(), conditions_.back().get(), 0) != DDS_RETCODE_OK)
    throw io::InputError("dds: waiting: cannot attach a reader");
}

bool WaitSet::wait(std::chrono::nanoseconds at_most) const {
  return dds_waitset_wait(set_.get(), nullptr, 0, at_most.count()) > 0;
}

}  // namespace flappy::server
