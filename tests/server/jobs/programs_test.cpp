// flappy-server with our own programs: killed over and over, and with Slurm in its place.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <random>

#include "io/run_program.hpp"
#include "server/jobs/fake_jobs.hpp"

namespace flappy::server {
namespace {

using namespace test;
using Json = nlohmann::json;

const std::string kPrograms = FLAPPY_BUILD_DIR "/bin/";

/// A training of a few seconds.
std::vector<std::string> short_training(int seed, int updates) {
  return {"collect.flappers=48",
          "collect.vehicles=16",
          "networks.critic=[32,32]",
          "learn.replay=4000",
          "learn.batch=64",
          "evaluate.vehicles=32",
          "flight.duration_s=0.4",
          "task.success.keep.from_s=0.36",
          "task.success.keep.until_s=0.4",
          "learn.updates=" + std::to_string(updates),
          "evaluate.every=" + std::to_string(updates / 5),
          "checkpoint.every=600",
          "seed=" + std::to_string(seed)};
}

struct Programs : ::testing::Test {
  void configure(const std::string& jobs) {
    io::write_atomically(root / "server.toml", "schema = 1\n[jobs]\nconfigs = \"" FLAPPY_SOURCE_DIR
                                               "/configs\"\noutput = \"output\"\nattempts = 100\nthreads = 1\n" +
                                                   jobs);
    output = read_server_config(root / "server.toml").jobs.folders.output;
  }
  pid_t serve() const {
    const pid_t child = fork();
    if (child != 0) return child;
    execl((kPrograms + "flappy-server").c_str(), "flappy-server", (root / "server.toml").c_str(), nullptr);
    _exit(127);
  }
  static int end(pid_t server, int signal) {
    kill(server, signal);
    int status = 0;
    waitpid(server, &status, 0);
    return status;
  }
  /// Jobs in a state, seen from outside.
  std::int64_t count(const char* state) const {
    Database database(output / "queue.sqlite");
    Statement row = database.prepare("SELECT count(*) FROM jobs WHERE state = ?");
    row.bind(std::string_view(state)).step();
    return row.integer(0);
  }
  bool wait_for(const char* state, std::int64_t jobs, double most_s) const {
    const double until_s = io::steady_seconds() + most_s;
    while (count(state) < jobs && io::steady_seconds() < until_s) usleep(50'000);
    return count(state) == jobs;
  }
  /// Once more what lives is ended, as by a power cut.
  void kill_supervisors() const {
    for (const auto& folder : fs::directory_iterator(output))
      for (int attempt = 1; fs::exists(folder.path() / ("attempt_" + std::to_string(attempt) + ".began")); ++attempt)
        if (const auto supervisor = began(folder.path(), attempt)) signal_process(*supervisor, SIGKILL);
  }
  std::string digest(const fs::path& run) const {
    std::string all;
    for (const char* name : {"metrics.jsonl", "best.json", "last.json"}) all += io::read_text(run / name);
    return all + Json::parse(io::read_text(run / "summary.json"))["payload_sha256"].get<std::string>();
  }

  io::TemporaryFolder root;
  fs::path output;
};

TEST_F(Programs, KilledTwentyTimesLeaveTheSameBytes) {
  configure("at_once = 2\n");
  constexpr int kUpdates = 60'000;
  {
    Queue queue(output);
    for (int i = 0; i < 10; ++i)
      queue.submit({std::to_string(i), "train", "train/escape.toml", short_training(i, kUpdates)});
  }
  std::random_device seed;
  std::mt19937 random(seed());
  int unfinished = 0;
  for (int k = 0; k < 20; ++k) {
    const pid_t server = serve();
    usleep(std::uniform_int_distribution<unsigned>(50'000, 1'000'000)(random));
    end(server, SIGKILL);
    if (k % 2 == 1) kill_supervisors();
    unfinished += count("done") < 10;
  }
  EXPECT_GE(unfinished, 10) << "the jobs are too short for this test";
  {
    Queue queue(output);
    queue.submit({"evaluation", "evaluate", "1", {"episodes=100", "seed=3"}});
    queue.submit({"export", "export", "1", {}});
    queue.submit({"mistake", "train", "train/escape.toml", {"learn.speed=1"}});
  }
  const pid_t server = serve();
  EXPECT_TRUE(wait_for("done", 12, 300));
  EXPECT_TRUE(wait_for("failed", 1, 10));
  EXPECT_EQ(end(server, SIGINT), 0);

  Queue queue(output);
  const auto whole = [&](int training) {
    const fs::path run = root / ("whole_" + std::to_string(training));
    std::vector<std::string> command = {kPrograms + "flappy-train",
                                        FLAPPY_SOURCE_DIR "/configs/train/escape.toml",
                                        "--out",
                                        run.string(),
                                        "--threads",
                                        "1"};
    for (const std::string& override : short_training(training, kUpdates))
      command.insert(command.end(), {"--set", override});
    EXPECT_EQ(io::run(command).exit_code, 0);
    return run;
  };
  for (std::uint64_t id = 1; id <= 10; ++id) {
    EXPECT_EQ(queue.job(id).state, State::done) << queue.job(id).message;
    int done = 0;
    for (const Transition& t : queue.history(id)) done += t.state == State::done;
    EXPECT_EQ(done, 1);
    EXPECT_FALSE(Json::parse(io::read_text(output / std::to_string(id) / "result.json"))["stopped"].get<bool>());
  }
  for (const int i : {0, 5, 9})
    EXPECT_EQ(digest(output / std::to_string(i + 1) / "run"), digest(whole(i))) << "job " << i + 1;
  EXPECT_EQ(Json::parse(io::read_text(output / "11/result.json"))["seed"], 3);
  EXPECT_TRUE(fs::exists(output / "12/exported/flappy_policy.h"));
  EXPECT_EQ(queue.job(13).message.substr(0, 49), "--set learn.speed=1: learn.speed: unknown key; ac");
  EXPECT_EQ(queue.job(13).exit_code, 2);
}

/// Under tests/tools/with_slurm.sh.
struct OnSlurm : Programs {
  void SetUp() override {
    if (std::getenv("SLURM_CONF") == nullptr) GTEST_SKIP() << "there is no Slurm; tests/tools/with_slurm.sh starts one";
    configure("backend = \"slurm\"\nat_once = 4\nsbatch = [\"--oversubscribe\"]\ngrace_s = 5\n");
  }
  /// Whether Slurm has nothing of ours any more, soon.
  static bool is_quiet() {
    const double until_s = io::steady_seconds() + 30;
    while (io::steady_seconds() < until_s) {
      if (io::run({"squeue", "--noheader", "--me", "--format=%i"}).out.empty()) return true;
      usleep(200'000);
    }
    return false;
  }
};

TEST_F(OnSlurm, KilledServersLoseNothingAndRunNothingTwice) {
  RunnerOptions options{read_server_config(root / "server.toml").jobs, kPrograms + "flappy-server", kPrograms,
                        fake_kinds()};
  {
    Queue queue(output);
    for (int i = 0; i < 6; ++i) queue.submit(fake(std::to_string(i), "well", 100));
  }
  std::mt19937 random(std::random_device{}());
  for (int k = 0; k < 10; ++k) {
    const pid_t server = fork();
    if (server == 0) {
      Queue queue(output);
      Runner runner(queue, options);
      runner.run([] { return true; });
    }
    usleep(std::uniform_int_distribution<unsigned>(0, 300'000)(random));
    end(server, SIGKILL);
  }
  Queue queue(output);
  Runner runner(queue, options);
  EXPECT_TRUE(run_until(
      runner, [&] { return queue.jobs_in(State::done).size() == 6; }, 120));
  for (std::uint64_t id = 1; id <= 6; ++id) {
    const fs::path folder = output / std::to_string(id);
    EXPECT_EQ(text_of(folder / "starts"), "start\n") << "job " << id << ": " << queue.job(id).message;
    EXPECT_EQ(text_of(folder / "ends"), "end\n");
    EXPECT_EQ(text_of(folder / "steps"), counted(100));
    EXPECT_NE(queue.job(id).batch_id, "");
  }
  EXPECT_TRUE(is_quiet());
}

TEST_F(OnSlurm, WaitsForSlurmToAnswer) {
  RunnerOptions options{read_server_config(root / "server.toml").jobs, kPrograms + "flappy-server", kPrograms,
                        fake_kinds()};
  const std::string conf = std::getenv("SLURM_CONF");
  Queue queue(output);
  const std::uint64_t id = queue.submit(fake("a"));
  Runner runner(queue, options);
  io::write_atomically(root / "slurm.conf", "ClusterName=none\nNonsense=1\n");
  setenv("SLURM_CONF", (root / "slurm.conf").c_str(), 1);
  runner.step();
  setenv("SLURM_CONF", conf.c_str(), 1);
  EXPECT_EQ(queue.job(id).state, State::queued);
  EXPECT_EQ(queue.job(id).crashes, 0);
  EXPECT_EQ(queue.job(id).message.substr(0, 8), "sbatch: ");
  EXPECT_TRUE(run_until(
      runner, [&] { return queue.job(id).state == State::done; }, 60));
  EXPECT_TRUE(is_quiet());
}

TEST_F(OnSlurm, PausesCancelsAndTellsMistakes) {
  RunnerOptions options{read_server_config(root / "server.toml").jobs, kPrograms + "flappy-server", kPrograms,
                        fake_kinds()};
  Queue queue(output);
  const std::uint64_t id = queue.submit(fake("a", "well", 400)), deaf = queue.submit(fake("b", "deaf", 100'000)),
                      mistake = queue.submit(fake("c", "mistake"));
  Runner runner(queue, options);
  const auto comes_to = [&](std::uint64_t job, State state) {
    return run_until(
        runner, [&] { return queue.job(job).state == state; }, 60);
  };
  EXPECT_TRUE(comes_to(mistake, State::failed));
  EXPECT_EQ(queue.job(mistake).message, "x.toml:1:1: key: is wrong; accepted: right");
  ASSERT_TRUE(run_until(
      runner, [&] { return fs::exists(output / "1/steps") && fs::exists(output / "2/steps"); }, 60));
  queue.pause(id);
  EXPECT_TRUE(comes_to(id, State::paused));
  queue.resume(id);
  queue.cancel(deaf);
  EXPECT_TRUE(comes_to(deaf, State::cancelled));
  EXPECT_TRUE(comes_to(id, State::done));
  EXPECT_EQ(text_of(output / "1/steps"), counted(400));
  EXPECT_TRUE(is_quiet());
}

}  // namespace
}  // namespace flappy::server
