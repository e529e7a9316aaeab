#include "server/commands/command_server.hpp"

#include <algorithm>
#include <chrono>
#include <cstring>
#include <limits>
#include <utility>

#include "io/log.hpp"
#include "io/progress.hpp"

namespace flappy::server {
namespace {

using std::chrono::milliseconds;

constexpr milliseconds kQueueLook{100};  // between updates from the queue
constexpr milliseconds kReaderLook{5};   // while a client's reader is not matched yet, or is full
constexpr std::size_t kMaxTransfers = 16, kMaxAnswers = 1000;
constexpr double kPatience_s = 10;  // with a client that takes nothing
constexpr double kDiscovery_s = 3;  // for a client's readers to be matched; then the answer goes to whoever listens
constexpr double kMaxOfSpeed_m_s = 100;  // at a higher speed, the two poses belong to different flights

template <std::size_t kSize>
void put(char (&to)[kSize], const std::string& from) {
  const std::size_t size = std::min(from.size(), kSize - 1);
  std::memcpy(to, from.data(), size);
  to[size] = '\0';
}

}  // namespace

CommandServer::CommandServer(const io::DdsConfig& config, Commands& commands, LiveState& watched)
    : commands_(commands),
      watched_(watched),
      participant_(config),
      jobs_(participant_, topic_name(config.name_space, 0, "jobs"), kAnswers),
      results_(participant_, topic_name(config.name_space, 0, "command_result"), kAnswers),
      files_(participant_, topic_name(config.name_space, 0, "files"), kPieces),
      pose_(participant_, topic_name(config.name_space, 0, "pose"), kSensorData),
      imu_(participant_, topic_name(config.name_space, 0, "imu"), kSensorData),
      battery_(participant_, topic_name(config.name_space, 0, "battery"), kSensorData),
      waiting_(participant_) {
  state_.source = "/" + config.name_space;
  if (config.commands) {
    asked_.emplace(participant_, topic_name(config.name_space, 0, "command"),
                   kPieces);  // no command is dropped: a client that sends too fast waits
    waiting_.add(asked_->entity());
  }
  thread_ = std::thread([this] { run(); });
}

CommandServer::~CommandServer() {
  over_ = true;
  thread_.join();
}

void CommandServer::run() {
  double looked_s = 0;
  bool sent = false;
  while (!over_) try {
      if (!std::exchange(sent, false)) waiting_.wait(answers_.empty() && transfers_.empty() ? kQueueLook : kReaderLook);
      take_commands();
      send_answers();
      sent = send_pieces();
      if (io::steady_seconds() - looked_s < std::chrono::duration<double>(kQueueLook).count()) continue;
      looked_s = io::steady_seconds();
      show_changes(false);
      read_watched();
    } catch (const std::exception& e) {  // not the fault of a client; the queue goes on
      io::log(io::LogLevel::error, std::string("dds: ") + e.what());
      std::this_thread::sleep_for(kQueueLook);
    }
}

void CommandServer::take_commands() {
  if (!asked_) return;
  asked_->take([&](const CommandMessage& m, const dds_sample_info_t& info) {
    Command c{m.id, writer_of(asked_->entity(), info), m.verb, m.kind, m.config, m.job, {}};
    for (std::uint32_t i = 0; i < m.overrides._length; ++i) c.overrides.emplace_back(m.overrides._buffer[i]);
    answer(c);
  });
}

void CommandServer::answer(const Command& command) {
  CommandResult r = commands_.execute(command);
  const bool lists = r.accepted && command.verb == "list";
  if (r.accepted && command.verb == "fetch") r = fetch(command);
  Answer a{command.client, std::move(r), lists, io::steady_seconds()};
  if (!send(a)) answers_.push_back(std::move(a));
}

/// Sends an answer, unless the client's readers are not matched yet: what is written before that is lost.
bool CommandServer::send(Answer& a) {
  const bool reached = results_.reaches(a.client) && (!a.lists || jobs_.reaches(a.client));
  if (!reached && io::steady_seconds() - a.asked_s < kDiscovery_s && answers_.size() < kMaxAnswers) return false;
  if (a.lists) {
    show_changes(true);
    a.result.job = shown_.size();
  }
  CommandResultMessage m{};
  put(m.id, a.result.id);
  m.accepted = a.result.accepted;
  m.job = a.result.job;
  put(m.message, a.result.message);
  results_.write(m);
  return true;
}

void CommandServer::send_answers() {
  for (std::size_t k = answers_.size(); k > 0; --k) {
    Answer a = std::move(answers_.front());
    answers_.pop_front();
    if (!send(a)) answers_.push_back(std::move(a));
  }
}

CommandResult CommandServer::fetch(const Command& command) {
  CommandResult r{command.id, true, command.job, ""};
  try {
    std::vector<JobFile> files = commands_.files(command.job);
    Transfer t{.id = command.id, .client = command.client, .job = command.job, .moved_s = io::steady_seconds()};
    if (command.config.empty()) {
      r.message = std::to_string(files.size()) + " files";
      if (files.empty()) return r;
      t.files = std::move(files);
    } else {
      const auto found = std::ranges::find(files, command.config, &JobFile::name);
      if (found == files.end()) throw io::InputError(std::string(kNoSuchFile) + ": \"" + shown(command.config) + "\"");
      r.message = found->name + ": " + std::to_string(found->bytes) + " bytes";
      t.name = found->name;
      t.size = found->bytes;
    }
    if (transfers_.size() >= kMaxTransfers)
      throw io::InputError(std::string(kTooMany) + "; accepted: the same one later");
    transfers_.push_back(std::move(t));
  } catch (const io::InputError& e) {
    r.accepted = false;
    r.message = shown(e.what());
  }
  return r;
}

/// Sends one piece of each transfer in turn, so that no client waits for another's checkpoint. Returns whether any was sent.
bool CommandServer::send_pieces() {
  bool any = false;
  for (std::size_t k = transfers_.size(); k > 0; --k) {
    Transfer t = std::move(transfers_.front());
    transfers_.pop_front();
    const bool reached = files_.reaches(t.client);
    if (!reached && t.begun) continue;  // the client is gone
    const bool sent = reached && (t.files.empty() ? send_piece(t) : send_item(t));
    const double now_s = io::steady_seconds();
    if (sent) t.moved_s = now_s, t.begun = any = true;
    if (!t.over && now_s - t.moved_s < kPatience_s) transfers_.push_back(std::move(t));
  }
  return any;
}

/// Sends the next file of a list. False: the client's reader is full.
bool CommandServer::send_item(Transfer& t) {
  const JobFile& file = t.files[t.offset];
  FileChunk m{};
  put(m.id, t.id);
  m.job = t.job;
  put(m.name, file.name);
  m.size = file.bytes;
  m.left = static_cast<std::uint32_t>(t.files.size() - 1 - t.offset);
  if (!files_.write(m)) return false;
  ++t.offset;
  t.over = m.left == 0;
  return true;
}

/// Sends the next piece of a file. False: the client's reader is full.
bool CommandServer::send_piece(Transfer& t) {
  std::string data;
  try {
    data = commands_.chunk(t.job, t.name, t.offset);
  } catch (const io::InputError&) {  // the file is gone: its last piece comes too early, which the client notices
  }
  data.resize(std::min<std::uint64_t>(data.size(), t.size - t.offset));  // the file may grow meanwhile
  FileChunk m{};
  put(m.id, t.id);
  m.job = t.job;
  put(m.name, t.name);
  m.size = t.size;
  m.offset = t.offset;
  const std::uint64_t after = t.size - t.offset - data.size();
  m.left = data.empty() ? 0 : static_cast<std::uint32_t>((after + kMaxOfChunk - 1) / kMaxOfChunk);
  const auto size = static_cast<std::uint32_t>(data.size());
  m.data = {size, size, reinterpret_cast<std::uint8_t*>(data.data()), false};
  if (!files_.write(m)) return false;
  t.offset += data.size();
  t.over = m.left == 0;
  return true;
}

void CommandServer::show_changes(bool all) {
  const std::uint64_t changes = commands_.changes();
  if (!all && std::exchange(shown_changes_, changes) == changes) return;
  std::map<std::uint64_t, JobStatus> jobs;
  for (JobStatus& s : commands_.statuses()) jobs.emplace(s.id, std::move(s));
  for (const auto& [id, s] : jobs) {
    const auto before = shown_.find(id);
    if (!all && before != shown_.end() && before->second == s) continue;
    char no_frame[] = "";
    JobStatusMessage m{};
    m.header = {now(), no_frame};
    m.id = id;
    put(m.kind, s.kind);
    put(m.config, s.config);
    put(m.state, s.state);
    m.attempts = static_cast<std::uint32_t>(std::max(0, s.attempts));
    m.exit_code = s.exit_code;
    m.progress = s.progress;
    put(m.message, s.message);
    put(m.folder, s.folder);
    jobs_.write(m);
  }
  shown_ = std::move(jobs);
}

/// Updates the live state from the topics of the watched flapper; the velocity is the difference of two poses.
void CommandServer::read_watched() {
  bool any = false;
  imu_.take([&](const Imu& m, const dds_sample_info_t&) {
    state_.w_WB_B_rad_s = {m.angular_velocity.x, m.angular_velocity.y, m.angular_velocity.z};
  });
  battery_.take([&](const BatteryState& m, const dds_sample_info_t&) { state_.battery_V = m.voltage; });
  pose_.take([&](const PoseStamped& m, const dds_sample_info_t&) {
    const double t_s = seconds_of(m.header.stamp), passed_s = t_s - state_.t_s;
    const std::array<double, 3> p{m.pose.position.x, m.pose.position.y, m.pose.position.z};
    for (std::size_t i = 0; i < 3; ++i) {
      const double v = (p[i] - state_.position_m[i]) / passed_s;
      state_.v_WB_W_m_s[i] = std::abs(v) < kMaxOfSpeed_m_s ? v : 0;
    }
    state_.t_s = t_s;
    state_.position_m = p;
    state_.q_WB = {m.pose.orientation.w, m.pose.orientation.x, m.pose.orientation.y, m.pose.orientation.z};
    any = true;
  });
  if (any) watched_.set(state_);
}

}  // namespace flappy::server
