// A job's status as JSON, as the socket and flappy-job write it.
#pragma once

#include <nlohmann/json.hpp>

#include "server/jobs/commands.hpp"

namespace flappy::server {

nlohmann::ordered_json json_of(const JobStatus& status);
JobStatus status_from(const nlohmann::ordered_json& json);

}  // namespace flappy::server
