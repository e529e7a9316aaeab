#include "server/jobs/job_types.hpp"

#include <algorithm>
#include <fstream>
#include <nlohmann/json.hpp>

#include "io/config.hpp"
#include "io/files.hpp"
#include "server/jobs/names.hpp"
#include "server/jobs/supervisor.hpp"

namespace flappy::server {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;
using Words = std::vector<std::string>;

std::string program(const Launch& launch, const char* name) { return (launch.programs / name).string(); }

void add(Words& words, std::initializer_list<std::string> more) { words.insert(words.end(), more); }

std::string key_of(const std::string& override) { return override.substr(0, override.find('=')); }
std::string value_of(const std::string& override) { return override.substr(override.find('=') + 1); }

[[noreturn]] void refuse_override(const std::string& override, const std::string& accepted) {
  throw io::InputError("override: \"" + override + "\" is not accepted here; accepted: " + accepted);
}

/// The run folder that the config names: that of a training job, or one that was put below the output folder.
std::string run_of(const Launch& launch) {
  const fs::path found = below(launch.folders.output, launch.asked.config, "config");
  const fs::path run = fs::is_directory(found / "run") ? found / "run" : found;
  if (!fs::is_regular_file(run / "run.json"))
    throw io::InputError("config: \"" + launch.asked.config +
                         "\" holds no run; accepted: a job that trained, or a run's name");
  return run.string();
}

Words train(const Launch& launch) {
  const fs::path config = below(launch.folders.configs, launch.asked.config, "config"), run = launch.folder / "run";
  if (!fs::is_regular_file(config))
    throw io::InputError("config: \"" + launch.asked.config + "\" is no file; accepted: a configuration of training");
  Words words = {program(launch, "flappy-train")};
  if (fs::exists(run / "run.json")) {
    add(words, {"--resume", run.string()});
  } else {
    add(words, {config.string(), "--out", run.string()});
    for (const std::string& override : launch.asked.overrides) add(words, {"--set", override});
  }
  add(words, {"--threads", std::to_string(launch.threads), "--json", (launch.folder / kResult).string(), "--progress",
              (launch.folder / kProgress).string()});
  return words;
}

Words evaluate(const Launch& launch) {
  Words words = {program(launch, "flappy-eval"), run_of(launch)};
  for (const std::string& override : launch.asked.overrides) {
    const std::string key = key_of(override), value = value_of(override);
    if (key != "episodes" && key != "seed") {
      add(words, {"--set", override});
      continue;
    }
    if (value.empty() || value.size() > 18 || value.find_first_not_of("0123456789") != std::string::npos)
      refuse_override(override, key + "=N");
    add(words, {"--" + key, value});
  }
  add(words, {"--threads", std::to_string(launch.threads), "--json", (launch.folder / kResult).string(), "--progress",
              (launch.folder / kProgress).string()});
  return words;
}

Words export_policy(const Launch& launch) {
  Words words = {program(launch, "flappy-export"), run_of(launch), "--out", (launch.folder / "exported").string()};
  for (const std::string& override : launch.asked.overrides) {
    if (override != "int8=true" && override != "prove=true") refuse_override(override, "int8=true, prove=true");
    words.push_back("--" + key_of(override));
  }
  add(words, {"--json", (launch.folder / kResult).string(), "--progress", (launch.folder / kProgress).string()});
  return words;
}

Words diagnose(const Launch& launch) {
  const fs::path vehicle = below(launch.folders.configs, launch.asked.config, "config");
  Words words = {program(launch, "flappy-gap"),
                 "diagnose",
                 "--vehicle",
                 vehicle.string(),
                 "--out",
                 (launch.folder / "diagnosis").string(),
                 "--threads",
                 std::to_string(launch.threads),
                 "--json",
                 (launch.folder / kResult).string(),
                 "--progress",
                 (launch.folder / kProgress).string()};
  if (launch.folders.data.empty())
    throw io::InputError("kind: this server has no flights; accepted: diagnose where jobs.data is set");
  Words flights = {"--flights"}, reference = {"--reference"};
  for (const std::string& override : launch.asked.overrides) {
    const std::string key = key_of(override);
    if (key != "flight" && key != "reference")
      refuse_override(override, "flight=NAME and reference=NAME, once for each flight");
    (key == "flight" ? flights : reference).push_back(below(launch.folders.data, value_of(override), key).string());
  }
  if (flights.size() == 1)
    throw io::InputError("overrides: name no flight; accepted: flight=NAME, once for each flight");
  words.insert(words.end(), flights.begin(), flights.end());
  if (reference.size() > 1) words.insert(words.end(), reference.begin(), reference.end());
  return words;
}

}  // namespace

const std::vector<JobType>& job_types() {
  static const std::vector<JobType> all = {
      {"train", train, true},
      {"evaluate", evaluate, true},
      {"export", export_policy, false},
      {"diagnose", diagnose, false, 1},
  };
  return all;
}

const JobType& job_type_named(const std::vector<JobType>& kinds, const std::string& name) {
  std::vector<std::string> names;
  for (const JobType& kind : kinds) {
    if (kind.name == name) return kind;
    names.push_back(kind.name);
  }
  throw io::InputError("kind: \"" + shown(name, kMaxOfKind) + "\" is unknown; accepted: " + io::joined(names) +
                       io::did_you_mean(shown(name, kMaxOfKind), names));
}

bool is_complete(const JobType& kind, const fs::path& folder, bool asked_to_stop) {
  if (!fs::is_regular_file(folder / kResult)) return false;
  if (!kind.says_stopped) return !asked_to_stop;
  const Json result = Json::parse(io::read_text(folder / kResult), nullptr, false);
  if (!result.is_object()) return false;
  const auto stopped = [](const Json& json) { return json.is_object() && json.value("stopped", false); };
  return !stopped(result) && !stopped(result.value("pid", Json())) && !stopped(result.value("arc", Json()));
}

Progress progress_of(const fs::path& folder) {
  const Json told = Json::parse(tail_of(folder / kProgress, 4096), nullptr, false);
  if (!told.is_object()) return {};  // the program has written nothing yet
  const auto share = told.value("share", Json()), message = told.value("message", Json());
  if (!share.is_number() || !message.is_string()) return {};
  return {std::clamp(share.get<double>(), 0.0, 1.0), message.get<std::string>()};
}

std::string tail_of(const fs::path& file, std::size_t most) {
  std::ifstream stream(file, std::ios::binary | std::ios::ate);
  if (!stream) return "";
  const auto size = static_cast<std::size_t>(std::max<std::streamoff>(0, stream.tellg()));
  const std::size_t from = size > most ? size - most : 0;
  stream.seekg(static_cast<std::streamoff>(from));
  std::string text(size - from, '\0');
  stream.read(text.data(), static_cast<std::streamsize>(text.size()));
  text.resize(static_cast<std::size_t>(stream.gcount()));
  if (from > 0) text.erase(0, text.find('\n') + 1);
  return text;
}

}  // namespace flappy::server
