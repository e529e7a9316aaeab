#include "learn/checkpoint.hpp"

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <csignal>
#include <cstring>
#include <fstream>
#include <functional>
#include <map>
#include <set>

#include "refusal.hpp"

namespace flappy::learn {
namespace {

enum class Phase : std::uint8_t { warm_up, training };

using test::refusal;

class CheckpointTest : public testing::Test {
 protected:
  ~CheckpointTest() override { std::filesystem::remove_all(run_); }

  std::string write(std::uint64_t update, const std::string& commit = "c0ffee") {
    CheckpointWriter writer(run_ / checkpoint_name(update), {update, "ab12", "processor \"x\"", "x86-64-v4", commit});
    writer.put("actor", actor_);
    writer.put("update", update);
    writer.put("phase", Phase::training);
    writer.put("config", std::string("a = 1\n"));
    writer.put("empty", std::vector<double>());
    return writer.commit();
  }

  std::string open(const std::string& name) {
    return refusal([&] { Checkpoint checkpoint(run_ / name); });
  }
  std::string open_bytes(const std::string& bytes) {
    std::filesystem::remove(run_ / "changed");  // thousands of new files need not reach the disk, as replaced ones do
    std::ofstream(run_ / "changed", std::ios::binary) << bytes;
    return open("changed");
  }
  void change(const std::string& name, const std::function<void(std::string&)>& how) {
    std::string bytes = io::read_text(run_ / name);
    how(bytes);
    io::write_atomically(run_ / name, bytes);
  }
  std::set<std::string> files() const {
    std::set<std::string> names;
    for (const auto& entry : std::filesystem::directory_iterator(run_)) names.insert(entry.path().filename());
    return names;
  }

