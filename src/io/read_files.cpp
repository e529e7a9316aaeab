#include "io/read_files.hpp"

#include <sys/stat.h>

#include <algorithm>
#include <map>
#include <mutex>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include "io/files.hpp"

namespace flappy::io {
namespace {

namespace fs = std::filesystem;
using Identity = std::pair<dev_t, ino_t>;

struct Notes {
  std::map<Identity, fs::path> read, announced;
  std::set<Identity> written;
  std::vector<fs::path> own_folders;
};

std::mutex notes_mutex;      // files are read in several threads
std::optional<Notes> notes;  // none outside of a command

std::optional<Identity> identity_of(const fs::path& file) {
  struct stat status {};
  if (stat(file.c_str(), &status) != 0) return std::nullopt;
  return Identity{status.st_dev, status.st_ino};
}

fs::path true_path(const fs::path& path) {
  std::error_code failed;
  const fs::path found = fs::weakly_canonical(path.has_filename() ? path : path.parent_path(), failed);
  return failed ? path : found;
}

bool lies_in(const fs::path& file, const fs::path& folder) {
  const auto [end, rest] = std::ranges::mismatch(folder, file);
  return end == folder.end();
}

[[noreturn]] void refuse_output(const fs::path& file) {
  throw InputError(file.string() + ": is read by the same command; accepted: another file");
}

/// Whether this is a file that was read; not one that only has the number of a removed file.
bool was_read(const fs::path& file) {
  const auto identity = identity_of(file);
  if (!identity) return false;
  const auto found = notes->read.find(*identity);
  if (found == notes->read.end()) return false;
  if (identity_of(found->second) == identity) return true;
  notes->read.erase(found);
  return false;
}

}  // namespace

NotedCommand::NotedCommand() {
  const std::scoped_lock lock(notes_mutex);
  notes.emplace();
}

NotedCommand::~NotedCommand() {
  const std::scoped_lock lock(notes_mutex);
  notes.reset();
}

void note_read(const fs::path& file) {
  const std::scoped_lock lock(notes_mutex);
  if (!notes) return;
  const auto identity = identity_of(file);
  if (!identity || notes->written.contains(*identity)) return;
  if (const auto output = notes->announced.find(*identity); output != notes->announced.end())
    refuse_output(output->second);
  notes->read.insert_or_assign(*identity, true_path(file));
}

void note_written(const fs::path& file) {
  const std::scoped_lock lock(notes_mutex);
  if (!notes) return;
  if (const auto identity = identity_of(file)) notes->written.insert(*identity);
}

void note_own_folder(const fs::path& folder) {
  const std::scoped_lock lock(notes_mutex);
  if (notes) notes->own_folders.push_back(true_path(folder));
}

void require_unread(const fs::path& file) {
  const std::scoped_lock lock(notes_mutex);
  if (!notes || !was_read(file)) return;
  const fs::path whole = true_path(file);
  if (std::ranges::none_of(notes->own_folders, [&](const fs::path& own) { return lies_in(whole, own); }))
    refuse_output(file);
}

void announce_output(const fs::path& file) {
  const std::scoped_lock lock(notes_mutex);
  if (!notes) return;
  if (was_read(file)) refuse_output(file);
  if (const auto identity = identity_of(file)) notes->announced.emplace(*identity, file);
}

void require_unread_folder(const fs::path& folder) {
  const std::scoped_lock lock(notes_mutex);
  if (!notes) return;
  const fs::path whole = true_path(folder);
  for (const auto& [identity, file] : notes->read)
    if (lies_in(file, whole) && identity_of(file) == identity)
      throw InputError(folder.string() + ": holds " + file.filename().string() +
                       ", which is read by the same command; accepted: another folder");
}

void allow_update(const fs::path& file) {
  const std::scoped_lock lock(notes_mutex);
  if (!notes) return;
  if (const auto identity = identity_of(file)) notes->read.erase(*identity);
}

}  // namespace flappy::io
