// File formats have schema numbers. A file of another schema is refused, with the version of flappy that reads it.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include "io/files.hpp"

namespace flappy::io {

/// Why a schema is not read: "2 is read by a newer flappy than this one". `commit`: that of the writer, or empty.
std::string other_schema(std::int64_t given, std::int64_t read, const std::string& commit = "");

/// "; flappy at commit X wrote it, and reads it"; empty where this program is of that commit or the commit is unknown.
std::string writer_reads(const std::string& commit);

/// The commit in run.json of a run folder; empty where there is none.
std::string commit_of_run(const std::filesystem::path& folder);

/// Calls read() and appends the commit that wrote the run to any InputError.
template <class Read>
auto read_of_run(const std::filesystem::path& folder, Read read) {
  try {
    return read();
  } catch (const InputError& e) {
    throw InputError(e.what() + writer_reads(commit_of_run(folder)));
  }
}

}  // namespace flappy::io
