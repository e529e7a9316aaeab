#include "io/shared_library.hpp"

#include <dlfcn.h>

#include <stdexcept>
#include <string>

namespace flappy::io {

SharedLibrary::SharedLibrary(const std::filesystem::path& path)
    : handle_(dlopen(path.c_str(), RTLD_NOW | RTLD_LOCAL), dlclose) {
  if (handle_) return;
  std::string why = dlerror();
  if (why.starts_with(path.string() + ": ")) why.erase(0, path.string().size() + 2);
  throw std::runtime_error(why);
}

void* SharedLibrary::symbol(const char* name) const { return dlsym(handle_.get(), name); }

}  // namespace flappy::io
