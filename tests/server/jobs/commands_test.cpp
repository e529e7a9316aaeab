// What clients may ask, and what they are told.
#include "server/jobs/commands.hpp"

#include <gtest/gtest.h>
#include <malloc.h>

#include <algorithm>

#include "refusal.hpp"
#include "server/jobs/fake_jobs.hpp"

namespace flappy::server {
namespace {

using namespace test;
using flappy::test::refusal;

struct CommandsOf : ::testing::Test {
  CommandsOf() { place.config.rates = {1e4, 1e4, 1}; }
  Commands make() { return Commands(queue, place.config, "/programs", kinds); }
  static Command submit(const std::string& id, const std::string& kind, const std::string& config,
                        std::vector<std::string> overrides = {}) {
    return {id, "somebody", "submit", kind, config, 0, std::move(overrides)};
  }
  Place place;
  Queue queue{place.output()};
  std::vector<JobType> kinds = server::job_types();
};

TEST_F(CommandsOf, AreCarriedOut) {
  kinds = fake_kinds();
  Commands commands = make();
  const CommandResult first = commands.execute(submit("a", "fake", "well"));
  EXPECT_TRUE(first.accepted) << first.message;
  EXPECT_EQ(first.id, "a");
  EXPECT_EQ(first.job, 1u);
  EXPECT_EQ(first.message, "job 1: is submitted");
  EXPECT_EQ(commands.execute(submit("a", "fake", "well")).job, 1u);
  const auto change = [&](const char* verb) { return commands.execute({"b", "somebody", verb, "", "", 1, {}}); };
  EXPECT_TRUE(change("pause").accepted);
  EXPECT_EQ(commands.statuses().at(0).state, "paused");
  EXPECT_EQ(change("pause").message,
            "job 1: is paused and cannot become paused; accepted: a job that is queued or running");
  EXPECT_TRUE(change("resume").accepted);
  EXPECT_TRUE(change("cancel").accepted);
  EXPECT_FALSE(change("resume").accepted);
  EXPECT_TRUE(change("list").accepted);
  ASSERT_EQ(commands.statuses().size(), 1u);
  const JobStatus status = commands.statuses()[0];
  EXPECT_EQ(status.state, "cancelled");
  EXPECT_EQ(status.exit_code, -1);
  EXPECT_EQ(status.folder, "1");
}

TEST_F(CommandsOf, AreBounded) {
  Commands commands = make();
  const auto refused = [&](Command command) {
    const CommandResult result = commands.execute(command);
    EXPECT_FALSE(result.accepted);
    EXPECT_LE(result.id.size(), kMaxOfId);
    EXPECT_LE(result.message.size(), kMaxOfMessage);
    return result.message;
  };
  const std::string much(1'000'000, 'x');
  EXPECT_EQ(refused(submit(much, "train", "a")), "id: has 1000000 characters; accepted: at most 64");
  EXPECT_EQ(refused(submit("a", much, "a")), "kind: has 1000000 characters; accepted: at most 64");
  EXPECT_EQ(refused(submit("a", "train", much)), "config: has 1000000 characters; accepted: at most 256");
  EXPECT_EQ(refused({"a", "b", "list", "", much, 0, {}}), "config: has 1000000 characters; accepted: at most 256");
  EXPECT_EQ(refused({"a", much, "list", "", "", 0, {}}), "client: has 1000000 characters; accepted: at most 64");
  EXPECT_EQ(refused({"a", "b", much, "", "", 0, {}}), "verb: has 1000000 characters; accepted: at most 16");
  EXPECT_EQ(refused(submit("a", "train", "a", std::vector<std::string>(33, "a=1"))),
            "overrides: are 33; accepted: at most 32");
  EXPECT_NE(refused(submit("a", "train", "a", {much + "=1"})).find("accepted: at most 256"), std::string::npos);
  EXPECT_NE(refused(submit("", "train", "a")).find("id: is empty"), std::string::npos);
  EXPECT_NE(refused(submit("a\nb", "train", "a")).find("not printable"), std::string::npos);
  EXPECT_EQ(
      refused({"a", "b", "sumbit", "", "", 0, {}}),
      "verb: \"sumbit\" is unknown; accepted: submit, list, pause, resume, cancel, fetch; did you mean \"submit\"?");
  EXPECT_EQ(refused(submit("a", "trian", "a")),
            "kind: \"trian\" is unknown; accepted: train, evaluate, export, diagnose; did you mean \"train\"?");
  EXPECT_EQ(queue.jobs(10).size(), 0u);
}

TEST_F(CommandsOf, NameWhatEachKindNeeds) {
  for (const char* file : {"configs/a.toml", "output/old/run.json", "output/7/run/run.json"}) {
    fs::create_directories((place.root / file).parent_path());
    io::write_atomically(place.root / file, "{}");
  }
  fs::create_directories(place.root / "data/flight_1");
  fs::create_directory_symlink("/etc", place.root / "data/etc");
  const Folders& folders = place.config.jobs.folders;
  const auto command = [&](const Submission& asked) {
    return io::joined(job_type_named(kinds, asked.kind).command({folders, "/bin", "/job", asked, 2}), " ");
  };
  const std::string a = (folders.configs / "a.toml").string(), output = folders.output.string(),
                    data = folders.data.string();
  EXPECT_EQ(command({"", "train", "a.toml", {"seed=1"}}),
            "/bin/flappy-train " + a +
                " --out /job/run --set seed=1 --threads 2 --json /job/result.json --progress /job/progress.json");
  EXPECT_EQ(
      command({"", "evaluate", "7", {"episodes=100", "task.x=1"}}),
      "/bin/flappy-eval " + output +
          "/7/run --episodes 100 --set task.x=1 --threads 2 --json /job/result.json --progress /job/progress.json");
  EXPECT_EQ(command({"", "export", "old", {"int8=true"}}),
            "/bin/flappy-export " + output +
                "/old --out /job/exported --int8 --json /job/result.json --progress /job/progress.json");
  EXPECT_EQ(command({"", "diagnose", "a.toml", {"flight=flight_1"}}),
            "/bin/flappy-gap diagnose --vehicle " + a +
                " --out /job/diagnosis --threads 2 --json /job/result.json --progress /job/progress.json --flights " +
                data + "/flight_1");
  const auto refused = [&](const char* kind, const char* config, std::vector<std::string> overrides = {}) {
    return refusal([&] { command({"", kind, config, overrides}); });
  };
  EXPECT_NE(refused("train", "../a.toml").find("is no name"), std::string::npos);
  EXPECT_EQ(refused("evaluate", "8"), "config: \"8\" is not there; accepted: what lies below the allowed folder");
  EXPECT_NE(refused("evaluate", "7", {"episodes=-1"}).find("accepted: episodes=N"), std::string::npos);
  EXPECT_NE(refused("export", "old", {"out=x"}).find("accepted: int8=true, prove=true"), std::string::npos);
  EXPECT_NE(refused("diagnose", "a.toml").find("name no flight"), std::string::npos);
  EXPECT_NE(refused("diagnose", "a.toml", {"flight=etc"}).find("leads out of the allowed folder"), std::string::npos);
  EXPECT_NE(refused("diagnose", "a.toml", {"flight=../configs"}).find("is no name"), std::string::npos);
  EXPECT_NE(refused("diagnose", "a.toml", {"withhold=drag"}).find("accepted: flight=NAME"), std::string::npos);
}

TEST_F(CommandsOf, HandOutAJobsFiles) {
  kinds = fake_kinds();
  Commands commands = make();
  ASSERT_EQ(commands.execute(submit("a", "fake", "well")).job, 1u);
  fs::create_directories(place.folder(1) / "run");
  const std::string text(kMaxOfChunk + 10, 'y');
  io::write_atomically(place.folder(1) / "run" / "best.json", text);
  fs::create_symlink("/etc/passwd", place.folder(1) / "leak");
  io::AtomicFile half(place.folder(1) / "run" / "last.json");
  const std::vector<JobFile> files = commands.files(1);
  ASSERT_EQ(files.size(), 1u);
  EXPECT_EQ(files[0].name, "run/best.json");
  EXPECT_EQ(files[0].bytes, text.size());
  EXPECT_EQ(commands.chunk(1, "run/best.json", 0), text.substr(0, kMaxOfChunk));
  EXPECT_EQ(commands.chunk(1, "run/best.json", kMaxOfChunk), text.substr(kMaxOfChunk));
  EXPECT_EQ(commands.chunk(1, "run/best.json", 1u << 30), "");
  for (const char* name : {"leak", "../queue.sqlite", "/etc/passwd", "run", "run/none"})
    EXPECT_NE(refusal([&] { commands.chunk(1, name, 0); }), "accepted") << name;
  EXPECT_NE(refusal([&] { commands.files(2); }), "accepted");
}

TEST_F(CommandsOf, ComeNoFasterThanTheyMay) {
  place.config.rates = {5, 50, 4};
  Commands commands = make();
  const double from_s = io::steady_seconds();
  constexpr int kMany = 10'000;
  const auto flood = [&](const std::function<std::string(int)>& client) {
    int accepted = 0;
    for (int i = 0; i < kMany; ++i) {
      const CommandResult result = commands.execute({"id", client(i), "list", "", "", 0, {}});
      accepted += result.accepted;
      if (!result.accepted) {
        EXPECT_EQ(result.message, "too many commands at a time; accepted: the same one later");
      }
    }
    return accepted;
  };
  ::testing::internal::CaptureStderr();
  const int of_one = flood([](int) { return std::string("one"); });
  const auto took = [&] { return io::steady_seconds() - from_s; };
  EXPECT_GE(of_one, 20);
  EXPECT_LE(of_one, 21 + 5 * took());
  // another is not hindered by that one
  EXPECT_TRUE(commands.execute({"id", "two", "list", "", "", 0, {}}).accepted);
  const std::size_t before = mallinfo2().uordblks;
  const int of_many = flood([](int i) { return "client " + std::to_string(i); });
  EXPECT_LE(of_many, 200 + 50 * took());
  EXPECT_LT(mallinfo2().uordblks - before, 1'000'000u);
  const std::string log = ::testing::internal::GetCapturedStderr();
  const auto lines = std::ranges::count(log, '\n');
  EXPECT_GE(lines, 1);
  EXPECT_LE(lines, 2 + took());
  EXPECT_NE(log.find("warning: refused: list of one: too many commands at a time"), std::string::npos) << log;
  std::printf("%d commands in %.2f s, %d and %d of them accepted\n", 2 * kMany, took(), of_one, of_many);
}

TEST(RateLimit, ForgetsWhoHasNotComeForLong) {
  RateLimit limit({5, 1e9, 4});
  for (int i = 0; i < 5000; ++i) limit.take("client " + std::to_string(i), 0);
  EXPECT_EQ(limit.clients(), kMaxClients);
  EXPECT_FALSE(limit.take("one more", 0));  // what further clients share is used up
  EXPECT_TRUE(limit.take("one more", 100));
  EXPECT_EQ(limit.clients(), 1u);
}

TEST(Shown, IsOneLineOfWholeCharacters) {
  EXPECT_EQ(shown("a\nb\x1b[2Jc"), "a b [2Jc");
  EXPECT_EQ(shown("ab\xc3\xa4", 3), "ab");
  EXPECT_EQ(shown("ab\xc3\xa4", 4), "ab\xc3\xa4");
}

}  // namespace
}  // namespace flappy::server
