#include "server/jobs/queue.hpp"

#include <array>
#include <nlohmann/json.hpp>
#include <random>
#include <thread>

#include "io/files.hpp"
#include "io/schema.hpp"

namespace flappy::server {
namespace {

constexpr int kSchema = 1;
constexpr const char* kTables = R"(
CREATE TABLE queue (name TEXT NOT NULL);
CREATE TABLE jobs (
  id INTEGER PRIMARY KEY AUTOINCREMENT,
  client_id TEXT NOT NULL UNIQUE, kind TEXT NOT NULL, config TEXT NOT NULL, overrides TEXT NOT NULL,
  state TEXT NOT NULL, wanted INTEGER NOT NULL DEFAULT 0,
  attempts INTEGER NOT NULL DEFAULT 0, crashes INTEGER NOT NULL DEFAULT 0,
  pid INTEGER NOT NULL DEFAULT 0, start_ticks INTEGER NOT NULL DEFAULT 0, boot_id TEXT NOT NULL DEFAULT '',
  batch_id TEXT NOT NULL DEFAULT '', exit_code INTEGER, progress REAL NOT NULL DEFAULT 0, message TEXT NOT NULL DEFAULT '',
  submitted_s REAL NOT NULL, started_s REAL NOT NULL DEFAULT 0, ended_s REAL NOT NULL DEFAULT 0);
CREATE INDEX jobs_by_state ON jobs (state, id);
CREATE TABLE history (
  job INTEGER NOT NULL REFERENCES jobs (id), time_s REAL NOT NULL, state TEXT NOT NULL, attempt INTEGER NOT NULL, why TEXT NOT NULL);
CREATE INDEX history_by_job ON history (job);
)";
constexpr const char* kSelect =
    "SELECT id, client_id, kind, config, overrides, state, wanted, attempts, crashes, pid, start_ticks, boot_id, "
    "batch_id, exit_code, "
    "progress, message, submitted_s, started_s, ended_s FROM jobs ";

using Guard = std::lock_guard<std::mutex>;

double now_s() { return std::chrono::duration<double>(std::chrono::system_clock::now().time_since_epoch()).count(); }

/// Retries for half a second: the child of a killed server may hold the lock until its exec.
std::unique_ptr<io::FolderLock> take(const std::filesystem::path& folder) {
  constexpr int kTries = 50;
  constexpr std::chrono::milliseconds kBetween{10};
  for (int i = 1; i < kTries; ++i) try {
      return std::make_unique<io::FolderLock>(folder);
    } catch (const io::InputError&) {
      std::this_thread::sleep_for(kBetween);
    }
  return std::make_unique<io::FolderLock>(folder);
}

std::string random_name() {
  std::random_device random;
  std::array<char, 17> text{};
  std::snprintf(text.data(), text.size(), "%08x%08x", static_cast<unsigned>(random()), static_cast<unsigned>(random()));
  return text.data();
}

Job read_job(const Statement& row) {
  Job job;
  job.id = static_cast<std::uint64_t>(row.integer(0));
  job.asked = {row.text(1), row.text(2), row.text(3), nlohmann::json::parse(row.text(4))};
  job.state = state_named(row.text(5));
  job.wanted = static_cast<Wanted>(row.integer(6));
  job.attempts = static_cast<int>(row.integer(7));
  job.crashes = static_cast<int>(row.integer(8));
  job.process = {row.integer(9), static_cast<std::uint64_t>(row.integer(10)), row.text(11)};
  job.batch_id = row.text(12);
  if (!row.is_null(13)) job.exit_code = static_cast<int>(row.integer(13));
  job.progress = row.number(14);
  job.message = row.text(15);
  job.folder = std::to_string(job.id);
  job.submitted_s = row.number(16);
  job.started_s = row.number(17);
  job.ended_s = row.number(18);
  return job;
}

std::vector<Job> read_jobs(Statement rows) {
  std::vector<Job> jobs;
  while (rows.step()) jobs.push_back(read_job(rows));
  return jobs;
}

std::string called(std::uint64_t id) { return "job " + std::to_string(id); }

[[noreturn]] void refuse(const Job& job, State to) {
  std::vector<std::string> accepted;
  for (const State from : kStates)
    if (may_become(from, to)) accepted.push_back(name_of(from));
  throw io::InputError(called(job.id) + ": is " + name_of(job.state) + " and cannot become " + name_of(to) +
                       "; accepted: a job that is " + io::joined(accepted, " or "));
}

}  // namespace

