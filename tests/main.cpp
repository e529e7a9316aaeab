// The main of all test programs: each has a temporary folder of its own, which goes with it.
#include <gtest/gtest.h>
#include <stdlib.h>

#include <cstdio>
#include <filesystem>
#include <string>
#include <system_error>

int main(int argc, char** argv) {
  namespace fs = std::filesystem;
  testing::InitGoogleTest(&argc, argv);
  std::string folder = (fs::temp_directory_path() / "t_XXXXXX").string();  // short, as names of sockets are
  if (mkdtemp(folder.data()) == nullptr) {
    std::perror(folder.c_str());
    return 1;
  }
  // where children, the standard library and testing::TempDir() look
  setenv("TMPDIR", folder.c_str(), 1);
  unsetenv("TEST_TMPDIR");
  const int code = RUN_ALL_TESTS();
  std::error_code ignored;
  fs::remove_all(folder, ignored);
  return code;
}
