#include "server/jobs/commands.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <system_error>
#include <utility>

#include "io/append_file.hpp"
#include "io/files.hpp"
#include "io/progress.hpp"
#include "server/jobs/names.hpp"

namespace flappy::server {
namespace {

namespace fs = std::filesystem;

const std::vector<std::string> kVerbs = {"submit", "list", "pause", "resume", "cancel", "fetch"};

void check_length(const char* what, const std::string& text, std::size_t most) {
  if (text.size() > most)
    throw io::InputError(std::string(what) + ": has " + std::to_string(text.size()) +
                         " characters; accepted: at most " + std::to_string(most));
}

void check(const Command& c) {
  check_length("id", c.id, kMaxOfId);
  check_length("client", c.client, kMaxOfId);
  check_length("verb", c.verb, kMaxOfVerb);
  check_length("kind", c.kind, kMaxOfKind);
  check_length("config", c.config, kMaxOfConfig);
  const bool printable = std::ranges::all_of(c.id, [](unsigned char each) { return each > 0x20 && each < 0x7f; });
  if (c.id.empty() || !printable) throw io::InputError("id: is empty or not printable; accepted: as a UUID");
  if (c.overrides.size() > kMaxOverrides)
    throw io::InputError("overrides: are " + std::to_string(c.overrides.size()) + "; accepted: at most " +
                         std::to_string(kMaxOverrides));
  if (std::ranges::find(kVerbs, c.verb) == kVerbs.end())
    throw io::InputError("verb: \"" + shown(c.verb) + "\" is unknown; accepted: " + io::joined(kVerbs) +
                         io::did_you_mean(shown(c.verb), kVerbs));
}

}  // namespace

JobStatus status_of(const Job& job) {
  return {job.id,       job.asked.kind, job.asked.config, name_of(job.state), job.attempts, job.exit_code.value_or(-1),
          job.progress, job.message,    job.folder};
}

Commands::Commands(Queue& queue, const ServerConfig& config, fs::path programs, std::vector<JobType> kinds)
    : queue_(queue),
      config_(config.jobs),
      programs_(std::move(programs)),
      kinds_(std::move(kinds)),
      limit_(config.rates) {}

CommandResult Commands::execute(const Command& command) {
  const double now = io::steady_seconds();
  bool in_time = true;
  {
    const std::lock_guard guard(mutex_);
    in_time = command.client.empty() || limit_.take(command.client.substr(0, kMaxOfId), now);
  }
  if (!in_time) return refused(command, std::string(kTooMany) + "; accepted: the same one later", now);
  try {
    check(command);
    return done(command);
  } catch (const io::InputError& e) {
    return refused(command, e.what(), now);
  } catch (const std::exception& e) {  // a fault of ours must not end the server
    return refused(command, std::string("internal fault: ") + e.what(), now);
  }
}

CommandResult Commands::refused(const Command& command, const std::string& why, double now_s) {
  const std::lock_guard guard(mutex_);
  log_.warn(
      shown("refused: " + shown(command.verb, kMaxOfVerb) + " of " + shown(command.client, kMaxOfId) + ": " + why),
      now_s);
  return {shown(command.id, kMaxOfId), false, command.job, shown(why)};
}

CommandResult Commands::done(const Command& command) {
  const auto accepted = [&](const std::string& message) {
    return CommandResult{command.id, true, command.job, shown(message)};
  };
  const std::string name = "job " + std::to_string(command.job);
  if (command.verb == "submit") return submit(command);
  if (command.verb == "list") return accepted(std::to_string(queue_.jobs(kMaxListed).size()) + " jobs");
  if (command.verb == "pause") return queue_.pause(command.job), accepted(name + ": is paused, or about to be");
  if (command.verb == "resume") return queue_.resume(command.job), accepted(name + ": is queued");
  if (command.verb == "cancel") return queue_.cancel(command.job), accepted(name + ": is cancelled, or about to be");
  return accepted(name + ": " + std::to_string(files(command.job).size()) + " files");
}

CommandResult Commands::submit(const Command& command) {
  const Submission asked{command.id, command.kind, command.config, command.overrides};
  for (const std::string& override : asked.overrides) check_override(override);
  // make the command line for a dummy folder, to refuse now what could not be started later
  job_type_named(kinds_, asked.kind)
      .command({config_.folders, programs_, config_.folders.output / "0", asked, config_.threads});
  const std::uint64_t id = queue_.submit(asked);
  return {command.id, true, id, "job " + std::to_string(id) + ": is submitted"};
}

std::vector<JobStatus> Commands::statuses() const {
  std::vector<JobStatus> all;
  for (const Job& job : queue_.jobs(kMaxListed)) all.push_back(status_of(job));
  return all;
}

std::vector<JobFile> files_of(const fs::path& folder) {
  std::vector<JobFile> all;
  std::error_code error;
  fs::recursive_directory_iterator each(folder, error);
  for (; !error && each != fs::recursive_directory_iterator() && all.size() < kMaxFiles; each.increment(error)) {
    if (each->is_symlink(error) || !each->is_regular_file(error) || io::is_temporary(each->path())) continue;
    const std::uintmax_t bytes = each->file_size(error);
    const std::string name = each->path().lexically_relative(folder).string();
    if (!error && is_name(name)) all.push_back({name, bytes});
    error.clear();  // the file was removed meanwhile: skip it
  }
  std::ranges::sort(all, {}, &JobFile::name);
  return all;
}

std::vector<JobFile> Commands::files(std::uint64_t job) const {
  return files_of(config_.folders.output / queue_.job(job).folder);
}

std::string Commands::chunk(std::uint64_t job, const std::string& file, std::uint64_t offset) const {
  const fs::path path = below(config_.folders.output / queue_.job(job).folder, file, "file");
  const int descriptor = open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK);
  std::string bytes(kMaxOfChunk, '\0');
  const ssize_t count = descriptor < 0 || offset > INT64_MAX
                            ? -1
                            : pread(descriptor, bytes.data(), bytes.size(), static_cast<off_t>(offset));
  const int failure = errno;
  if (descriptor >= 0) close(descriptor);
  if (count < 0)
    throw io::InputError("file: \"" + shown(file) + "\" cannot be read: " + std::generic_category().message(failure));
  bytes.resize(static_cast<std::size_t>(count));
  return bytes;
}

}  // namespace flappy::server
