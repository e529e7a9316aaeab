// Jobs as processes: how they end, how they stop, and what a killed server leaves to the next one.
#include "server/jobs/runner.hpp"

#include <gtest/gtest.h>

#include <random>

#include "full.hpp"
#include "server/jobs/fake_jobs.hpp"
#include "server/jobs/supervisor.hpp"

namespace flappy::server {
namespace {

using namespace test;

struct Jobs : ::testing::Test {
  State state(std::uint64_t id) { return queue.job(id).state; }
  /// Until a job has come to a state.
  bool comes_to(Runner& runner, std::uint64_t id, State to) {
    return run_until(runner, [&] { return state(id) == to; });
  }
  Place place;
  Queue queue{place.output()};
};

TEST_F(Jobs, EndAsTheirProgramsDo) {
  const std::uint64_t well = queue.submit(fake("a")), crash = queue.submit(fake("b", "crash")),
                      mistake = queue.submit(fake("c", "mistake")), once = queue.submit(fake("d", "once")),
                      answer = queue.submit(fake("e", "answer")), fault = queue.submit(fake("f", "fault"));
  Runner runner(queue, place.options());
  EXPECT_TRUE(comes_to(runner, well, State::done));
  EXPECT_TRUE(comes_to(runner, crash, State::failed));
  EXPECT_TRUE(comes_to(runner, mistake, State::failed));
  EXPECT_TRUE(comes_to(runner, once, State::done));
  // 1 with a result is an answer of this kind of job, 1 alone is our fault
  EXPECT_TRUE(comes_to(runner, answer, State::done));
  EXPECT_TRUE(comes_to(runner, fault, State::failed));
  EXPECT_EQ(queue.job(answer).exit_code, 1);
  EXPECT_EQ(queue.job(answer).attempts, 1);
  EXPECT_EQ(queue.job(fault).attempts, 3);

  EXPECT_EQ(queue.job(well).exit_code, 0);
  EXPECT_EQ(queue.job(well).progress, 1);
  EXPECT_EQ(queue.job(well).attempts, 1);
  // a crash costs its own job alone, and that one no more than its tries
  EXPECT_EQ(queue.job(crash).attempts, 3);
  EXPECT_EQ(text_of(place.folder(crash) / "starts"), "start\nstart\nstart\n");
  EXPECT_EQ(queue.job(crash).message.substr(0, 10), "signal 11:");
  EXPECT_NE(queue.job(crash).message.find("that was crash 3"), std::string::npos);
  // a mistake is told at once, and tried once
  EXPECT_EQ(queue.job(mistake).attempts, 1);
  EXPECT_EQ(queue.job(mistake).exit_code, 2);
  EXPECT_EQ(queue.job(mistake).message, "x.toml:1:1: key: is wrong; accepted: right");
  // 75 goes on from where it was
  EXPECT_EQ(queue.job(once).attempts, 2);
  EXPECT_EQ(text_of(place.folder(once) / "steps"), counted(5));
  EXPECT_NE(text_of(place.folder(well) / kLogName).find("worked 100 %"), std::string::npos);
}

TEST_F(Jobs, RunSoManyAtOnce) {
  place.config.jobs.at_once = 2;
  for (int i = 0; i < 5; ++i) queue.submit(fake(std::to_string(i), "well", 2));
  Runner runner(queue, place.options());
  std::size_t most = 0;
  EXPECT_TRUE(run_until(runner, [&] {
    most = std::max(most, queue.jobs_in(State::running).size());
    return queue.jobs_in(State::done).size() == 5;
  }));
  EXPECT_EQ(most, 2u);
}

TEST_F(Jobs, PauseGoOnAndAreCancelled) {
  const std::uint64_t id = queue.submit(fake("a", "well", 100)), deaf = queue.submit(fake("b", "deaf", 1000));
  Runner runner(queue, place.options());
  const auto steps = [&] {
    return fs::exists(place.folder(id) / "steps") && fs::file_size(place.folder(id) / "steps") > 4;
  };
  ASSERT_TRUE(run_until(runner, steps));
  queue.pause(id);
  ASSERT_TRUE(comes_to(runner, id, State::paused));
  EXPECT_EQ(queue.job(id).message, "paused");
  const std::string done = text_of(place.folder(id) / "steps");
  queue.resume(id);
  ASSERT_TRUE(comes_to(runner, id, State::running));
  EXPECT_TRUE(run_until(runner, [&] { return text_of(place.folder(id) / "steps").size() > done.size(); }));
  EXPECT_TRUE(text_of(place.folder(id) / "steps").starts_with(done));
  queue.cancel(id);
  EXPECT_TRUE(comes_to(runner, id, State::cancelled));
  EXPECT_EQ(text_of(place.folder(id) / "ends"), "");
  // who does not listen is killed
  queue.cancel(deaf);
  EXPECT_TRUE(comes_to(runner, deaf, State::cancelled));
  EXPECT_TRUE(JobLock::take(place.folder(deaf)));
}

TEST_F(Jobs, StopWithTheServerAndGoOnWithIt) {
  const std::uint64_t id = queue.submit(fake("a", "well", 25));
  {
    Runner runner(queue, place.options());
    const double from_s = io::steady_seconds();
    runner.run([&] { return io::steady_seconds() < from_s + 0.2; });
  }
  EXPECT_EQ(state(id), State::queued);
  EXPECT_EQ(queue.job(id).crashes, 0);
  EXPECT_TRUE(JobLock::take(place.folder(id)));
  Runner runner(queue, place.options());
  EXPECT_TRUE(comes_to(runner, id, State::done));
  EXPECT_EQ(text_of(place.folder(id) / "steps"), counted(25));
}

TEST_F(Jobs, FailWhereTheirConfigurationIsGone) {
  const std::uint64_t id = queue.submit({"a", "train", "gone.toml", {}});
  RunnerOptions options = place.options();
  options.kinds = job_types();
  Runner runner(queue, options);
  runner.step();
  EXPECT_EQ(state(id), State::failed);
  EXPECT_EQ(queue.job(id).message, "config: \"gone.toml\" is not there; accepted: what lies below the allowed folder");
}

TEST_F(Jobs, CountAsCrashedWithoutAMinder) {
  const std::uint64_t id = queue.submit(fake("a"));
  RunnerOptions options = place.options();
  options.server = "/nowhere/flappy-server";
  Runner runner(queue, options);
  EXPECT_TRUE(comes_to(runner, id, State::failed));
  EXPECT_EQ(queue.job(id).attempts, 3);
}

TEST_F(Jobs, EndWithTheirMinder) {
  RunnerOptions options = place.options();
  options.config.attempts = 1;
  options.kinds[0].command = [](const Launch&) { return std::vector<std::string>{"/bin/sleep", "100"}; };
  const std::uint64_t id = queue.submit(fake("a"));
  Runner runner(queue, options);
  ASSERT_TRUE(run_until(runner, [&] { return began(place.folder(id), 1).has_value(); }));
  usleep(50'000);  // its program is there by now
  const Process supervisor = began(place.folder(id), 1).value();
  EXPECT_EQ(queue.job(id).process, supervisor);
  EXPECT_TRUE(signal_process(supervisor, SIGKILL));
  EXPECT_TRUE(comes_to(runner, id, State::failed));
  EXPECT_EQ(queue.job(id).message.substr(0, 43), "its process was killed, or could not start;");
}

TEST(Process, IsNeverMistakenForAnother) {
  const Process self = process_of(getpid()).value();
  EXPECT_TRUE(signal_process(self, 0));
  Process other = self;
  other.start_ticks += 1;  // who had this number before
  EXPECT_FALSE(signal_process(other, 0));
  other = self;
  other.boot_id = "another boot";
  EXPECT_FALSE(signal_process(other, 0));
  EXPECT_FALSE(process_of(0x7fffffff));
}

/// A server in a process of its own, to be killed.
pid_t serve(const Place& place) {
  const pid_t child = fork();
  if (child != 0) return child;
  while (true) try {
      Queue queue(place.output());
      Runner runner(queue, place.options());
      runner.run([] { return true; });
    } catch (const io::InputError&) {  // the one before is about to be gone
      usleep(1000);
    }
}

/// What a power cut does to jobs: their supervisors are gone, and with them their programs.
void kill_supervisors(const Place& place) {
  for (const auto& folder : fs::directory_iterator(place.output()))
    for (int attempt = 1; fs::exists(folder.path() / ("attempt_" + std::to_string(attempt) + ".began")); ++attempt)
      if (const auto supervisor = began(folder.path(), attempt)) signal_process(*supervisor, SIGKILL);
}

/// Kills the server at random moments while it works on ten jobs, and lets it finish them.
void kill_often(Place& place, int kills, int steps, bool supervisors_too) {
  std::random_device seed;
  std::mt19937 random(seed());
  {
    Queue queue(place.output());
    for (int i = 0; i < 10; ++i) queue.submit(fake(std::to_string(i), "well", steps));
  }
  int unfinished = 0;
  for (int k = 0; k < kills; ++k) {
    const pid_t server = serve(place);
    usleep(std::uniform_int_distribution<unsigned>(0, 60'000)(random));
    kill(server, SIGKILL);
    waitpid(server, nullptr, 0);
    if (supervisors_too) kill_supervisors(place);
    Queue queue(place.output());
    unfinished += queue.jobs_in(State::done).size() < 10;
  }
  Queue queue(place.output());
  Runner runner(queue, place.options());
  EXPECT_TRUE(run_until(
      runner, [&] { return queue.jobs_in(State::done).size() == 10; }, 60));
  EXPECT_GE(unfinished, kills / 2) << "the jobs are too short for this test";
  for (std::uint64_t id = 1; id <= 10; ++id) {
    EXPECT_EQ(text_of(place.folder(id) / "steps"), counted(steps)) << "job " << id;
    EXPECT_EQ(text_of(place.folder(id) / "faults"), "") << "job " << id;
    // without its supervisor nobody learns that a job has ended, so its end comes again
    EXPECT_TRUE(text_of(place.folder(id) / "ends").starts_with("end\n")) << "job " << id;
    if (!supervisors_too) {
      EXPECT_EQ(text_of(place.folder(id) / "ends"), "end\n") << "job " << id;
      EXPECT_EQ(text_of(place.folder(id) / "starts"), "start\n") << "job " << id;
    }
  }
}

TEST(Killed, TwentyTimesTheServerLosesNothingAndRunsNothingTwice) {
  Place place;
  kill_often(place, 20, flappy::test::full() ? 100 : 16, false);
}

TEST(Killed, WithItsJobsTheServerGoesOnFromTheirSteps) {
  Place place;
  place.config.jobs.attempts = 100;
  kill_often(place, flappy::test::full() ? 20 : 6, 6, true);
}

}  // namespace
}  // namespace flappy::server
