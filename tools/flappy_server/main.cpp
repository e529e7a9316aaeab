// flappy-server: runs a queue of jobs, each in a process of its own, and serves a dashboard.
#include <cstdio>
#include <optional>

#include "io/installation.hpp"
#include "io/log.hpp"
#include "io/program.hpp"
#include "io/progress.hpp"
#include "server/commands/command_server.hpp"
#include "server/http/command_socket.hpp"
#include "server/http/dashboard.hpp"
#include "server/jobs/commands.hpp"
#include "server/jobs/runner.hpp"
#include "server/jobs/supervisor.hpp"

int main(int argc, char** argv) {
  using namespace flappy;
  server::supervise_if_asked(argc, argv);  // does not return if this process is a job's supervisor

  io::Program program("flappy-server", "Runs a queue of jobs: trainings, evaluations, exports, diagnoses.", {});
  std::string config_name, listen;
  std::vector<std::string> overrides;
  program.app().option("config", config_name, "what may run, and where: configs/server/*.toml").required();
  program.app().option("--http", listen, "dashboard to look at: 127.0.0.1:8080; else http.listen, else none");
  program.app().option("--set", overrides, "override a key: jobs.at_once=2").one_at_a_time();
  return program.run(argc, argv, [&] {
    server::ServerConfig config = server::read_server_config(config_name, overrides);
    if (!listen.empty()) config.http.listen = listen;
    io::stop_on_interrupt();
    server::Queue queue(config.jobs.folders.output);
    io::log_into(config.jobs.folders.output);
    server::Runner runner(queue, {config.jobs, io::beside_program("bin/flappy-server"), io::beside_program("bin")});
    server::Commands commands(queue, config, io::beside_program("bin"));
    server::LiveState watched;
    std::optional<server::Dashboard> dashboard;
    if (!config.http.listen.empty()) {
      dashboard.emplace(queue, watched, config);
      std::printf("dashboard: http://%s/\n", dashboard->address().c_str());
    }
    const server::CommandSocket socket(commands, config.jobs.folders.output);
    std::optional<server::CommandServer> command_server;
    if (config.dds.enabled) command_server.emplace(config.dds, commands, watched);
    std::printf("%s: %zu jobs to go on with\n", config.jobs.folders.output.c_str(),
                queue.jobs_in(server::State::running).size() + queue.jobs_in(server::State::queued).size());
    std::fflush(stdout);
    runner.run([] { return !io::interrupted(); });
    std::printf("stopped; go on: the same command\n");
  });
}
