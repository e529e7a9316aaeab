// Jobs of a shell script in place of our programs: it keeps its steps as a training does its checkpoints, and notes what must not be.
//
//   starts, ends   a line for each time that it began, and came to its end
//   steps          1, 2, 3, ...: its checkpoint
//   faults         what went wrong: two at a time
#pragma once

#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <filesystem>
#include <functional>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include "io/files.hpp"
#include "io/progress.hpp"
#include "io/temporary_folder.hpp"
#include "server/jobs/commands.hpp"
#include "server/jobs/runner.hpp"
#include "server/jobs/supervisor.hpp"

namespace flappy::server::test {

namespace fs = std::filesystem;

/// sh -c kScript sh FOLDER STEPS HOW
inline constexpr const char* kScript = R"sh(
cd "$1"
echo start >> starts
if ! mkdir busy 2> /dev/null && grep -qs ') [RSDT] ' "/proc/$(cat busy/pid)/stat"; then echo "two at a time" >> faults; fi
mkdir -p busy
echo $$ > busy/pid
trap 'echo "{\"stopped\": true}" > result.json; exit 0' INT
[ "$3" = deaf ] && trap '' INT
step=$(cat steps 2> /dev/null | wc -l)
while [ "$step" -lt "$2" ]; do
  step=$((step + 1))
  echo $step >> steps
  echo "worked $((100 * step / $2)) %, soon done" >&2
  [ "$3" = crash ] && kill -SEGV $$
  [ "$3" = once ] && [ "$step" = 2 ] && exit 75
  sleep 0.02
done
[ "$3" = mistake ] && echo "x.toml:1:1: key: is wrong; accepted: right" >&2 && exit 2
echo end >> ends
rm -r busy
[ "$3" = fault ] && exit 1
echo '{"stopped": false}' > result.json
[ "$3" = answer ] && exit 1
exit 0
)sh";

/// The kind "fake": config is HOW, and the override steps=N.
inline std::vector<JobType> fake_kinds() {
  return {{"fake",
           [](const Launch& launch) {
             const std::string steps = launch.asked.overrides.empty() ? "5" : launch.asked.overrides[0].substr(6);
             return std::vector<std::string>{"/bin/sh",          "-c", kScript, "sh", launch.folder.string(), steps,
                                             launch.asked.config};
           },
           true, 1}};
}

/// A folder for configurations, output and flights, and a server of fake jobs on it.
struct Place {
  Place() {
    for (const char* name : {"configs", "output", "data"}) fs::create_directory(root / name);
    config.jobs.folders = {fs::canonical(root / "configs"), fs::canonical(root / "output"),
                           fs::canonical(root / "data")};
    config.jobs.grace_s = 0.3;
    config.jobs.at_once = 5;
  }
  RunnerOptions options() const {
    return {config.jobs, fs::path(FLAPPY_BUILD_DIR) / "bin/flappy-server", "/nowhere", fake_kinds()};
  }
  fs::path output() const { return config.jobs.folders.output; }
  fs::path folder(std::uint64_t id) const { return output() / std::to_string(id); }

  io::TemporaryFolder root;
  ServerConfig config;
};

inline Submission fake(const std::string& client_id, const std::string& how = "well", int steps = 5) {
  return {client_id, "fake", how, {"steps=" + std::to_string(steps)}};
}

inline std::string text_of(const fs::path& file) { return fs::exists(file) ? io::read_text(file) : ""; }

/// Steps until it is so; false where it takes too long.
inline bool run_until(Runner& runner, const std::function<bool()>& so, double most_s = 20) {
  const double until_s = io::steady_seconds() + most_s;
  while (!so()) {
    if (io::steady_seconds() > until_s) return false;
    runner.step();
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  return true;
}

/// "1\n2\n...N\n"
inline std::string counted(int n) {
  std::string text;
  for (int i = 1; i <= n; ++i) text += std::to_string(i) + "\n";
  return text;
}

}  // namespace flappy::server::test
