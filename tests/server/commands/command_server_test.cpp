// The queue of jobs over DDS: what clients ask, what strangers may not, and who asks too often.
#include "server/commands/command_server.hpp"

#include <gtest/gtest.h>
#include <sys/wait.h>

#include <csignal>
#include <fstream>
#include <set>

#include "full.hpp"
#include "io/run_program.hpp"
#include "refusal.hpp"
#include "server/commands/command_client.hpp"
#include "server/dds_fixture.hpp"
#include "server/jobs/fake_jobs.hpp"

namespace flappy::server {
namespace {

using flappy::test::refusal;
using test::Place;

io::DdsConfig with_commands() {
  io::DdsConfig c = loopback(own_domain());
  c.commands = true;
  return c;
}

/// A queue of fake jobs that nobody runs, on the wire.
struct Served {
  explicit Served(const io::DdsConfig& config = with_commands()) : dds(config) {
    place.config.rates = {1e4, 1e4, 1};
    commands.emplace(queue, place.config, "/nowhere", test::fake_kinds());
    server.emplace(dds, *commands, watched);
  }
  static Command submit(const std::string& id) { return {id, "", "submit", "fake", "well", 0, {"steps=3"}}; }
  io::DdsConfig dds;
  Place place;
  Queue queue{place.output()};
  LiveState watched;
  std::optional<Commands> commands;
  std::optional<CommandServer> server;
};

TEST(CommandServer, CarriesOutWhatIsAsked) {
  Served served;
  CommandClient client(served.dds, 5);
  EXPECT_EQ(client.ask(Served::submit("a")).job, 1U);
  EXPECT_EQ(client.ask(Served::submit("a")).job, 1U) << "the same command again";
  EXPECT_EQ(client.ask(Served::submit("b")).message, "job 2: is submitted");
  EXPECT_TRUE(client.ask({"", "", "cancel", "", "", 1, {}}).accepted);
  const std::vector<JobStatus> jobs = client.list();
  ASSERT_EQ(jobs.size(), 2U);
  EXPECT_EQ(jobs[0], served.commands->statuses()[0]);
  EXPECT_EQ(jobs[1].state, "cancelled");
  const CommandResult refused = client.ask({"", "", "pause", "", "", 7, {}});
  EXPECT_FALSE(refused.accepted);
  EXPECT_NE(refused.message.find("job 7: does not exist"), std::string::npos);
  EXPECT_NE(refusal([&] {
              client.ask({std::string(65, 'x'), "", "list", "", "", 0, {}});
            }).find("at most 64"),
            std::string::npos);
}

TEST(CommandServer, ShowsJobsAsTheyChange) {
  Served served;
  CommandClient client(served.dds, 5);
  client.ask(Served::submit("a"));
  std::vector<std::string> states;
  client.watch(
      [&](const JobStatus& job) {
        states.push_back(job.state);
        if (job.state == "queued") served.queue.pause(1);
        return job.state != "paused";
      },
      [until_s = io::steady_seconds() + 5] { return io::steady_seconds() < until_s; });
  EXPECT_EQ(states, (std::vector<std::string>{"queued", "paused"}));
}

TEST(CommandServer, HandsOverFiles) {
  Served served;
  CommandClient client(served.dds, 5);
  client.ask(Served::submit("a"));
  const auto folder = served.place.folder(1);
  std::filesystem::create_directories(folder / "run");
  std::string large;
  for (int i = 0; i < 60000; ++i) large += std::to_string(i) + "\n";  // more than 64 kB five times
  io::write_atomically(folder / "run" / "large.txt", large);
  io::write_atomically(folder / "empty.txt", "");
  const auto out = served.place.root / "got";
  std::set<std::string> names;
  EXPECT_EQ(client.fetch(1, out, [&](const JobFile& file) { names.insert(file.name); }), 2U);
  EXPECT_EQ(names, (std::set<std::string>{"empty.txt", "run/large.txt"}));
  EXPECT_EQ(io::read_text(out / "run" / "large.txt"), large);
  EXPECT_EQ(io::read_text(out / "empty.txt"), "");
  EXPECT_NE(refusal([&] { client.fetch(9, out, [](const JobFile&) {}); }).find("job 9: does not exist"),
            std::string::npos);
}

// As of a training that goes on, which removes old checkpoints.
TEST(CommandServer, LeavesOutFilesThatAreGoneMeanwhile) {
  Served served;
  CommandClient client(served.dds, 5);
  client.ask(Served::submit("a"));
  const auto folder = served.place.folder(1), out = served.place.root / "got";
  std::filesystem::create_directories(folder);
  for (const char* name : {"a.txt", "b.txt", "c.txt"}) io::write_atomically(folder / name, name);
  EXPECT_EQ(client.fetch(1, out, [&](const JobFile&) { std::filesystem::remove(folder / "b.txt"); }), 2U);
  EXPECT_TRUE(std::filesystem::exists(out / "a.txt") && std::filesystem::exists(out / "c.txt"));
  EXPECT_FALSE(std::filesystem::exists(out / "b.txt"));
}

/// A client that writes commands, and makes its readers as the test asks.
struct Raw {
  explicit Raw(const io::DdsConfig& dds) : participant(dds), command(participant, "/flappy/command", kPieces) {
    for (int i = 0; i < 1000 && command.readers() == 0; ++i) std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  void ask(const char* verb) const {
    CommandMessage m{};
    std::snprintf(m.id, sizeof m.id, "raw");
    std::snprintf(m.verb, sizeof m.verb, "%s", verb);
    m.job = 1;
    EXPECT_TRUE(command.write(m));
    std::this_thread::sleep_for(std::chrono::milliseconds(200));  // twice what a write may take
  }
  Participant participant;
  Writer<CommandMessage> command;
};

bool soon(const std::function<bool()>& so) {
  for (int i = 0; i < 1000 && !so(); ++i) std::this_thread::sleep_for(std::chrono::milliseconds(2));
  return so();
}

// As on a busy machine, where a command arrives before the server has matched the client's readers.
TEST(CommandServer, WaitsForReadersThatAreMatchedLate) {
  Served served;
  CommandClient(served.dds, 5).ask(Served::submit("a"));
  std::filesystem::create_directories(served.place.folder(1));
  io::write_atomically(served.place.folder(1) / "a.txt", "a");
  const Raw raw(served.dds);
  const Participant other(served.dds);  // whose readers are no reason to answer
  const Reader<CommandResultMessage> others(other, "/flappy/command_result", kAnswers);
  for (const std::string verb : {"list", "fetch"}) {
    raw.ask(verb.c_str());
    const Reader<CommandResultMessage> results(raw.participant, "/flappy/command_result", kAnswers);
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    const Reader<JobStatusMessage> jobs(raw.participant, "/flappy/jobs", kAnswers);
    const Reader<FileChunk> files(raw.participant, "/flappy/files", kPieces);
    std::size_t answers = 0, listed = 0, pieces = 0;
    const auto all = [&] {
      results.take([&](const CommandResultMessage& m, const dds_sample_info_t&) {
        ++answers;
        EXPECT_TRUE(m.accepted) << m.message;
      });
      jobs.take([&](const JobStatusMessage&, const dds_sample_info_t&) { ++listed; });
      files.take([&](const FileChunk& m, const dds_sample_info_t&) {
        ++pieces;
        EXPECT_STREQ(m.name, "a.txt");
      });
      return answers == 1 && (verb == "list" ? listed : pieces) == 1;
    };
    EXPECT_TRUE(soon(all)) << verb << ": " << answers << " answers, " << listed << " jobs, " << pieces << " pieces";
  }
}

TEST(CommandServer, AnswersAProcessThatOnlyWrites) {
  if (!flappy::test::full()) GTEST_SKIP() << "only with --full: takes 3 s";
  Served served;
  const Raw raw(served.dds);
  const Participant other(served.dds);
  const Reader<CommandResultMessage> results(other, "/flappy/command_result", kAnswers);
  raw.ask("list");
  std::size_t answers = 0;
  for (const double until_s = io::steady_seconds() + 8; answers == 0 && io::steady_seconds() < until_s;)
    results.take([&](const CommandResultMessage&, const dds_sample_info_t&) { ++answers; });
  EXPECT_EQ(answers, 1U);
}

// More than the server may have under way beside what a reader holds.
TEST(CommandServer, ListsManyFilesToASlowReader) {
  constexpr std::uint32_t kFiles = 300;
  Served served;
  CommandClient(served.dds, 5).ask(Served::submit("a"));
  std::filesystem::create_directories(served.place.folder(1));
  for (std::uint32_t i = 0; i < kFiles; ++i)
    std::ofstream(served.place.folder(1) / (std::to_string(1000 + i) + ".txt"));
  const Raw raw(served.dds);
  const Reader<FileChunk> files(raw.participant, "/flappy/files", kPieces);
  const Reader<CommandResultMessage> results(raw.participant, "/flappy/command_result", kAnswers);
  raw.ask("fetch");
  std::vector<std::string> names;
  std::uint32_t left = kFiles;
  soon([&] {
    files.take([&](const FileChunk& m, const dds_sample_info_t&) {
      names.emplace_back(m.name);
      EXPECT_EQ(m.left, left - 1);
      left = m.left;
    });
    return left == 0;
  });
  ASSERT_EQ(names.size(), kFiles);
  EXPECT_EQ(names.front() + names.back(), "1000.txt1299.txt");
}

/// Keeps all processors busy while it lives.
class BusyLoops {
 public:
  BusyLoops() {
    const int streams[] = {0, 1, 2};
    for (pid_t& loop : loops_) loop = io::start_program({"timeout", "600", "sh", "-c", "while :; do :; done"}, streams);
  }
  ~BusyLoops() {
    for (const pid_t loop : loops_) kill(loop, SIGTERM), waitpid(loop, nullptr, 0);
  }
  BusyLoops(const BusyLoops&) = delete;

