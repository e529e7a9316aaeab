#include "server/jobs/status_json.hpp"

namespace flappy::server {

nlohmann::ordered_json json_of(const JobStatus& j) {
  return {{"id", j.id},
          {"kind", j.kind},
          {"config", j.config},
          {"state", j.state},
          {"attempts", j.attempts},
          {"exit_code", j.exit_code},
          {"progress", j.progress},
          {"message", j.message},
          {"folder", j.folder}};
}

JobStatus status_from(const nlohmann::ordered_json& j) {
  return {j.at("id"),        j.at("kind"),     j.at("config"),  j.at("state"), j.at("attempts"),
          j.at("exit_code"), j.at("progress"), j.at("message"), j.at("folder")};
}

}  // namespace flappy::server