Queue::Queue(const std::filesystem::path& folder) : lock_(take(folder)), database_(folder / "queue.sqlite") {
  const auto only = [&](const char* sql) {
    Statement row = database_.prepare(sql);
    row.step();
    return row.text(0);
  };
  Transaction all(database_);
  const int schema = std::stoi(only("PRAGMA user_version"));
  if (schema == 0) {
    database_.run(kTables);
    database_.prepare("INSERT INTO queue VALUES (?)").bind(random_name()).run();
    database_.run("PRAGMA user_version = " + std::to_string(kSchema));
  } else if (schema != kSchema) {
    throw io::InputError((folder / "queue.sqlite").string() + ": user_version: " + io::other_schema(schema, kSchema) +
                         "; accepted: " + std::to_string(kSchema));
  }
  all.commit();
  name_ = only("SELECT name FROM queue");
  io::sync_folder(folder);
}

std::uint64_t Queue::submit(const Submission& asked) {
  const Guard guard(mutex_);
  Transaction all(database_);
  Statement same = database_.prepare(std::string(kSelect) + "WHERE client_id = ?");
  if (same.bind(asked.client_id).step()) {
    const Job job = read_job(same);
    if (job.asked == asked) return job.id;
    throw io::InputError("id: is that of " + called(job.id) + ", which asked for something else; accepted: a new one");
  }
  Statement waiting = database_.prepare("SELECT count(*) FROM jobs WHERE state IN ('queued', 'running', 'paused')");
  waiting.step();
  if (waiting.integer(0) >= static_cast<std::int64_t>(kMaxWaiting))
    throw io::InputError("submit: " + std::to_string(kMaxWaiting) +
                         " jobs are not over, which is the most; accepted: a job once others are over");
  database_
      .prepare(
          "INSERT INTO jobs (client_id, kind, config, overrides, state, submitted_s) VALUES (?, ?, ?, ?, 'queued', ?)")
      .bind(asked.client_id, asked.kind, asked.config, nlohmann::json(asked.overrides).dump(), now_s())
      .run();
  const std::uint64_t id = database_.last_row();
  note(id, State::queued, 0, "submitted");
  all.commit();
  changed();
  return id;
}

void Queue::pause(std::uint64_t id) {
  const Guard guard(mutex_);
  const Job job = existing(id);
  if (job.state == State::running) return want(job, Wanted::pause, "to be paused");
  move(job, State::paused, "paused");
}

void Queue::resume(std::uint64_t id) {
  const Guard guard(mutex_);
  const Job job = existing(id);
  if (job.state != State::paused && job.state != State::failed)
    throw io::InputError(called(id) + ": is " + name_of(job.state) +
                         " and cannot be resumed; accepted: a job that is paused or failed");
  Transaction all(database_);
  database_.prepare("UPDATE jobs SET state = 'queued', crashes = 0, wanted = 0, message = '', ended_s = 0 WHERE id = ?")
      .bind(id)
      .run();
  note(id, State::queued, job.attempts, "resumed");
  all.commit();
  changed();
}

void Queue::cancel(std::uint64_t id) {
  const Guard guard(mutex_);
  const Job job = existing(id);
  if (job.state == State::running) return want(job, Wanted::cancel, "to be cancelled");
  move(job, State::cancelled, "cancelled");
}

Job Queue::job(std::uint64_t id) const {
  const Guard guard(mutex_);
  return existing(id);
}

std::vector<Job> Queue::jobs(std::size_t most) const {
  const Guard guard(mutex_);
  Statement rows = database_.prepare(std::string(kSelect) + "ORDER BY id DESC LIMIT ?");
  rows.bind(most);
  return read_jobs(std::move(rows));
}

std::vector<Job> Queue::jobs_in(State state) const {
  const Guard guard(mutex_);
  Statement rows = database_.prepare(std::string(kSelect) + "WHERE state = ? ORDER BY id");
  rows.bind(std::string_view(name_of(state)));
  return read_jobs(std::move(rows));
}

std::vector<Transition> Queue::history(std::uint64_t id) const {
  const Guard guard(mutex_);
  Statement rows = database_.prepare("SELECT time_s, state, attempt, why FROM history WHERE job = ? ORDER BY rowid");
  rows.bind(id);
  std::vector<Transition> all;
  while (rows.step())
    all.push_back({rows.number(0), state_named(rows.text(1)), static_cast<int>(rows.integer(2)), rows.text(3)});
  return all;
}

Job Queue::start(std::uint64_t id) {
  const Guard guard(mutex_);
  const Job job = existing(id);
  if (!may_become(job.state, State::running)) refuse(job, State::running);
  Transaction all(database_);
  database_
      .prepare(
          "UPDATE jobs SET state = 'running', wanted = 0, attempts = attempts + 1, pid = 0, start_ticks = 0, boot_id = "
          "'', "
          "batch_id = '', exit_code = NULL, message = '', started_s = ?, ended_s = 0 WHERE id = ?")
      .bind(now_s(), id)
      .run();
  note(id, State::running, job.attempts + 1, "started");
  all.commit();
  changed();
  return existing(id);
}