 private:
  pid_t loops_[3];
};

TEST(CommandServer, HandsOverFilesOnABusyMachine) {
  const int fetches = flappy::test::full() ? 200 : 4;
  Served served;
  CommandClient(served.dds, 5).ask(Served::submit("a"));
  std::filesystem::create_directories(served.place.folder(1));
  io::write_atomically(served.place.folder(1) / "a.txt", "a");
  const BusyLoops busy;
  for (int i = 0; i < fetches; ++i) {
    const std::string out = (served.place.root / ("got_" + std::to_string(i))).string();
    const io::Finished fetched = io::run({FLAPPY_BUILD_DIR "/bin/flappy-job", "--timeout", "30", "--dds",
                                          "domain=" + std::to_string(served.dds.domain), "fetch", "1", "--out", out});
    EXPECT_EQ(fetched.exit_code, 0) << fetched.err;
    EXPECT_TRUE(std::filesystem::exists(out + "/a.txt"));
  }
}

// More than the server may have under way, so that a reader which takes nothing would hold it up.
TEST(CommandServer, HandsOverLargeFilesToTwoBesideAnIdleClient) {
  Served served;
  CommandClient idle(served.dds, 5), client(served.dds, 5), other(served.dds, 5);
  client.ask(Served::submit("a"));
  const auto folder = served.place.folder(1);
  std::filesystem::create_directories(folder);
  const std::string large(100 * kMaxOfChunk, 'x');
  io::write_atomically(folder / "large.bin", large);
  io::write_atomically(folder / ".hidden", "x");
  const auto fetch = [&](CommandClient& by, const char* to) {
    EXPECT_EQ(refusal([&] { EXPECT_EQ(by.fetch(1, served.place.root / to, [](const JobFile&) {}), 1U); }), "accepted");
  };
  std::thread second([&] { fetch(other, "second"); });
  fetch(client, "first");
  second.join();
  for (const char* to : {"first", "second"})
    EXPECT_EQ(io::read_text(served.place.root / to / "large.bin"), large) << to;
}

TEST(CommandServer, RefusesAFloodPolitely) {
  io::DdsConfig dds = with_commands();
  Place place;
  place.config.rates = {5, 50, 4};
  Queue queue{place.output()};
  Commands commands(queue, place.config, "/nowhere", test::fake_kinds());
  LiveState watched;
  const CommandServer server(dds, commands, watched);
  const Participant p(dds);
  const Writer<CommandMessage> writer(p, "/flappy/command", {true, false, kAllOfIt});
  const Reader<CommandResultMessage> results(p, "/flappy/command_result", {true, false, kAllOfIt});
  for (int i = 0; i < 1000 && (writer.readers() == 0 || results.writers() == 0); ++i)
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  constexpr int kCommands = 10000;
  std::size_t accepted = 0, refused = 0;
  const auto hear = [&] {
    results.take([&](const CommandResultMessage& m, const dds_sample_info_t&) { ++(m.accepted ? accepted : refused); });
  };
  const double from_s = io::steady_seconds();
  for (int i = 0; i < kCommands; ++i) {
    CommandMessage m{};
    std::snprintf(m.id, sizeof m.id, "%d", i);
    std::snprintf(m.verb, sizeof m.verb, "list");
    ASSERT_TRUE(writer.write(m));
    if (i % 16 == 0) hear();
  }
  for (const double until_s = io::steady_seconds() + 20;
       accepted + refused < kCommands && io::steady_seconds() < until_s;)
    hear();
  const double took_s = io::steady_seconds() - from_s;
  EXPECT_EQ(accepted + refused, static_cast<std::size_t>(kCommands)) << "each is answered";
  EXPECT_GE(accepted, 20U);
  EXPECT_LE(static_cast<double>(accepted), 20 + 5 * took_s + 1);
  CommandClient other(dds, 5);
  EXPECT_EQ(other.list().size(), 0U) << "whom the flood does not hurt";
}

TEST(CommandServer, TakesNothingUnlessCommandsAreOn) {
  Served served(loopback(own_domain()));
  EXPECT_EQ(refusal([&] { CommandClient client(served.dds, 0.3); }),
            "the server takes no commands; accepted: one with dds.commands = true");
}

TEST(CommandServer, KeepsStrangersOut) {
  const io::TemporaryFolder keys;
  const std::string make = FLAPPY_SOURCE_DIR "/scripts/dds-keys";
  ASSERT_EQ(io::run({make, keys / "ours", "server", "alice"}).exit_code, 0);
  ASSERT_EQ(io::run({make, keys / "theirs", "mallory"}).exit_code, 0);
  io::DdsConfig dds = with_commands();
  dds.keys = keys / "ours" / "server";
  Served served(dds);
  const auto job = [&](const std::vector<std::string>& where) {
    std::vector<std::string> command = {FLAPPY_BUILD_DIR "/bin/flappy-job", "--dds",
                                        "domain=" + std::to_string(dds.domain)};
    command.insert(command.end(), where.begin(), where.end());
    command.push_back("list");
    return io::run(command);
  };
  const std::string ours = keys / "ours" / "alice", theirs = keys / "theirs" / "mallory";
  const io::Finished friendly = job({"--dds", "keys=" + ours});
  EXPECT_EQ(friendly.exit_code, 0) << friendly.err;
  for (const std::vector<std::string>& stranger :
       {std::vector<std::string>{"--timeout", "1"}, {"--timeout", "1", "--dds", "keys=" + theirs}}) {
    const io::Finished refused = job(stranger);
    EXPECT_EQ(refused.exit_code, 2);
    EXPECT_NE(refused.err.find("no server within 1 s"), std::string::npos) << refused.err;
  }
  EXPECT_NE(job({"--dds", "keys=" + (keys / "nowhere").string()}).err.find("identity_ca.cert.pem"), std::string::npos);
}

}  // namespace
}  // namespace flappy::server
