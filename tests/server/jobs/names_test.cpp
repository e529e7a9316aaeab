// Names that come from elsewhere lead nowhere but below the folder that is allowed.
#include "server/jobs/names.hpp"

#include <gtest/gtest.h>

#include <filesystem>

#include "io/temporary_folder.hpp"
#include "refusal.hpp"
#include "server/jobs/server_config.hpp"

namespace flappy::server {
namespace {

namespace fs = std::filesystem;
using flappy::test::refusal;

struct Tree : ::testing::Test {
  Tree() {
    fs::create_directories(root / "allowed/train");
    fs::create_directories(root / "allowed_too");
    for (const char* file : {"allowed/train/a.toml", "allowed_too/b.toml", "secret.toml"})
      io::write_atomically(root / file, "x");
    fs::create_symlink(root / "secret.toml", root / "allowed/out.toml");
    fs::create_directory_symlink(root.path(), root / "allowed/up");
    fs::create_symlink(root / "allowed_too/b.toml", root / "allowed/beside.toml");
    fs::create_symlink(root / "allowed/train/a.toml", root / "allowed/in.toml");
  }
  std::string refused(const std::string& name) {
    return refusal([&] { below(root / "allowed", name, "config"); });
  }
  io::TemporaryFolder root;
};

TEST_F(Tree, LeadsBelowTheFolder) {
  EXPECT_EQ(below(root / "allowed", "train/a.toml", "config"), fs::canonical(root / "allowed/train/a.toml"));
  EXPECT_EQ(below(root / "allowed", "in.toml", "config"), fs::canonical(root / "allowed/train/a.toml"));
}

TEST_F(Tree, RefusesWhatIsNoName) {
  for (const std::string name :
       {"", "/etc/passwd", "../secret.toml", "train/../../secret.toml", "train/..", ".", "train//a.toml", "train/",
        "-v", "train/-x", "~/x", "a b", "a;b", "$(id)", "a\nb", "train\\a.toml", ".hidden", "a\xc3\xa4"}) {
    EXPECT_NE(refused(name).find(" is no name; accepted: "), std::string::npos) << name << ": " << refused(name);
  }
  EXPECT_NE(refused(std::string("train/a.toml\0x", 14)).find("is no name"), std::string::npos);
  EXPECT_EQ(refused(std::string(257, 'a')), "config: has 257 characters; accepted: at most 256");
  EXPECT_EQ(refused("none.toml"), "config: \"none.toml\" is not there; accepted: what lies below the allowed folder");
}

TEST_F(Tree, FollowsNoLinkOutOfTheFolder) {
  for (const char* name : {"out.toml", "up/secret.toml", "up/allowed_too/b.toml", "beside.toml", "up"})
    EXPECT_EQ(refused(name),
              "config: \"" + std::string(name) + "\" leads out of the allowed folder; accepted: what lies below it");
}

TEST(Override, NamesNoFile) {
  for (const char* good : {"learn.updates=1000", "networks.critic=[32,32]", "task.reward.goal=-1e3",
                           "learn.engine=\"lanes\"", "a=", "a=b=c"})
    EXPECT_EQ(refusal([&] { check_override(good); }), "accepted") << good;
  for (const char* bad : {"fly=/etc/passwd", "fly=\"../../secret.toml\"", "fly=\"\\u002fetc\"", "fly=a\nb=1", "fly=.."})
    EXPECT_NE(refusal([&] { check_override(bad); }).find(" may name a file; accepted: "), std::string::npos) << bad;
  for (const char* bad : {"", "=1", "a", "--out=x", "a b=1", "../a=1", "a/b=1"})
    EXPECT_NE(refusal([&] { check_override(bad); }).find(" is not KEY=VALUE; accepted: as a.b=1"), std::string::npos)
        << bad;
  EXPECT_NE(refusal([&] { check_override("a=" + std::string(255, '1')); }).find("accepted: at most 256"),
            std::string::npos);
}

TEST(ServerConfig, ShippedOneIsRead) {
  const io::TemporaryFolder folder;
  const std::string output = "jobs.output=\"" + (folder / "runs").string() + "\"";
  const ServerConfig c = read_server_config(FLAPPY_SOURCE_DIR "/configs/server/local.toml", {output});
  EXPECT_EQ(c.jobs.folders.configs, fs::canonical(FLAPPY_SOURCE_DIR "/configs"));
  EXPECT_EQ(c.jobs.backend, BackendKind::local);
  EXPECT_EQ(c.http.listen, "");  // nothing listens unless asked
}

TEST(ServerConfig, RefusesInOneLine) {
  const io::TemporaryFolder folder;
  const fs::path file = folder / "server.toml";
  const auto refused = [&](const std::string& jobs, const std::string& more = "") {
    io::write_atomically(file, "schema = 1\n[jobs]\nconfigs = \".\"\noutput = \"out\"\n" + jobs + "\n" + more);
    const std::string line = refusal([&] { read_server_config(file); });
    return line.starts_with(file.string()) ? line.substr(file.string().size()) : line;
  };
  EXPECT_EQ(refused(""), "accepted");
  EXPECT_EQ(refused("at_onse = 2").substr(0, 33), ":5:1: jobs.at_onse: unknown key; ");
  EXPECT_EQ(refused("data = \"none\"").substr(0, 31), ":5:8: jobs.data: is no folder; ");
  EXPECT_NE(refused("backend = \"cloud\"").find("jobs.backend: "), std::string::npos);
  EXPECT_NE(refused("sbatch = [\"--time=1\"]").find("jobs.sbatch: is of no use here; accepted: backend = \"slurm\""),
            std::string::npos);
  EXPECT_NE(refused("backend = \"slurm\"\nsbatch = [\"/bin/sh\"]").find("holds what is no option"), std::string::npos);
  EXPECT_NE(refused("", "[dds]\ndomain = 233").find("dds.domain: 233 is out of range"), std::string::npos);
}

}  // namespace
}  // namespace flappy::server