  const std::filesystem::path run_ =
      testing::TempDir() + "flappy_checkpoint_" + testing::UnitTest::GetInstance()->current_test_info()->name();
  const bool made_ = std::filesystem::create_directories(run_);
  const std::vector<float> actor_ = {1, -0.0f, 1e-45f, 3.5f};
};

TEST_F(CheckpointTest, ReadsBackWhatWasPut) {
  const std::string payload = write(7);
  const Checkpoint checkpoint(run_ / checkpoint_name(7));
  EXPECT_EQ(checkpoint.header().update, 7u);
  EXPECT_EQ(checkpoint.header().config_sha256, "ab12");
  EXPECT_EQ(checkpoint.header().processor, "processor \"x\"");
  EXPECT_EQ(checkpoint.header().instruction_set, "x86-64-v4");
  EXPECT_EQ(checkpoint.header().commit, "c0ffee");
  EXPECT_EQ(checkpoint.payload_sha256(), payload);
  std::vector<float> actor(4);
  checkpoint.get("actor", actor);
  EXPECT_EQ(std::memcmp(actor.data(), actor_.data(), 16), 0);
  std::array<float, 4> again{};
  checkpoint.get("actor", std::span(again).subspan(0));
  EXPECT_EQ(std::memcmp(again.data(), actor_.data(), 16), 0);
  std::uint64_t update = 0;
  checkpoint.get("update", update);
  EXPECT_EQ(update, 7u);
  Phase phase = Phase::warm_up;
  checkpoint.get("phase", phase);
  EXPECT_EQ(phase, Phase::training);
  EXPECT_EQ(checkpoint.text("config"), "a = 1\n");
  EXPECT_EQ(checkpoint.text("empty"), "");
  EXPECT_TRUE(checkpoint.has("empty"));
  EXPECT_FALSE(checkpoint.has("critic"));
  EXPECT_EQ(files().size(), 1u);
}

TEST_F(CheckpointTest, ReadsBackMoreThanOneBlock) {
  std::vector<std::uint32_t> replay(1000003);
  for (std::size_t i = 0; i < replay.size(); ++i) replay[i] = static_cast<std::uint32_t>(i * 2654435761u);
  CheckpointWriter writer(run_ / "large", {});
  writer.put("replay", replay);
  writer.put("after", 1.5);
  writer.commit();
  const Checkpoint checkpoint(run_ / "large");
  std::vector<std::uint32_t> read(replay.size());
  checkpoint.get("replay", read);
  EXPECT_EQ(read, replay);
  double after = 0;
  checkpoint.get("after", after);
  EXPECT_EQ(after, 1.5);
  change("large", [](std::string& bytes) { bytes[3000000] ^= 1; });
  EXPECT_EQ(open("large"), (run_ / "large").string() + ": is damaged: section replay differs from its checksum");
}

TEST_F(CheckpointTest, PayloadDependsOnTheSectionsAlone) {
  const std::string payload = write(7);
  EXPECT_EQ(write(7, "another commit"), payload);
  const auto of = [&](const std::map<std::string, int>& sections, bool backwards) {
    CheckpointWriter writer(run_ / "order", {});
    if (backwards)
      for (auto s = sections.rbegin(); s != sections.rend(); ++s) writer.put(s->first, s->second);
    else
      for (const auto& s : sections) writer.put(s.first, s.second);
    return writer.commit();
  };
  EXPECT_EQ(of({{"a", 1}, {"b", 2}}, false), of({{"a", 1}, {"b", 2}}, true));
  EXPECT_NE(of({{"a", 1}, {"b", 2}}, false), of({{"a", 2}, {"b", 1}}, false));
  EXPECT_NE(of({{"a", 1}, {"b", 2}}, false), of({{"a", 1}, {"c", 2}}, false));
}

TEST_F(CheckpointTest, RefusesEveryChangedByte) {
  write(7);
  const std::string good = io::read_text(run_ / checkpoint_name(7));
  ASSERT_EQ(open_bytes(good), "accepted");
  std::set<std::string> reasons;
  for (std::size_t i = 0; i < good.size(); ++i) {
    for (const int flip : {1, 0x80, 0xff}) {
      std::string bad = good;
      bad[i] = static_cast<char>(bad[i] ^ flip);
      const std::string message = open_bytes(bad);
      ASSERT_NE(message, "accepted") << "byte " << i << " of " << good.size();
      reasons.insert(message.substr((run_ / "changed").string().size()));
    }
  }
  const auto has = [&](const std::string& reason) { return reasons.contains(": " + reason); };
  EXPECT_TRUE(has("is no checkpoint of flappy"));
  EXPECT_TRUE(has("is a checkpoint whose schema 0 is read by no flappy; accepted: schema 1"));
  EXPECT_TRUE(has("is damaged: its first line is not \"flappy checkpoint 1\""));
  EXPECT_TRUE(has("is damaged: section actor differs from its checksum"));
  EXPECT_TRUE(has("is damaged: the list of its sections differs from its checksum"));
  EXPECT_TRUE(has("is damaged: its end is missing"));
  EXPECT_EQ(reasons.size(), 9u) << "four sections have bytes";
}

TEST_F(CheckpointTest, RefusesEveryOtherLength) {
  write(7);
  const std::string good = io::read_text(run_ / checkpoint_name(7));
  for (std::size_t size = 0; size < good.size(); ++size)
    ASSERT_NE(open_bytes(good.substr(0, size)).find("is damaged: "), std::string::npos) << size;
  EXPECT_EQ(open_bytes(""), (run_ / "changed").string() + ": is damaged: it is cut short");
  EXPECT_NE(open_bytes(good + "x"), "accepted");
  EXPECT_NE(open_bytes(good + std::string(1, '\0')), "accepted");
  EXPECT_NE(open_bytes(good + good), "accepted");
  EXPECT_NE(open_bytes("flappy checkpoint 1\n" + good), "accepted");
  EXPECT_EQ(open_bytes(std::string(good).erase(20 + 16 + 8 + 1, 1)),
            (run_ / "changed").string() + ": is damaged: section config is cut short");
  EXPECT_EQ(open_bytes(std::string(good).insert(20 + 16 + 8 + 1 + 6, "x")),
            (run_ / "changed").string() + ": is damaged: bytes that belong to no section");
}

TEST_F(CheckpointTest, RefusesWhatIsNoCheckpoint) {
  const std::string folder = run_.string();
  EXPECT_EQ(open("none"), folder + "/none: cannot be read: No such file or directory");
  EXPECT_EQ(open(""), folder + "/: is not a regular file");
  ASSERT_EQ(mkfifo((run_ / "pipe").c_str(), 0600), 0);
  EXPECT_EQ(open("pipe"), folder + "/pipe: is not a regular file");
  EXPECT_EQ(
      open_bytes("flappy checkpoint 12\n"),
      folder + "/changed: is a checkpoint whose schema 12 is read by a newer flappy than this one; accepted: schema 1");
  EXPECT_EQ(open_bytes("{\"schema\": 1}"), folder + "/changed: is no checkpoint of flappy");
}

TEST_F(CheckpointTest, RefusesOtherSections) {
  write(7);
  const Checkpoint checkpoint(run_ / checkpoint_name(7));
  const std::string name = (run_ / checkpoint_name(7)).string();
  const std::string by = "; flappy at commit c0ffee wrote it, and reads it";
  std::vector<float> actor(5);
  EXPECT_EQ(refusal([&] { checkpoint.get("actor", actor); }),
            name + ": section actor has 16 bytes; accepted: 20, as this configuration has it" + by);
  EXPECT_EQ(refusal([&] { checkpoint.get("actor", std::span(actor).first(3)); }),
            name + ": section actor has 16 bytes; accepted: 12, as this configuration has it" + by);
  EXPECT_EQ(refusal([&] { checkpoint.get("critic", actor); }),
            name + ": has no section critic; sections here: actor, update, phase, config, empty" + by);
  EXPECT_EQ(refusal([&] { static_cast<void>(checkpoint.text("critic")); }),
            name + ": has no section critic; sections here: actor, update, phase, config, empty" + by);
  CheckpointWriter writer(run_ / "twice", {});
  writer.put("a", 1);
  EXPECT_THROW(writer.put("a", 1), std::logic_error);
}

TEST_F(CheckpointTest, FindsAndKeepsTheNewest) {
  EXPECT_EQ(checkpoint_name(12000), "checkpoint_000012000.flappy");
  EXPECT_EQ(checkpoint_name(1234567890), "checkpoint_1234567890.flappy");
  for (const std::uint64_t update : {9000, 1234567890, 12000, 0}) write(update);
  for (const char* other : {"checkpoint_.flappy", "checkpoint_1x.flappy", "checkpoint_000000001.flappy.tmp12-3",
                            "checkpoint_-00000001.flappy", "metrics.csv"})
    io::write_atomically(run_ / other, "x");
  const std::vector<std::filesystem::path> expected = {run_ / checkpoint_name(1234567890),
                                                       run_ / checkpoint_name(12000), run_ / checkpoint_name(9000),
                                                       run_ / checkpoint_name(0)};
  EXPECT_EQ(checkpoints_in(run_), expected);
  keep_newest(run_, 2);
  EXPECT_EQ(checkpoints_in(run_), (std::vector(expected.begin(), expected.begin() + 2)));
  EXPECT_EQ(files().size(), 7u);
  EXPECT_EQ(refusal([&] { checkpoints_in(run_ / "none"); }),
            (run_ / "none").string() + ": cannot be read: No such file or directory");
}

TEST_F(CheckpointTest, OffersAnEarlierOneForADamagedOne) {
  const auto newest = [&] { return refusal([&] { newest_checkpoint(run_); }); };
  const std::string folder = run_.string();
  EXPECT_EQ(newest(),
            folder + ": holds no checkpoint; accepted: a run folder with checkpoint_000000000.flappy or the like");
  write(12000);
  EXPECT_EQ(newest_checkpoint(run_).header().update, 12000u);
  const auto flip = [](std::string& bytes) { bytes[22] ^= 4; };
  change(checkpoint_name(12000), flip);
  const std::string damaged =
      folder + "/checkpoint_000012000.flappy: is damaged: section actor differs from its checksum; ";
  EXPECT_EQ(newest(), damaged + "there is no other");
  write(10000);
  EXPECT_EQ(newest(), damaged + "the one before, checkpoint_000010000.flappy, is good: --resume " + folder +
                          " --from checkpoint_000010000.flappy");
  change(checkpoint_name(10000), [](std::string& bytes) { bytes.pop_back(); });
  EXPECT_EQ(newest(), damaged + "so are all before it");
  write(8000);
  EXPECT_EQ(newest(), damaged + "the last good one before, checkpoint_000008000.flappy, is good: --resume " + folder +
                          " --from checkpoint_000008000.flappy");
}

// A disk that takes no more than a megabyte, in a process of its own.
TEST_F(CheckpointTest, AFullDiskLeavesTheEarlierOne) {
  write(7);
  const std::string before = io::read_text(run_ / checkpoint_name(7));
  const pid_t child = fork();
  if (child == 0) {
    const rlimit limit{1 << 20, 1 << 20};
    setrlimit(RLIMIT_FSIZE, &limit);
    std::signal(SIGXFSZ, SIG_IGN);
    // the section does not fit, or only the list behind it
    const auto message = [&](std::size_t size, bool commit) {
      return refusal([&] {
        CheckpointWriter writer(run_ / checkpoint_name(7), {});
        writer.put("replay", std::vector<char>(size));
        if (commit) writer.commit();
      });
    };
    const std::string refused = (run_ / checkpoint_name(7)).string() + ": cannot be written: File too large";
    _exit(message(2 << 20, false) == refused && message((1 << 20) - 100, true) == refused ? 0 : 1);
  }
  int status = 0;
  ASSERT_EQ(waitpid(child, &status, 0), child);
  EXPECT_EQ(status, 0);
  EXPECT_EQ(io::read_text(run_ / checkpoint_name(7)), before);
  EXPECT_EQ(files().size(), 1u) << "a temporary file is left";
}

}  // namespace
}  // namespace flappy::learn
