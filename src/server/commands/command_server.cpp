#include "server/commands/command_server.hpp"

#include <algorithm>
#include <chrono>
#include <cstring>
#include <limits>

#include "io/log.hpp"
#include "io/progress.hpp"

namespace flappy::server {
namespace {

using std::chrono::milliseconds;

constexpr milliseconds kQueueLook{100};  // between updates from the queue
constexpr std::size_t kMaxTransfers = 16;
constexpr double kPatience_s = 10;       // with a client that takes nothing
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
  while (!over_) try {
      if (transfers_.empty()) waiting_.wait(kQueueLook);
      take_commands();
      send_pieces();
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
  if (r.accepted && command.verb == "list") {
    show_changes(true);
    r.job = shown_.size();
  }
  if (r.accepted && command.verb == "fetch") r = fetch(command);
  CommandResultMessage m{};
  put(m.id, r.id);
  m.accepted = r.accepted;
  m.job = r.job;
  put(m.message, r.message);
  results_.write(m);
}

CommandResult CommandServer::fetch(const Command& command) {
  CommandResult r{command.id, true, command.job, ""};
  try {
    const std::vector<JobFile> files = commands_.files(command.job);
    if (command.config.empty()) {
      auto left = static_cast<std::uint32_t>(files.size());
      for (const JobFile& file : files) {
        FileChunk m{};
        put(m.id, command.id);
        m.job = command.job;
        put(m.name, file.name);
        m.size = file.bytes;
        m.left = --left;
        files_.write(m);
      }
      r.message = std::to_string(files.size()) + " files";
      return r;
    }
    const auto found = std::ranges::find(files, command.config, &JobFile::name);
    if (found == files.end())
      throw io::InputError("file: \"" + shown(command.config) + "\" is none of job " + std::to_string(command.job));
    if (transfers_.size() >= kMaxTransfers)
      throw io::InputError("too many files at a time; accepted: the same one later");
    transfers_.push_back({command.id, command.job, found->bytes, 0, found->name, io::steady_seconds()});
    r.message = found->name + ": " + std::to_string(found->bytes) + " bytes";
  } catch (const io::InputError& e) {
    r.accepted = false;
    r.message = shown(e.what());
  }
  return r;
}

/// Sends one piece of each transfer in turn, so that no client waits for another's checkpoint.
void CommandServer::send_pieces() {
  for (std::size_t k = transfers_.size(); k > 0; --k) {
    Transfer t = transfers_.front();
    transfers_.pop_front();
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
    const bool sent = files_.write(m);
    const double now_s = io::steady_seconds();
    if (sent) t.offset += data.size(), t.moved_s = now_s;
    const bool patient = now_s - t.moved_s < kPatience_s;
    if (files_.readers() > 0 && patient && (!sent || m.left > 0)) transfers_.push_back(std::move(t));
  }
}

void CommandServer::show_changes(bool all) {
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
