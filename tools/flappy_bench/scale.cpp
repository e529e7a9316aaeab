#include "scale.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <system_error>

#include "io/files.hpp"
#include "io/installation.hpp"
#include "io/run_program.hpp"
#include "io/temporary_folder.hpp"
#include "io/text.hpp"
#include "server/jobs/queue.hpp"

namespace flappy::bench {
namespace {

using Words = std::vector<std::string>;

/// The command of one size, and what has to be there before it is timed.
struct Scale {
  std::string what;
  std::vector<double> sizes;
  std::function<Words(double size, const std::filesystem::path& folder)> command;
};

std::string text(double value) { return io::format("%.0f", value); }
std::string config(const char* name) { return io::config_path(name); }
std::string program(const char* name) { return io::beside_program(std::string("bin/") + name); }

/// Peak memory. `what`: for the message of the io::InputError that it throws if the program fails.
double run(const Words& command, const std::string& what) {
  try {
    io::Finished done = io::run(command);
    if (done.exit_code == 0) return done.peak_bytes;
    while (done.err.ends_with('\n')) done.err.pop_back();
    const std::string last = done.err.substr(done.err.rfind('\n') + 1);
    throw io::InputError(what + ": " + command[0] + " ended " +
                         (done.exit_code < 0 ? "by a signal" : "with " + std::to_string(done.exit_code)) + ": " + last);
  } catch (const std::system_error& error) {
    throw io::InputError(what + ": " + command[0] + ": " + error.code().message() +
                         "; accepted: a build with all programs");
  }
}

/// A log of a figure eight, with all that a diagnosis needs.
std::string flown(double seconds, int seed, const std::filesystem::path& folder) {
  const std::string log = (folder / ("log_" + text(seconds) + "_" + std::to_string(seed))).string();
  if (!std::filesystem::exists(log))
    run({program("flappy-fly"), config("fly/figure_eight.toml"), "--set", "flight.duration_s=" + text(seconds), "--set",
         "flight.seed=" + std::to_string(seed), "--log", log},
        "a log of " + text(seconds) + " s");
  return log;
}

Words diagnosis(const Words& flights, const std::filesystem::path& folder) {
  Words command = {
      program("flappy-gap"),           "diagnose", "--vehicle", config("vehicles/hummingbird_identified.toml"), "--out",
      (folder / "diagnosis").string(), "--flights"};
  command.insert(command.end(), flights.begin(), flights.end());
  return command;
}

std::vector<Scale> all_scales() {
  return {
      {"flappers",
       {1024, 4096, 16384, 65536, 262144, 1000000},
       [](double size, const auto&) {
         return Words{program("flappy-bench"), "batch", config("sim/hover_batch.toml"), "--set", "count=" + text(size)};
       }},
      {"updates",
       {1000, 2000, 4000, 8000, 16000},
       [](double size, const auto& folder) {
         return Words{program("flappy-train"),
                      config("train/escape.toml"),
                      "--out",
                      (folder / text(size)).string(),
                      "--set",
                      "learn.updates=" + text(size),
                      "--set",
                      "evaluate.every=" + text(size)};
       }},
      {"seconds of log in a diagnosis",
       {10, 30, 100, 300},
       [](double size, const auto& folder) { return diagnosis({flown(size, 1, folder)}, folder); }},
      {"seconds of log in a page",
       {10, 60, 600, 3600},
       [](double size, const auto& folder) {
         return Words{program("flappy-report"), flown(size, 1, folder), "--out", (folder / "page.html").string()};
       }},
      {"flights of 5 s in a diagnosis",
       {3, 10, 30, 100},
       [](double size, const auto& folder) {
         Words flights;
         for (int seed = 1; seed <= static_cast<int>(size); ++seed) flights.push_back(flown(5, seed, folder));
         return diagnosis(flights, folder);
       }},
      {"jobs in a queue",
       {10, 100, 1000, 10000, 100000},
       [](double size, const auto&) {
         return Words{program("flappy-bench"), "scale", "--jobs", text(size)};
       }},
  };
}

}  // namespace

std::vector<std::string> scales() {
  std::vector<std::string> names;
  for (const Scale& s : all_scales()) names.push_back(s.what);
  return names;
}

std::vector<ScaleRow> measure_scale(const std::vector<std::string>& of, double share,
                                    const std::function<void(double done, const std::string& now)>& tell) {
  for (const std::string& what : of)
    if (const std::vector<std::string> known = scales(); std::ranges::count(known, what) == 0)
      throw io::InputError("--of " + what + ": is not known; accepted: " + io::joined(known));
  std::vector<ScaleRow> rows;
  double begun = 0;
  for (const Scale& s : all_scales()) {
    if (!of.empty() && std::ranges::count(of, s.what) == 0) continue;
    const io::TemporaryFolder folder;
    for (const double size : s.sizes) {
      if (size > share * s.sizes.back()) break;
      tell(begun / static_cast<double>(of.empty() ? scales().size() : of.size()), text(size) + " " + s.what);
      const Words command = s.command(size, folder.path());
      const auto from = std::chrono::steady_clock::now();
      const double peak_bytes = run(command, text(size) + " " + s.what);
      ScaleRow row{
          s.what, size, {}, std::chrono::duration<double>(std::chrono::steady_clock::now() - from).count(), peak_bytes};
      for (const std::string& word : command)
        if (word.find(folder.path().string()) == std::string::npos)
          row.command += (row.command.empty() ? "" : " ") + std::filesystem::path(word).filename().string();
      rows.push_back(std::move(row));
    }
    begun += 1;
  }
  return rows;
}

void pass_jobs(std::size_t jobs) {
  const io::TemporaryFolder folder;
  server::Queue queue(folder.path());
  for (std::size_t i = 0; i < jobs; ++i) {
    const std::uint64_t id = queue.submit({"job " + std::to_string(i), "train", "train/escape.toml", {}});
    queue.start(id);
    queue.end(id, {});
    if (i % 100 == 0) queue.jobs(100);
  }
}

double growth(const ScaleRow& from, const ScaleRow& to) {
  return std::log(to.seconds / from.seconds) / std::log(to.size / from.size);
}

}  // namespace flappy::bench
