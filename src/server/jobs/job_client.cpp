#include "server/jobs/job_client.hpp"

#include <algorithm>
#include <cstdio>
#include <random>

#include "io/files.hpp"
#include "server/jobs/job.hpp"

namespace flappy::server {

namespace fs = std::filesystem;

std::string fresh_id() {
  std::random_device random;
  std::string id;
  for (int i = 0; i < 4; ++i) {
    char text[9];
    std::snprintf(text, sizeof text, "%08x", random());
    id += text;
  }
  return id;
}

fs::path place_of(const fs::path& folder, const std::string& name) {
  const fs::path path(name);
  const bool odd = name.empty() || path.is_absolute() ||
                   std::ranges::any_of(path, [](const fs::path& part) { return part == ".." || part == "."; });
  if (odd) throw io::InputError("the server names a file \"" + shown(name) + "\"; accepted: names below a folder");
  io::make_folder((folder / path).parent_path());
  return folder / path;
}

}  // namespace flappy::server