void Queue::supervised_by(std::uint64_t id, const Process& process) {
  const Guard guard(mutex_);
  existing(id, State::running);
  database_.prepare("UPDATE jobs SET pid = ?, start_ticks = ?, boot_id = ? WHERE id = ?")
      .bind(process.pid, process.start_ticks, process.boot_id, id)
      .run();
}

void Queue::batched_as(std::uint64_t id, const std::string& batch_id) {
  const Guard guard(mutex_);
  existing(id, State::running);
  database_.prepare("UPDATE jobs SET batch_id = ? WHERE id = ?").bind(batch_id, id).run();
}

void Queue::want_stop(std::uint64_t id) {
  const Guard guard(mutex_);
  const Job job = existing(id, State::running);
  if (job.wanted == Wanted::run) want(job, Wanted::stop, "to stop, as the server does");
}

void Queue::report(std::uint64_t id, double progress, const std::string& message) {
  const Guard guard(mutex_);
  existing(id, State::running);
  database_.prepare("UPDATE jobs SET progress = ?, message = ? WHERE id = ?").bind(progress, shown(message), id).run();
  changed();
}

void Queue::end(std::uint64_t id, const Ending& ending) {
  const Guard guard(mutex_);
  const Job job = existing(id);
  if (!may_become(job.state, ending.state)) refuse(job, ending.state);
  Transaction all(database_);
  const std::string message = shown(ending.message);
  database_
      .prepare(
          "UPDATE jobs SET state = ?, wanted = 0, crashes = crashes + ?, progress = CASE WHEN ?1 = 'done' THEN 1 ELSE "
          "progress END, "
          "message = ?, ended_s = ? WHERE id = ?")
      .bind(std::string_view(name_of(ending.state)), ending.crashed ? 1 : 0, message, now_s(), id)
      .run();
  if (ending.exit_code)
    database_.prepare("UPDATE jobs SET exit_code = ? WHERE id = ?").bind(*ending.exit_code, id).run();
  note(id, ending.state, job.attempts, message);
  all.commit();
  changed();
}

std::uint64_t Queue::changes() const {
  const Guard guard(mutex_);
  return changes_;
}

std::uint64_t Queue::wait_for_change(std::uint64_t seen, std::chrono::milliseconds most) const {
  std::unique_lock lock(mutex_);
  change_.wait_for(lock, most, [&] { return changes_ != seen; });
  return changes_;
}

std::optional<Job> Queue::find(std::uint64_t id) const {
  if (id > INT64_MAX) return std::nullopt;
  Statement row = database_.prepare(std::string(kSelect) + "WHERE id = ?");
  return row.bind(id).step() ? std::optional(read_job(row)) : std::nullopt;
}

Job Queue::existing(std::uint64_t id) const {
  if (std::optional<Job> job = find(id)) return *std::move(job);
  throw io::InputError(called(id) + ": does not exist; accepted: a job of this queue");
}

Job Queue::existing(std::uint64_t id, State wanted) const {
  Job job = existing(id);
  if (job.state == wanted) return job;
  throw io::InputError(called(id) + ": is " + name_of(job.state) + "; accepted: a job that is " + name_of(wanted));
}

void Queue::move(const Job& job, State to, const std::string& why) {
  if (!may_become(job.state, to)) refuse(job, to);
  Transaction all(database_);
  database_.prepare("UPDATE jobs SET state = ?, wanted = 0, message = ?, ended_s = ? WHERE id = ?")
      .bind(std::string_view(name_of(to)), why, now_s(), job.id)
      .run();
  note(job.id, to, job.attempts, why);
  all.commit();
  changed();
}

/// Records what a running job has to do. Throws io::InputError if it is being cancelled, which nothing may replace.
void Queue::want(const Job& job, Wanted wanted, const std::string& why) {
  if (job.wanted == Wanted::cancel && wanted != Wanted::cancel)
    throw io::InputError(called(job.id) + ": is being cancelled; accepted: to wait for its end");
  if (job.wanted == wanted) return;
  Transaction all(database_);
  database_.prepare("UPDATE jobs SET wanted = ?, message = ? WHERE id = ?")
      .bind(static_cast<int>(wanted), why, job.id)
      .run();
  note(job.id, job.state, job.attempts, why);
  all.commit();
  changed();
}

void Queue::note(std::uint64_t id, State state, int attempt, const std::string& why) {
  database_.prepare("INSERT INTO history VALUES (?, ?, ?, ?, ?)")
      .bind(id, now_s(), std::string_view(name_of(state)), attempt, why)
      .run();
}

void Queue::changed() {
  ++changes_;
  change_.notify_all();
}

}  // namespace flappy::server
