#include "io/program.hpp"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <nlohmann/json.hpp>

#include "io/files.hpp"
#include "io/log.hpp"
#include "io/parallel.hpp"
#include "io/progress.hpp"
#include "io/read_files.hpp"
#include "io/version.hpp"  // made by the build

namespace flappy::io {

namespace {

constexpr std::array<const char*, 4> kLevels = {"debug", "info", "warning", "error"};  // in the order of LogLevel

/// The fault of a command line, and what is accepted instead.
std::string explained(const CLI::App& app, const CLI::ParseError& error) {
  const CLI::App* at = &app;
  while (!at->get_subcommands().empty()) at = at->get_subcommands().front();
  std::vector<std::string> unknown = app.remaining(true);
  std::erase(unknown, "--");  // words after it are not options
  if (std::string_view(error.what()).starts_with("A subcommand is required")) {
    std::vector<std::string> names;
    for (const CLI::App* each : at->get_subcommands([](const CLI::App* each) { return !each->get_group().empty(); }))
      names.push_back(each->get_name());
    return (unknown.empty() ? error.what() : unknown.front() + ": no such command") + "; accepted: " + joined(names) +
           (unknown.empty() ? "" : did_you_mean(unknown.front(), names));
  }
  if (unknown.empty()) return error.what();
  const auto option = std::ranges::find_if(unknown, [](const std::string& word) { return word.starts_with("-"); });
  if (option == unknown.end())
    return unknown.front() + ": is not expected; accepted: a value after the option that takes it, one for each";
  std::vector<std::string> names;
  for (const CLI::App* each : {at, &app})
    for (const CLI::Option* o : each->get_options())
      if (!o->get_lnames().empty() && !o->get_group().empty()) names.push_back("--" + o->get_lnames().front());
  std::ranges::sort(names);
  names.erase(std::unique(names.begin(), names.end()), names.end());
  const std::string name = option->substr(0, option->find('='));
  return name + ": no such option; accepted: " + joined(names) + did_you_mean(name, names);
}

}  // namespace

std::string commit() { return FLAPPY_COMMIT; }

std::string hexadecimal(std::uint64_t value) {
  char text[17];
  std::snprintf(text, sizeof text, "%016llx", static_cast<unsigned long long>(value));
  return text;
}

Program::Program(const std::string& name, const std::string& description, const std::vector<std::string>& facts)
    : app_(std::make_unique<CLI::App>(description, name)) {
  std::string version = name + " " FLAPPY_VERSION "\ncommit " + commit() + "\ncompiler " + __VERSION__;
  for (const std::string& fact : facts) version += "\n" + fact;
  version += "\nCLI11 " CLI11_VERSION "\nnlohmann-json " + std::to_string(NLOHMANN_JSON_VERSION_MAJOR) + "." +
             std::to_string(NLOHMANN_JSON_VERSION_MINOR) + "." + std::to_string(NLOHMANN_JSON_VERSION_PATCH);
  app_->set_version_flag("--version", version);
  app().option("--json", json_path_, "write the results as JSON to this file");
  app().option("--progress", progress_path_, "tell in this file how far it is, as JSON, once a second");
  app_->add_option("--log-level", log_level_, "least level of what is noted on stderr")
      ->check(CLI::IsMember(std::vector<std::string>(kLevels.begin(), kLevels.end())))
      ->capture_default_str();
  app_->fallthrough();
}

Program::~Program() = default;

int Program::run(int argc, char** argv, const std::function<void()>& job) {
  const NotedCommand command;
  try {
    app_->parse(argc, argv);
    const auto level = std::ranges::find(kLevels, log_level_) - kLevels.begin();
    start_log(static_cast<LogLevel>(level), app_->get_name() + " " FLAPPY_VERSION ", commit " + commit() + ": " +
                                                joined(std::vector<std::string>(argv, argv + argc), " "));
    if (takes_ranks_) {
      rank_ = this_rank();
      share_processors(rank_.local_size);
      if (!writes()) {
        silence_progress();
        if (std::freopen("/dev/null", "w", stdout) == nullptr) throw InputError("/dev/null: cannot be written");
      }
    }
    if (!json_path_.empty() && writes()) check_output(json_path_);
    if (!progress_path_.empty() && writes()) {
      check_output(progress_path_);
      write_progress(progress_path_);
    }
    job();
    if (std::fflush(stdout) != 0 || std::ferror(stdout) != 0)
      throw InputError(std::string("stdout: cannot be written: ") + std::strerror(errno));
    if (ranks_) ranks_->finish();
    return 0;
  } catch (const CLI::ParseError& e) {
    if (e.get_exit_code() == 0) return app_->exit(e);  // --help, --version
    std::fprintf(stderr, "%s: %s; see %s --help\n", app_->get_name().c_str(), explained(*app_, e).c_str(),
                 app_->get_name().c_str());
    return 2;
  } catch (const InputError& e) {
    log_error(e.what());
    if (ranks_) ranks_->leave();
    return 2;
  } catch (const std::exception& e) {
    log_error(app_->get_name() + ": internal fault: " + e.what());
    if (ranks_) ranks_->leave();
    return 1;
  }
}

void Program::takes_ranks() {
  takes_ranks_ = true;
  app_->add_flag("--allow-network", allow_network_, "let ranks meet at a MASTER_ADDR that is not this machine's own");
}

Ranks* Program::ranks(const std::string& agreed) {
  if (rank_.size > 1 && !ranks_) ranks_ = meet(rank_, allow_network_, agreed + "commit: " + commit() + "\n");
  return ranks_.get();
}

void Program::write_shown_json(const nlohmann::ordered_json& result) const {
  write_json(result);
  if (!json_path_.empty() && writes()) std::printf("%s\n", shown_by(json_path_).c_str());
}

void Program::write_json(const nlohmann::ordered_json& result) const {
  if (json_path_.empty() || !writes()) return;
  announce_output(json_path_);
  write_atomically(json_path_, result.dump(2) + "\n");
}

std::string shown_by(const std::string& path) { return "shown by: flappy-report " + path + " --out report.html"; }

}  // namespace flappy::io
