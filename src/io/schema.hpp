// Formats of files are numbered. What this program does not read is refused with what reads it.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include "io/files.hpp"

namespace flappy::io {

/// Of a schema that is not the one that is read: "2 is read by a newer flappy than this one". `commit`: of the program that
/// wrote the file, where the file says so.
std::string other_schema(std::int64_t given, std::int64_t read, const std::string& commit = "");

/// "; flappy at commit X wrote it, and reads it", or nothing where this program is of that commit or it is not known.
std::string writer_reads(const std::string& commit);

/// The commit that run.json of a run folder names; empty where it names none.
std::string commit_of_run(const std::filesystem::path& folder);

/// read(), whose refusals end with the commit that wrote the run.
template <class Read>
auto read_of_run(const std::filesystem::path& folder, Read read) {
  try {
    return read();
  } catch (const InputError& e) {
    throw InputError(e.what() + writer_reads(commit_of_run(folder)));
  }
}

}  // namespace flappy::io
