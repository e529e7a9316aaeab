#include "server/jobs/job_client.hpp"

#include <algorithm>
#include <cstdio>
#include <random>

#include "io/files.hpp"
#include "io/log.hpp"
#include "server/jobs/job.hpp"

namespace flappy::server {

namespace fs = std::filesystem;

namespace {
constexpr int kDownloads = 3;  // of a file that is replaced while it comes
}

std::size_t JobClient::fetch(std::uint64_t job, const fs::path& folder,
                             const std::function<void(const JobFile&)>& see) {
  std::size_t fetched = 0;
  for (const JobFile& file : list_files(job)) {
    see(file);
    const fs::path path = place_of(folder, file.name);
    Download got = Download::changed;
    for (int i = 0; i < kDownloads && got == Download::changed; ++i) {
      io::AtomicFile to(path);
      got = download(job, file.name, [&](std::string_view bytes) { to.write(bytes); });
      if (got == Download::whole) to.commit();
    }
    if (got == Download::gone) io::log(io::LogLevel::warning, file.name + ": is gone meanwhile, and is left out");
    if (got == Download::changed)
      throw io::InputError(file.name + ": changes while it is fetched; accepted: the same once more");
    fetched += got == Download::whole;
  }
  return fetched;
}

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
