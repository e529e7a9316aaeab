// SHA-256 hashes, which record the contents of a file.
#pragma once

#include <string>
#include <string_view>

struct evp_md_ctx_st;

namespace flappy::io {

/// SHA-256 as 64 lower-case hexadecimal digits.
std::string sha256(std::string_view bytes);

class Sha256 {
 public:
  Sha256();
  ~Sha256();
  Sha256(const Sha256&) = delete;
  Sha256& operator=(const Sha256&) = delete;

  void add(std::string_view bytes);
  std::string digits();  ///< call it once, last

 private:
  evp_md_ctx_st* context_;
};

}  // namespace flappy::io
