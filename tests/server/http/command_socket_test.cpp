// Commands over the socket in the folder of jobs: what they do, who may send them, and what a client is told.
#include "server/http/command_socket.hpp"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <atomic>
#include <thread>

#include "refusal.hpp"
#include "server/http/socket_client.hpp"
#include "server/jobs/fake_jobs.hpp"

namespace flappy::server {
namespace {

using namespace test;
using flappy::test::refusal;

struct Socket : ::testing::Test {
  Place place;
  Queue queue{place.output()};
  Commands commands{queue, place.config, "/programs", fake_kinds()};
  CommandSocket socket{commands, place.output()};
  SocketClient client{place.output(), 5};
  static Command command(const std::string& verb, std::uint64_t job = 0) {
    return {"", "", verb, "fake", "well", job, {}};
  }
};

TEST_F(Socket, IsForItsOwnerAlone) {
  struct stat status {};
  ASSERT_EQ(stat((place.output() / kSocketName).c_str(), &status), 0);
  EXPECT_TRUE(S_ISSOCK(status.st_mode));
  EXPECT_EQ(status.st_mode & 0777, 0600u);
}

TEST_F(Socket, CarriesCommandsAndRefusals) {
  const CommandResult submitted = client.ask(command("submit"));
  EXPECT_TRUE(submitted.accepted) << submitted.message;
  EXPECT_EQ(submitted.job, 1u);
  EXPECT_EQ(submitted.id.size(), 32u);
  EXPECT_TRUE(client.ask(command("pause", 1)).accepted);
  ASSERT_EQ(client.list().size(), 1u);
  EXPECT_EQ(client.list()[0].state, "paused");
  const CommandResult refused = client.ask(command("dance"));
  EXPECT_FALSE(refused.accepted);
  EXPECT_TRUE(refused.message.starts_with("verb: \"dance\" is unknown; accepted: submit")) << refused.message;
}

TEST_F(Socket, HasNoRateLimit) {
  for (int i = 0; i < 100; ++i) ASSERT_TRUE(client.ask(command("submit")).accepted) << i;
  EXPECT_EQ(client.list().size(), 100u);
}

// What changed between the list and the call of watch is told, too.
TEST_F(Socket, TellsOfEachChangeSinceTheList) {
  client.ask(command("submit"));
  client.ask(command("submit"));
  client.list();
  queue.pause(2);
  std::vector<std::string> told;
  std::thread later([&] {
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
    queue.cancel(1);
  });
  client.watch(
      [&](const JobStatus& job) {
        told.push_back(std::to_string(job.id) + " " + job.state);
        return told.size() < 2;
      },
      [] { return true; });
  later.join();
  EXPECT_EQ(told, (std::vector<std::string>{"2 paused", "1 cancelled"}));
}

TEST_F(Socket, FetchesFilesOfAnySize) {
  client.ask(command("submit"));
  const std::string large(3 * kMaxOfChunk + 17, 'x');
  fs::create_directories(place.folder(1) / "run");
  io::write_atomically(place.folder(1) / "run/best.json", large);
  io::write_atomically(place.folder(1) / "empty", "");
  for (int i = 0; i < 300; ++i) io::write_atomically(place.folder(1) / ("f" + std::to_string(i)), std::to_string(i));
  std::vector<std::string> seen;
  EXPECT_EQ(client.fetch(1, place.root / "fetched", [&](const JobFile& file) { seen.push_back(file.name); }), 302u);
  EXPECT_EQ(seen.size(), 302u);
  EXPECT_EQ(text_of(place.root / "fetched/run/best.json"), large);
  EXPECT_TRUE(fs::exists(place.root / "fetched/empty"));
  EXPECT_EQ(text_of(place.root / "fetched/f299"), "299");
  EXPECT_EQ(refusal([&] { client.fetch(2, place.root / "none", [](const JobFile&) {}); }),
            refusal([&] { queue.job(2); }));
}

TEST_F(Socket, IsFoundByALongPath) {
  fs::path deep = place.root / "deep";
  for (int i = 0; i < 5; ++i) deep /= std::string(40, 'd');
  fs::create_directories(deep);
  const CommandSocket there(commands, deep);
  EXPECT_TRUE(SocketClient(deep, 5).ask(command("submit")).accepted);
}

TEST(SocketClient, SaysWhereNoServerWorks) {
  const io::TemporaryFolder folder;
  EXPECT_EQ(refusal([&] { SocketClient(folder.path(), 1).list(); }),
            folder.path().string() +
                ": no server works here; accepted: the folder of jobs of a flappy-server that runs, by --jobs FOLDER");
  EXPECT_EQ(refusal([&] { SocketClient(folder / "none", 1).list(); }),
            (folder / "none").string() + ": is no folder; accepted: the folder of a server's jobs");
}

}  // namespace
}  // namespace flappy::server
