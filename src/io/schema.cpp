#include "io/schema.hpp"

#include <nlohmann/json.hpp>

#include "io/version.hpp"  // made by the build

namespace flappy::io {

std::string other_schema(std::int64_t given, std::int64_t read, const std::string& commit) {
  const std::string number = std::to_string(given);
  if (!commit.empty()) return number + " is read by flappy at commit " + commit + ", which wrote it";
  // Every format is at its first schema. Whoever raises one must name here the last commit that read the schema before.
  return number + (given > read ? " is read by a newer flappy than this one" : " is read by no flappy");
}

std::string writer_reads(const std::string& commit) {
  if (commit.empty() || commit == FLAPPY_COMMIT) return "";
  return "; flappy at commit " + commit + " wrote it, and reads it";
}

std::string commit_of_run(const std::filesystem::path& folder) {
  try {
    return nlohmann::json::parse(read_text(folder / "run.json")).at("commit").get<std::string>();
  } catch (const std::exception&) {
    return "";
  }
}

}  // namespace flappy::io
