// A shared library that this process loads and unloads.
#pragma once

#include <filesystem>
#include <memory>

namespace flappy::io {

/// Loaded as long as the object lives; its file may be removed before.
class SharedLibrary {
 public:
  /// Throws std::runtime_error where it cannot be loaded: the reason, without the path.
  explicit SharedLibrary(const std::filesystem::path& path);

  /// Null where it has no such symbol.
  void* symbol(const char* name) const;
  template <class F>
  F* function(const char* name) const {
    return reinterpret_cast<F*>(symbol(name));
  }

 private:
  std::unique_ptr<void, int (*)(void*)> handle_;
};

}  // namespace flappy::io
