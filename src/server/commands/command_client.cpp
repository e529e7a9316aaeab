#include "server/commands/command_client.hpp"

#include <algorithm>
#include <chrono>
#include <cstring>
#include <fstream>
#include <optional>

#include "io/progress.hpp"

namespace flappy::server {
namespace {

namespace fs = std::filesystem;
using std::chrono::milliseconds;

constexpr milliseconds kLook{50};

template <std::size_t kSize>
void put(char (&to)[kSize], const std::string& from, const char* what) {
  if (from.size() >= kSize)
    throw io::InputError(std::string(what) + ": has " + std::to_string(from.size()) +
                         " characters; accepted: at most " + std::to_string(kSize - 1));
  std::memcpy(to, from.c_str(), from.size() + 1);
}

JobStatus status_of(const JobStatusMessage& m) {
  return {m.id, m.kind, m.config, m.state, static_cast<int>(m.attempts), m.exit_code, m.progress, m.message, m.folder};
}

}  // namespace

CommandClient::CommandClient(const io::DdsConfig& config, double timeout_s)
    : timeout_s_(timeout_s),
      participant_(config),
      command_(participant_, topic_name(config.name_space, 0, "command"), kAnswers),
      results_(participant_, topic_name(config.name_space, 0, "command_result"), kAnswers),
      jobs_(participant_, topic_name(config.name_space, 0, "jobs"), kAnswers),
      files_topic_(topic_name(config.name_space, 0, "files")),
      waiting_(participant_) {
  for (const Entity* reader : {&results_.entity(), &jobs_.entity()}) waiting_.add(*reader);
  const double until_s = io::steady_seconds() + timeout_s_;
  while (command_.readers() == 0) {  // the server then waits for our readers
    if (io::steady_seconds() > until_s)
      throw io::InputError(jobs_.writers() > 0 ? "the server takes no commands; accepted: one with dds.commands = true"
                                               : "no server within " + io::shortest_digits(timeout_s_) +
                                                     " s; accepted: one in the same domain and within dds.reach");
    io::sleep_until(io::steady_seconds() + 0.005);
  }
}

void CommandClient::take_jobs() {
  jobs_.take([&](const JobStatusMessage& m, const dds_sample_info_t&) { heard_.push_back(status_of(m)); });
}

void CommandClient::take_pieces(const std::string& id) {
  if (!files_) return;
  files_->take([&](const FileChunk& m, const dds_sample_info_t&) {
    if (m.id != id) return;
    pieces_.push_back(
        {m.name, {reinterpret_cast<const char*>(m.data._buffer), m.data._length}, m.size, m.offset, m.left});
  });
}

CommandResult CommandClient::await(const std::string& id) {
  std::optional<CommandResult> result;
  for (const double until_s = io::steady_seconds() + timeout_s_; !result;) {
    waiting_.wait(kLook);
    results_.take([&](const CommandResultMessage& m, const dds_sample_info_t&) {
      if (m.id == id) result = {m.id, m.accepted, m.job, m.message};
    });
    take_jobs();
    take_pieces(id);
    if (!result && io::steady_seconds() > until_s)
      throw io::InputError("the server does not answer within " + io::shortest_digits(timeout_s_) + " s");
  }
  return *result;
}

CommandResult CommandClient::ask(Command command) {
  if (command.id.empty()) command.id = fresh_id();
  CommandMessage m{};
  m.stamp = now();
  put(m.id, command.id, "id");
  put(m.verb, command.verb, "verb");
  put(m.kind, command.kind, "kind");
  put(m.config, command.config, "config");
  m.job = command.job;
  std::vector<char[kMaxOfOverride + 1]> overrides(command.overrides.size());
  for (std::size_t i = 0; i < overrides.size(); ++i) put(overrides[i], command.overrides[i], "--set");
  const auto count = static_cast<std::uint32_t>(overrides.size());
  if (count > kMaxOverrides)
    throw io::InputError("--set: is given " + std::to_string(count) + " times; accepted: at most " +
                         std::to_string(kMaxOverrides));
  m.overrides = {count, count, overrides.data(), false};
  if (!command_.write(m)) throw io::InputError("the server takes nothing");
  return await(command.id);
}

std::vector<JobStatus> CommandClient::list() {
  heard_.clear();
  Command command;
  command.verb = "list";
  const CommandResult r = ask(command);
  if (!r.accepted) throw io::InputError(r.message);
  const double until_s = io::steady_seconds() + timeout_s_;
  std::map<std::uint64_t, JobStatus> all;
  for (;;) {
    for (JobStatus& job : heard_) all.insert_or_assign(job.id, std::move(job));
    heard_.clear();
    if (all.size() >= r.job) break;
    if (io::steady_seconds() > until_s) throw io::InputError("the server lists fewer jobs than it says");
    waiting_.wait(kLook);
    take_jobs();
  }
  std::vector<JobStatus> list;
  for (auto& [id, job] : all) list.insert(list.begin(), std::move(job));
  return list;
}

void CommandClient::watch(const std::function<bool(const JobStatus& job)>& see,
                          const std::function<bool()>& keep_going) {
  while (keep_going()) {
    waiting_.wait(kLook);
    results_.take([](const CommandResultMessage&, const dds_sample_info_t&) {
    });  // discards answers to other clients, which would fill the reader
    take_jobs();
    for (const JobStatus& job : std::exchange(heard_, {}))
      if (!see(job)) return;
  }
}

bool CommandClient::ask_for(std::uint64_t job, const std::string& name, const std::function<void(const Piece&)>& see) {
  if (!files_) {
    files_.emplace(participant_, files_topic_, kPieces);
    waiting_.add(files_->entity());
  }
  pieces_.clear();
  Command command{
      .id = fresh_id(), .client = {}, .verb = "fetch", .kind = {}, .config = name, .job = job, .overrides = {}};
  CommandResult r = ask(command);
  for (const double until_s = io::steady_seconds() + timeout_s_; !r.accepted && r.message.starts_with(kTooMany);) {
    if (io::steady_seconds() > until_s) break;
    io::sleep_until(io::steady_seconds() + 0.2);  // every file takes one command, so many files reach the rate limit
    r = ask(command);
  }
  if (!r.accepted && r.message.starts_with(kNoSuchFile)) return false;
  if (!r.accepted) throw io::InputError(r.message);
  bool over = r.message == "0 files";
  for (double heard_s = io::steady_seconds(); !over;) {
    for (take_pieces(command.id); !pieces_.empty(); pieces_.pop_front()) {
      heard_s = io::steady_seconds();
      see(pieces_.front());
      over = pieces_.front().left == 0;
    }
    if (over) break;
    if (io::steady_seconds() - heard_s > timeout_s_)
      throw io::InputError((name.empty() ? "the list of files" : name) + ": does not come within " +
                           io::shortest_digits(timeout_s_) + " s");
    waiting_.wait(kLook);
  }
  return true;
}

std::vector<JobFile> CommandClient::list_files(std::uint64_t job) {
  std::vector<JobFile> files;
  std::optional<std::uint32_t> left;
  ask_for(job, "", [&](const Piece& m) {
    if (left && m.left + 1 != *left) throw io::InputError("the list of files: a part is missing");
    left = m.left;
    files.push_back({m.name, m.size});
  });
  return files;
}

JobClient::Download CommandClient::download(std::uint64_t job, const std::string& name,
                                            const std::function<void(std::string_view)>& write) {
  std::uint64_t got = 0, size = 0;
  const bool there = ask_for(job, name, [&](const Piece& m) {
    if (m.offset != got) throw io::InputError(name + ": a piece is missing");
    write(m.data);
    got += m.data.size();
    size = m.size;
  });
  return !there ? Download::gone : got == size ? Download::whole : Download::changed;
}

}  // namespace flappy::server
