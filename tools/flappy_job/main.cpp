// flappy-job: sends commands to a flappy-server, on this machine or another.
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>

#include "io/program.hpp"
#include "io/progress.hpp"
#include "server/commands/command_client.hpp"
#include "server/http/socket_client.hpp"
#include "server/jobs/status_json.hpp"

namespace flappy::job {
namespace {

void print(const server::JobStatus& j) {
  std::printf("%6llu  %-9s %-9s %4.0f %%  %-32s %s\n", static_cast<unsigned long long>(j.id), j.state.c_str(),
              j.kind.c_str(), 100 * j.progress, j.config.c_str(), j.message.c_str());
  std::fflush(stdout);
}

bool is_over(const server::JobStatus& j) { return j.state == "done" || j.state == "failed" || j.state == "cancelled"; }

/// Over DDS if one of its keys is given, else over the socket in the folder of jobs.
std::unique_ptr<server::JobClient> client_of(const std::string& jobs, const std::vector<std::string>& dds,
                                             double timeout_s) {
  if (dds.empty()) return std::make_unique<server::SocketClient>(jobs, timeout_s);
  std::vector<std::string> overrides = {"dds.enabled=true"};
  for (const std::string& each : dds) overrides.push_back("dds." + each);
  const io::Config config = io::Config::parse("", "--dds", overrides);
  const io::DdsConfig where = io::read_dds_config(config.root());
  config.root().finish();
  return std::make_unique<server::CommandClient>(where, timeout_s);
}

}  // namespace
}  // namespace flappy::job

int main(int argc, char** argv) {
  using namespace flappy;
  io::Program program("flappy-job", "Asks a flappy-server to run jobs, and fetches what they left.", {});
  const io::Command& app = program.app();
  std::vector<std::string> dds;
  double timeout_s = 5;
  std::string jobs = server::kJobsFolder;
  app.option("--jobs", jobs, "the server's folder of jobs, on this machine").shows_default();
  app.option("--dds", dds, "of a server with dds.enabled, where it is, as a key of [dds]: domain=3, reach=network")
      .one_at_a_time();
  app.option("--timeout", timeout_s, "seconds without an answer").range(0.1, 3600.0).shows_default();

  server::Command asked;
  std::string out;
  std::uint64_t watched = 0;
  constexpr std::uint64_t kLastJob = 999'999'999;
  const io::Command submit = app.command("submit", "a new job; prints its number");
  submit.option("kind", asked.kind, "train, evaluate, export or diagnose").required();
  submit.option("config", asked.config, "train/escape.toml, below the server's folder; of others a job's number: 7")
      .required();
  submit.option("--set", asked.overrides, "override a key: learn.updates=1000").one_at_a_time();
  submit.option("--id", asked.id, "the same one twice is one job");
  const io::Command list = app.command("list", "all jobs, newest first");
  const io::Command watch = app.command("watch", "jobs as they change; one of them until it is over");
  watch.option("job", watched, "its number").range(std::uint64_t{1}, kLastJob);
  std::vector<std::pair<io::Command, const char*>> verbs;
  for (const auto& [verb, help] : {std::pair{"pause", "stops a job cleanly, to go on later"},
                                   std::pair{"resume", "goes on with a job that is paused or failed"},
                                   std::pair{"cancel", "ends a job for good"}}) {
    verbs.emplace_back(app.command(verb, help), verb);
    verbs.back().first.option("job", asked.job, "its number").required().range(std::uint64_t{1}, kLastJob);
  }
  const io::Command fetch = app.command("fetch", "the files that a job left");
  fetch.option("job", asked.job, "its number").required().range(std::uint64_t{1}, kLastJob);
  fetch.option("--out", out, "folder for them").required();
  app.expect_commands(1, 1);

  return program.run(argc, argv, [&] {
    const std::unique_ptr<server::JobClient> client = job::client_of(jobs, dds, timeout_s);

    if (list.given()) {
      nlohmann::ordered_json all = nlohmann::ordered_json::array();
      for (const server::JobStatus& each : client->list()) job::print(each), all.push_back(json_of(each));
      return program.write_json({{"jobs", all}});
    }
    if (watch.given()) {
      io::stop_on_interrupt();
      bool over = false, exists = watched == 0;
      for (const server::JobStatus& each : client->list())
        if (watched == 0 || each.id == watched)
          exists = true, job::print(each), over |= each.id == watched && job::is_over(each);
      if (!exists)
        throw io::InputError(std::to_string(watched) + ": no such job; accepted: those that flappy-job list shows");
      if (!over)
        client->watch(
            [&](const server::JobStatus& each) {
              if (watched != 0 && each.id != watched) return true;
              job::print(each);
              return watched == 0 || !job::is_over(each);
            },
            [] { return !io::interrupted(); });
      return;
    }
    if (fetch.given()) {
      const std::size_t count = client->fetch(asked.job, out, [](const server::JobFile& file) {
        std::printf("%12llu  %s\n", static_cast<unsigned long long>(file.bytes), file.name.c_str());
      });
      std::printf("%zu files in %s\n", count, out.c_str());
      return program.write_json({{"job", asked.job}, {"files", count}});
    }
    asked.verb = "submit";
    for (const auto& [command, verb] : verbs)
      if (command.given()) asked.verb = verb;
    const server::CommandResult result = client->ask(asked);
    if (!result.accepted) throw io::InputError(result.message);
    std::printf("%s\n", result.message.c_str());
    program.write_json({{"id", result.id}, {"job", result.job}, {"message", result.message}});
  });
}
