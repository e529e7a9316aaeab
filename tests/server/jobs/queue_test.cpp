// The queue: what a job may become, what survives, and who may have it.
#include "server/jobs/queue.hpp"

#include <gtest/gtest.h>

#include "io/temporary_folder.hpp"
#include "refusal.hpp"

namespace flappy::server {
namespace {

using flappy::test::refusal;

Submission training(const std::string& client_id) { return {client_id, "train", "train/escape.toml", {"seed=3"}}; }

/// Takes a new job to a state, by what leads there.
std::uint64_t job_in(Queue& queue, State state) {
  static int count = 0;
  const std::uint64_t id = queue.submit(training("in " + std::to_string(++count)));
  if (state == State::queued) return id;
  queue.start(id);
  if (state != State::running) queue.end(id, {state, 1, "so", false});
  return id;
}

TEST(Queue, GoesOnWithWhatItHad) {
  const io::TemporaryFolder folder;
  std::string name;
  {
    Queue queue(folder.path());
    name = queue.name();
    EXPECT_EQ(queue.submit(training("a")), 1u);
    EXPECT_EQ(queue.submit(training("b")), 2u);
    queue.start(1);
    queue.supervised_by(1, {123, 456, "boot"});
    queue.report(1, 0.25, "a quarter");
  }
  Queue queue(folder.path());
  EXPECT_EQ(queue.name(), name);
  const Job job = queue.job(1);
  EXPECT_EQ(job.asked, training("a"));
  EXPECT_EQ(job.state, State::running);
  EXPECT_EQ(job.attempts, 1);
  EXPECT_EQ(job.process, (Process{123, 456, "boot"}));
  EXPECT_EQ(job.progress, 0.25);
  EXPECT_EQ(job.message, "a quarter");
  EXPECT_EQ(queue.job(2).state, State::queued);
  const std::vector<Transition> history = queue.history(1);
  ASSERT_EQ(history.size(), 2u);
  EXPECT_EQ(history[0].why, "submitted");
  EXPECT_EQ(history[1].state, State::running);
  EXPECT_EQ(history[1].attempt, 1);
}

TEST(Queue, TakesASubmissionOnce) {
  const io::TemporaryFolder folder;
  Queue queue(folder.path());
  EXPECT_EQ(queue.submit(training("a")), queue.submit(training("a")));
  queue.start(1), queue.end(1, {State::done, 0, "", false});
  EXPECT_EQ(queue.submit(training("a")), 1u);
  EXPECT_EQ(queue.jobs(10).size(), 1u);
  Submission other = training("a");
  other.overrides = {"seed=4"};
  EXPECT_EQ(refusal([&] { queue.submit(other); }),
            "id: is that of job 1, which asked for something else; accepted: a new one");
}

TEST(Queue, RefusesWhatAStateForbids) {
  const io::TemporaryFolder folder;
  Queue queue(folder.path());
  const auto refused = [&](State from, void (Queue::*change)(std::uint64_t)) {
    const std::uint64_t id = job_in(queue, from);
    std::string line = refusal([&] { (queue.*change)(id); });
    const std::string name = "job " + std::to_string(id) + ": ";
    return line.starts_with(name) ? line.substr(name.size()) : line;
  };
  for (const State state : {State::queued, State::running}) {
    EXPECT_EQ(refused(state, &Queue::pause), "accepted");
    EXPECT_EQ(refused(state, &Queue::cancel), "accepted");
    EXPECT_EQ(refused(state, &Queue::resume),
              std::string("is ") + name_of(state) + " and cannot be resumed; accepted: a job that is paused or failed");
  }
  EXPECT_EQ(refused(State::paused, &Queue::pause),
            "is paused and cannot become paused; accepted: a job that is queued or running");
  EXPECT_EQ(refused(State::paused, &Queue::resume), "accepted");
  EXPECT_EQ(refused(State::failed, &Queue::resume), "accepted");
  for (const State state : {State::done, State::cancelled}) {
    EXPECT_EQ(refused(state, &Queue::cancel),
              std::string("is ") + name_of(state) +
                  " and cannot become cancelled; accepted: a job that is queued or running or paused");
    EXPECT_EQ(refused(state, &Queue::resume),
              std::string("is ") + name_of(state) + " and cannot be resumed; accepted: a job that is paused or failed");
  }
  EXPECT_EQ(refusal([&] { queue.cancel(999); }), "job 999: does not exist; accepted: a job of this queue");
  EXPECT_EQ(refusal([&] { queue.cancel(UINT64_MAX); }).substr(0, 24), "job 18446744073709551615");
  // what runs it is held to the same table
  const std::uint64_t done = job_in(queue, State::done);
  EXPECT_NE(refusal([&] { queue.start(done); }), "accepted");
  EXPECT_NE(refusal([&] { queue.end(done, {State::failed, 1, "", false}); }), "accepted");
  EXPECT_EQ(queue.job(done).state, State::done);
}

TEST(Queue, KeepsWhatIsWantedOfARunningJob) {
  const io::TemporaryFolder folder;
  Queue queue(folder.path());
  const std::uint64_t id = job_in(queue, State::running);
  queue.pause(id);
  EXPECT_EQ(queue.job(id).wanted, Wanted::pause);
  EXPECT_EQ(queue.job(id).state, State::running);
  queue.cancel(id);
  EXPECT_EQ(queue.job(id).wanted, Wanted::cancel);
  EXPECT_EQ(refusal([&] { queue.pause(id); }),
            "job " + std::to_string(id) + ": is being cancelled; accepted: to wait for its end");
  queue.end(id, {State::cancelled, 0, "cancelled", false});
  EXPECT_EQ(queue.job(id).wanted, Wanted::run);
}

TEST(Queue, CountsCrashesUntilItIsResumed) {
  const io::TemporaryFolder folder;
  Queue queue(folder.path());
  const std::uint64_t id = queue.submit(training("a"));
  for (int i = 0; i < 2; ++i) queue.start(id), queue.end(id, {State::queued, 1, "crashed", true});
  EXPECT_EQ(queue.job(id).crashes, 2);
  EXPECT_EQ(queue.job(id).attempts, 2);
  queue.start(id), queue.end(id, {State::failed, 1, "crashed", true});
  queue.resume(id);
  EXPECT_EQ(queue.job(id).crashes, 0);
  EXPECT_EQ(queue.job(id).attempts, 3);
}

TEST(Queue, BelongsToOneProcessAndOneSchema) {
  const io::TemporaryFolder folder;
  {
    Queue queue(folder.path());
    EXPECT_EQ(refusal([&] { Queue other(folder.path()); }),
              folder.path().string() + ": another process is at work here; accepted: wait for it, or another folder");
  }
  Database(folder / "queue.sqlite").run("PRAGMA user_version = 7");
  EXPECT_EQ(
      refusal([&] { Queue other(folder.path()); }),
      (folder / "queue.sqlite").string() + ": user_version: 7 is read by a newer flappy than this one; accepted: 1");
  io::write_atomically(folder / "queue.sqlite", std::string(5000, 'x'));
  for (const char* beside : {"queue.sqlite-wal", "queue.sqlite-shm"}) std::filesystem::remove(folder / beside);
  EXPECT_NE(refusal([&] { Queue other(folder.path()); }).find("is no sound queue"), std::string::npos);
}

TEST(Queue, FlushesEveryCommit) {
  const io::TemporaryFolder folder;
  Database database(folder / "x.sqlite");
  Statement mode = database.prepare("PRAGMA journal_mode"), flushed = database.prepare("PRAGMA synchronous");
  mode.step(), flushed.step();
  EXPECT_EQ(mode.text(0), "wal");
  EXPECT_EQ(flushed.integer(0), 2);  // FULL
}

TEST(Queue, HasRoomForSoMany) {
  const io::TemporaryFolder folder;
  Queue queue(folder.path());
  Database(folder / "queue.sqlite")
      .run(
          "WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n WHERE i < 1000) INSERT INTO jobs (client_id, "
          "kind, config, "
          "overrides, state, submitted_s) SELECT 'old ' || i, 'train', 'x', '[]', 'queued', 0 FROM n");
  EXPECT_EQ(refusal([&] { queue.submit(training("one more")); }),
            "submit: 1000 jobs are not over, which is the most; accepted: a job once others are over");
}

TEST(Queue, TellsThatItChanged) {
  const io::TemporaryFolder folder;
  Queue queue(folder.path());
  const std::uint64_t before = queue.changes();
  EXPECT_EQ(queue.wait_for_change(before, std::chrono::milliseconds(1)), before);
  queue.submit(training("a"));
  EXPECT_NE(queue.wait_for_change(before, std::chrono::seconds(10)), before);
}

}  // namespace
}  // namespace flappy::server
