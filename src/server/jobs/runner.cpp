#include "server/jobs/runner.hpp"

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <system_error>
#include <thread>
#include <utility>

#include "io/files.hpp"
#include "io/log.hpp"
#include "io/parallel.hpp"
#include "io/progress.hpp"
#include "server/jobs/supervisor.hpp"

namespace flappy::server {
namespace {

namespace fs = std::filesystem;

constexpr std::chrono::milliseconds kStep{50};
constexpr double kReportEvery_s = 1, kFirstDelay_s = 5, kLongestDelay_s = 600;
constexpr int kUsersMistake = 2, kGoesOn = 75;  // exit codes of our programs

/// Whether the message of a program is that a file could not be written for want of space.
bool is_disk_full(const std::string& message) {
  return message.ends_with(std::generic_category().message(ENOSPC)) ||
         message.ends_with(std::generic_category().message(EDQUOT));
}

void note(const Job& job, const std::string& what) {
  io::log(io::LogLevel::info,
          "job " + std::to_string(job.id) + ", attempt " + std::to_string(job.attempts) + ": " + what);
}

}  // namespace

Runner::Runner(Queue& queue, RunnerOptions options)
    : queue_(queue),
      options_(std::move(options)),
      backend_(options_.config.backend == BackendKind::slurm ? slurm_backend(queue.name(), options_.config)
                                                             : local_backend()) {
  if (options_.config.threads == 0 && backend_->is_local())
    options_.config.threads = std::max(1, io::processors() / options_.config.at_once);
  for (const Job& job : queue_.jobs_in(State::running)) note(job, "found running by a server that was started anew");
}

void Runner::step() {
  look_after_all();
  std::size_t running = queue_.jobs_in(State::running).size();
  if (running >= static_cast<std::size_t>(options_.config.at_once)) return;
  for (const Job& job : queue_.jobs_in(State::queued)) {
    start(job);
    if (queue_.job(job.id).state == State::running) ++running;
    if (running >= static_cast<std::size_t>(options_.config.at_once)) return;
  }
}

void Runner::run(const std::function<bool()>& keep_going) {
  double complained_s = -1e9;
  while (keep_going()) {
    try {
      const std::uint64_t seen = queue_.changes();
      step();
      queue_.wait_for_change(seen, kStep);
    } catch (const io::InputError& e) {  // for example a full disk: running jobs go on, and so do we once there is room
      if (const double now = io::steady_seconds(); now > complained_s + 60) {
        io::log(io::LogLevel::error, e.what());
        complained_s = now;
      }
      std::this_thread::sleep_for(std::chrono::seconds(1));
    }
  }
  if (!backend_->is_local()) return;
  for (const Job& job : queue_.jobs_in(State::running)) queue_.want_stop(job.id);
  while (look_after_all()) std::this_thread::sleep_for(kStep);
}

fs::path Runner::folder_of(const Job& job) const { return options_.config.folders.output / job.folder; }

Launch Runner::launch_of(const Job& job) const {
  return {options_.config.folders, options_.programs, folder_of(job), job.asked, options_.config.threads};
}

/// Updates all running jobs; returns whether any still runs.
bool Runner::look_after_all() {
  for (const Job& job : queue_.jobs_in(State::running)) look_after(job);
  return !queue_.jobs_in(State::running).empty();
}

void Runner::look_after(const Job& job) {
  io::make_folder(folder_of(job));
  const Life life = backend_->look(queue_, job, folder_of(job));
  if (life == Life::alive) {
    if (job.wanted == Wanted::run) record_progress(job);
    else ask_to_stop(queue_.job(job.id));
  }
  if (life != Life::gone) return;
  const std::optional<Exit> exit = exit_of(folder_of(job), job.attempts);
  if (job.wanted == Wanted::run && exit && exit->code == kUsersMistake && is_disk_full(exit->message)) {
    put_off(job, exit->message);
  } else {
    delays_.erase(job.id);
    const Ending ending = ending_of(job);
    queue_.end(job.id, ending);
    note(job, std::string(name_of(ending.state)) + (ending.message.empty() ? "" : ": ") + ending.message);
  }
  started_here_.erase(job.id);
  requests_.erase(job.id);
  reported_s_.erase(job.id);
}

void Runner::ask_to_stop(const Job& job) {
  Request& request = requests_[job.id];
  const double now = io::steady_seconds();
  if (request.attempt != job.attempts) {
    if (backend_->stop(job, false)) request = {job.attempts, now, false};
  } else if (!request.killed && now > request.asked_s + options_.config.grace_s) {
    note(job, "does not stop, and is killed");
    request.killed = backend_->stop(job, true);
  }
}

void Runner::record_progress(const Job& job) {
  const double now = io::steady_seconds();
  const auto [reported, first] = reported_s_.emplace(job.id, now);
  if (!first && now < reported->second + kReportEvery_s) return;
  reported->second = now;
  const Progress progress = progress_of(folder_of(job));
  if (std::abs(progress.share - job.progress) < 1e-3 && shown(progress.message) == job.message) return;
  queue_.report(job.id, progress.share, progress.message);
}

/// The ending of a crashed attempt: the job is queued again, or fails if this was its config.attempts-th crash.
Ending Runner::crash(const Job& job, std::optional<int> code, const std::string& what) const {
  const bool last = job.crashes + 1 >= options_.config.attempts;
  return {last ? State::failed : State::queued, code,
          last ? what + "; that was crash " + std::to_string(job.crashes + 1) + ", and no further is accepted"
               : what + "; goes on from what it left",
          true};
}

Ending Runner::ending_of(const Job& job) const {
  const fs::path folder = folder_of(job);
  const JobType& kind = job_type_named(options_.kinds, job.asked.kind);
  const std::optional<Exit> exit = exit_of(folder, job.attempts);
  const bool failed = exit && (exit->signal != 0 || (exit->code != 0 && exit->code != kind.also_done));
  const std::optional<int> code = exit && exit->signal == 0 ? std::optional(exit->code) : std::nullopt;
  if (!failed && is_complete(kind, folder, job.wanted != Wanted::run)) return {State::done, code, ""};
  if (job.wanted == Wanted::cancel) return {State::cancelled, code, "cancelled"};
  if (job.wanted == Wanted::pause) return {State::paused, code, "paused"};
  if (job.wanted == Wanted::stop) return {State::queued, code, "stopped with the server"};
  if (code == kUsersMistake) return {State::failed, code, exit->message};
  if (!exit) {
    const std::optional<Process> supervisor = began(folder, job.attempts);
    if (!supervisor && !started_here_.contains(job.id))
      return {State::queued, code, "the server was killed before it began"};
    if (supervisor && backend_->is_local() && supervisor->boot_id != boot_id())
      return {State::queued, code, "the machine went down; goes on from what it left"};
    return crash(job, code, "its process was killed, or could not start");
  }
  if (code == kGoesOn) return crash(job, code, "another rank was lost");
  if (code == 0) return crash(job, code, "was stopped by somebody else");
  return crash(
      job, code,
      (exit->signal != 0 ? "signal " + std::to_string(exit->signal) : "exit code " + std::to_string(exit->code)) +
          (exit->message.empty() ? "" : ": ") + exit->message);
}

/// Queues a job again that could not be started, or found the disk full, through no fault of its own. The delay doubles up
/// to kLongestDelay_s, until an attempt ends in another way.
void Runner::put_off(const Job& job, const std::string& why) {
  queue_.end(job.id, {State::queued, std::nullopt, why + "; is tried again", false});
  Delay& delay = delays_[job.id];
  delay.length_s = delay.length_s == 0 ? kFirstDelay_s : std::min(2 * delay.length_s, kLongestDelay_s);
  delay.until_s = io::steady_seconds() + delay.length_s;
  note(job, why + "; is tried again in " + std::to_string(static_cast<int>(delay.length_s)) + " s");
}

void Runner::start(const Job& queued) {
  if (const auto delay = delays_.find(queued.id);
      delay != delays_.end() && io::steady_seconds() < delay->second.until_s)
    return;
  const fs::path folder = folder_of(queued);
  if (!fs::exists(folder)) {
    io::make_folder(folder);
    io::sync_folder(options_.config.folders.output);  // else a power failure could lose a job that is done
  }
  const std::optional<JobLock> lock = JobLock::take(folder);
  if (!lock) return;  // a process of an earlier attempt still holds the folder; try again later
  std::vector<std::string> command;
  try {
    command = job_type_named(options_.kinds, queued.asked.kind).command(launch_of(queued));
  } catch (const io::InputError& e) {  // a file that was there when the job was submitted is gone
    return queue_.end(queued.id, {State::failed, std::nullopt, e.what()});
  }
  std::error_code none;
  fs::remove(folder / kResult, none);
  fs::remove(folder / kProgress, none);
  Job job;
  try {
    job = queue_.start(queued.id);
  } catch (const io::InputError&) {
    if (queue_.job(queued.id).state == State::queued) throw;
    return;  // a client paused or cancelled it meanwhile
  }
  note(job, "started: " + io::joined(command, " "));
  started_here_.insert(job.id);
  try {
    backend_->start(queue_, job, folder, supervisor_command(options_.server.string(), folder, job.attempts, command),
                    *lock);
  } catch (const std::system_error& e) {
    queue_.end(job.id, crash(job, std::nullopt, std::string("cannot be started: ") + e.what()));
  } catch (const io::InputError& e) {
    if (backend_->is_local()) throw;
    put_off(job, e.what());
  }
}

}  // namespace flappy::server
