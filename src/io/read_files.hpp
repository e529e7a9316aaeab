// Which files a command reads, so that none of its outputs replaces one of them.
//
// Readers (read_text, MappedFile, Checkpoint) note what they open; writers (check_output, AtomicFile, AppendFile that
// begins anew) refuse what was noted, under any of its names. An output that check_output() announced is refused as
// soon as it is read. What the command wrote itself it may read and write again, and in a folder that is its own, as a
// run folder that it has locked, it may replace what an earlier run left.
//
// Nothing is noted outside of a NotedCommand: a program has one, Python has none.
#pragma once

#include <filesystem>

namespace flappy::io {

class NotedCommand {
 public:
  NotedCommand();
  ~NotedCommand();
  NotedCommand(const NotedCommand&) = delete;
  NotedCommand& operator=(const NotedCommand&) = delete;
};

/// InputError where the file is an output that was announced.
void note_read(const std::filesystem::path& file);
void note_written(const std::filesystem::path& file);
void note_own_folder(const std::filesystem::path& folder);

/// InputError "FILE: is read by the same command; accepted: another file" where a user's file would be replaced.
void require_unread(const std::filesystem::path& file);
/// The same for an output that the user names; its own folder excuses it not.
void announce_output(const std::filesystem::path& file);
/// InputError where something in the folder was read: for who replaces the folder.
void require_unread_folder(const std::filesystem::path& folder);
/// Allows to replace the file although it is read.
void allow_update(const std::filesystem::path& file);

}  // namespace flappy::io
