// Submits jobs with sbatch, under a name of queue and job. If the server is killed before it has recorded sbatch's
// answer, the next finds the job by its name; a running sbatch holds the lock of the job's folder; Slurm runs one job
// of a name at a time (singleton). The supervisor writes the exit code into the folder, which all nodes share.
#include <algorithm>
#include <cerrno>
#include <chrono>
#include <map>
#include <optional>
#include <system_error>
#include <thread>
#include <utility>

#include "io/files.hpp"
#include "io/progress.hpp"
#include "io/run_program.hpp"
#include "server/jobs/backend.hpp"
#include "server/jobs/supervisor.hpp"

namespace flappy::server {
namespace {

namespace fs = std::filesystem;

constexpr double kLookEvery_s = 2;   ///< between calls of squeue, which lists all jobs at once
constexpr double kMissing_s = 6;     ///< from when on a job missing in squeue is gone: its exit file may arrive late
constexpr double kPatience_s = 120;  ///< longest wait for sbatch

std::string quoted(const std::string& word) {
  std::string text = "'";
  for (const char c : word) c == '\'' ? text += "'\\''" : text += c;
  return text + "'";
}

class SlurmBackend : public Backend {
 public:
  SlurmBackend(const std::string& queue, const JobsConfig& config) : queue_(queue), config_(config) {}

  void start(Queue& queue, const Job& job, const fs::path& folder, const std::vector<std::string>& supervisor,
             const JobLock& lock) override {
    std::string script = "exec";
    for (const std::string& word : supervisor) script += " " + quoted(word);
    std::vector<std::string> command = {
        "sbatch",       "--parsable",         "--job-name=" + name_of(job), "--dependency=singleton",
        "--no-requeue", "--open-mode=append", "--chdir=" + folder.string(), "--output=" + (folder / kLogName).string()};
    if (config_.threads > 0) command.push_back("--cpus-per-task=" + std::to_string(config_.threads));
    command.insert(command.end(), config_.sbatch.begin(), config_.sbatch.end());
    command.push_back("--wrap=" + script);

    const fs::path answer = folder / "sbatch.log";
    std::error_code none;
    fs::remove(answer, none);
    const std::int64_t pid = start_process(command, &lock, answer);
    const double from = io::steady_seconds();
    while (!has_ended(pid)) {
      // stop waiting: look() finds the job by its name, or the folder's lock is free again
      if (io::steady_seconds() > from + kPatience_s) return;
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
    std::string text = io::read_text(answer);
    while (!text.empty() && text.back() == '\n') text.pop_back();
    const std::string line = text.substr(text.rfind('\n') + 1), id = line.substr(0, line.find(';'));
    if (id.empty() || id.find_first_not_of("0123456789") != std::string::npos)
      throw io::InputError("sbatch: " + shown(line));
    queue.batched_as(job.id, id);
    looked_s_.reset();
  }

  Life look(Queue& queue, const Job& job, const fs::path& folder) override {
    if (exit_of(folder, job.attempts)) return Life::gone;
    if (!JobLock::take(folder)) return Life::alive;  // sbatch still runs
    if (!look_at_all()) return Life::unknown;
    if (const auto found = listed_.find(name_of(job)); found != listed_.end()) {
      missing_since_s_.erase(job.id);
      if (job.batch_id != found->second.id) queue.batched_as(job.id, found->second.id);
      return Life::alive;
    }
    const double now = io::steady_seconds();
    const auto [missing, first] = missing_since_s_.emplace(job.id, now);
    if (now < missing->second + kMissing_s) return Life::unknown;
    missing_since_s_.erase(missing);
    return Life::gone;
  }

  bool stop(const Job& job, bool kill) override {
    const auto found = listed_.find(name_of(job));
    if (found == listed_.end()) return false;
    std::vector<std::string> command = {"scancel"};
    // the batch script is the supervisor, because exec replaced its shell
    if (!kill && found->second.state == "RUNNING") command.insert(command.end(), {"--batch", "--signal=INT"});
    command.push_back(found->second.id);
    return ask(command).has_value();
  }

  bool is_local() const override { return false; }

 private:
  struct Listed {
    std::string id, state;
  };

  std::string name_of(const Job& job) const { return "flappy-" + queue_ + "-" + std::to_string(job.id); }

  /// Stdout of one of Slurm's programs; nothing where it fails.
  static std::optional<std::string> ask(const std::vector<std::string>& command) {
    try {
      const io::Finished finished = io::run(command);
      if (finished.exit_code == 0) return finished.out;
    } catch (const std::system_error&) {
    }
    return std::nullopt;
  }

  bool look_at_all() {
    const double now = io::steady_seconds();
    if (looked_s_ && now < *looked_s_ + kLookEvery_s) return answered_;
    looked_s_ = now;
    const auto text = ask({"squeue", "--noheader", "--me", "--format=%j|%i|%T"});
    answered_ = text.has_value();
    if (!answered_) return false;
    listed_.clear();
    for (std::size_t at = 0; at < text->size();) {
      const std::size_t end = std::min(text->find('\n', at), text->size());
      const std::string line = text->substr(at, end - at);
      at = end + 1;
      const std::size_t first = line.find('|'), second = line.find('|', first + 1);
      if (second == std::string::npos) continue;
      const Listed found{line.substr(first + 1, second - first - 1), line.substr(second + 1)};
      Listed& kept = listed_[line.substr(0, first)];
      // two attempts may be listed while the earlier one ends; the later one has the larger id
      if (std::pair(found.id.size(), found.id) > std::pair(kept.id.size(), kept.id)) kept = found;
    }
    return true;
  }

  std::string queue_;
  JobsConfig config_;
  std::map<std::string, Listed> listed_;  ///< [job name]
  std::map<std::uint64_t, double> missing_since_s_;
  std::optional<double> looked_s_;
  bool answered_ = false;
};

}  // namespace

std::unique_ptr<Backend> slurm_backend(const std::string& queue, const JobsConfig& config) {
  return std::make_unique<SlurmBackend>(queue, config);
}

}  // namespace flappy::server
