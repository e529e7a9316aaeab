// Names that come from elsewhere. A name says which file below a folder is meant, and can say nothing else: it is no path, no option, and
// leaves the folder neither by ".." nor through a link.
#pragma once

#include <filesystem>
#include <string>

namespace flappy::server {

/// The file or folder `name` below `folder`, absolute and without links. `what` names it in an io::InputError: for a name that is
/// none, and where there is no such thing below the folder.
std::filesystem::path below(const std::filesystem::path& folder, const std::string& name, const std::string& what);

/// io::InputError unless `override` is KEY=VALUE in the alphabet that configurations need without file names: no slash, backslash, ".." or
/// control character.
void check_override(const std::string& override);

}  // namespace flappy::server
