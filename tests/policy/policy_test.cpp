// Policies from elsewhere: what they compute, and what is said of those that are none.
#include "policy/policy.hpp"

#include <gtest/gtest.h>

#include <cstdlib>
#include <vector>

#include "rollout/fly_fixture.hpp"

namespace flappy::deploy {
namespace {

namespace fs = std::filesystem;
using flight::Folder;
using flight::message;

/// 3 inputs, 2 outputs; static functions, as an exporter may write them, and one from the mathematical library.
const std::string kStep = R"(#include <math.h>
static void flappy_policy_step(const float obs[FLAPPY_POLICY_OBS], float action[FLAPPY_POLICY_ACT]) {
  action[0] = obs[0] + 2.0f * obs[1];
  action[1] = floorf(obs[2]) - 0.5f;
}
)";
const std::string kSizes = "#define FLAPPY_POLICY_OBS 3\n#define FLAPPY_POLICY_ACT 2\n";
const std::string kTest = "static int flappy_policy_selftest(void) { return 0; }\n";
const std::vector<float> kSeen = {1, 2, 3.5F, -1, 0.25F, -0.5F}, kDone = {5, 2.5F, -0.5F, -1.5F};

std::vector<float> acts(const policy::Policy& policy, std::size_t count, const std::vector<float>& seen) {
  std::vector<float> done(count * static_cast<std::size_t>(policy.actions()), 99);
  policy.act(count, seen.data(), done.data());
  return done;
}

TEST(HeaderPolicy, ActsOnRows) {
  const Folder folder;
  const std::string before = fs::temp_directory_path().string();
  setenv("TMPDIR", (folder / "").c_str(), 1);
  fs::create_directories(folder / "a b \"c\"");
  const std::string name = folder.write("a b \"c\"/policy.h", kSizes + kStep + kTest);
  const auto policy = policy::load_policy(name, 3, 2);
  EXPECT_EQ(policy->observations(), 3);
  EXPECT_EQ(policy->actions(), 2);
  EXPECT_EQ(acts(*policy, 2, kSeen), kDone);
  // another one beside it, with the same names in it
  const auto other = policy::load_policy(
      folder.write("other.h",
                   "#define FLAPPY_POLICY_OBS 1\n#define FLAPPY_POLICY_ACT 1\n"
                   "void flappy_policy_step(const float *obs, float *action) { action[0] = -obs[0]; }\n"
                   "int flappy_policy_selftest(void) { return 0; }\n"),
      1, 1);
  EXPECT_EQ(acts(*other, 2, {4, 5}), (std::vector<float>{-4, -5}));
  EXPECT_EQ(acts(*policy, 1, kSeen), (std::vector<float>{5, 2.5F}));
  setenv("TMPDIR", before.c_str(), 1);
  std::size_t left = 0;
  for (const auto& entry : fs::directory_iterator(folder / "")) left += entry.path().extension() != ".h";
  EXPECT_EQ(left, 1u);  // the folder of the first header
}

TEST(HeaderPolicy, RefusesWhatIsNone) {
  const Folder folder;
  const std::string name = folder / "p.h";
  const auto refused = [&](const std::string& text) {
    folder.write("p.h", text);
    return message([&] { policy::load_policy(name, 3, 2); });
  };
  EXPECT_EQ(refused(kSizes + kStep + kTest), "accepted");
  const std::string accepted = "; accepted: a C header that cc compiles";
  EXPECT_EQ(refused(kStep + kTest).substr(0, name.size() + 7), name + ":2:48: ");
  EXPECT_EQ(refused("#define FLAPPY_POLICY_OBS 3\n"),
            name + ": does not compile: #error FLAPPY_POLICY_OBS or FLAPPY_POLICY_ACT is missing" + accepted);
  const std::string no_step = refused(kSizes + kTest);
  EXPECT_EQ(no_step.find(name + ": does not compile: implicit declaration of function"), 0u) << no_step;
  EXPECT_NE(no_step.find("flappy_policy_step"), std::string::npos) << no_step;
  EXPECT_NE(refused(kSizes + kStep).find("flappy_policy_selftest"), std::string::npos);
  EXPECT_EQ(refused(kSizes + "int x = ;\nint y = ;\n" + kStep + kTest).find(name + ":3:9: error: expected expression"),
            0u);
  EXPECT_NE(refused(kSizes + "void flappy_policy_step(const double *o, double *a);\n" + kTest).find("pointer type"),
            std::string::npos);  // another precision
  EXPECT_EQ(refused(kSizes + "int absent(void);\n" + kStep + "int flappy_policy_selftest(void) { return absent(); }\n"),
            name + ": cannot be loaded: undefined symbol: absent; accepted: a header that defines all it calls");
  EXPECT_EQ(refused(kSizes + kStep + "int flappy_policy_selftest(void) { return 7; }\n"),
            name + ": fails its self-test: 7; accepted: flappy_policy_selftest() of 0");
  EXPECT_EQ(refused("#define FLAPPY_POLICY_OBS 4\n#define FLAPPY_POLICY_ACT 2\n" + kStep + kTest),
            name + ": has 4 inputs and 2 outputs; accepted: 3 and 2, as the task has");
  EXPECT_EQ(refused("#define FLAPPY_POLICY_OBS 3\n#define FLAPPY_POLICY_ACT 4\n" + kStep + kTest),
            name + ": has 3 inputs and 4 outputs; accepted: 3 and 2, as the task has");
}

TEST(HeaderPolicy, NeedsACompiler) {
  const Folder folder;
  const std::string name = folder.write("p.h", kSizes + kStep + kTest), path = std::getenv("PATH");
  setenv("PATH", (folder / "").c_str(), 1);
  const std::string said = message([&] { policy::load_policy(name, 3, 2); });
  setenv("PATH", path.c_str(), 1);
  EXPECT_EQ(said,
            name + ": cannot be compiled: cc: No such file or directory; accepted: a C compiler of this name in PATH");
}

TEST(Policy, SaysWhatItReads) {
  const Folder folder;
  const std::string name = folder.write("p.tflite", "");
  EXPECT_EQ(message([&] { policy::load_policy(name, 3, 2); }),
            name + ": is no policy; accepted: a TorchScript file (.pt), an ONNX file (.onnx) or a C header (.h)");
  for (const char* gone : {"gone.h", "gone.pt", "gone.onnx"})
    EXPECT_EQ(message([&] { policy::load_policy(folder / gone, 3, 2); }),
              std::string(folder / gone) + ": cannot be read: No such file or directory");
}

#ifdef FLAPPY_HAVE_TORCH
/// x W + b of powers of two, as torch.jit.save of torch 1.13 left it; of "strided" the rows are not contiguous, and the others make
/// something else of it.
std::string script(const std::string& name) { return test::source_path("tests/data/torch_script/" + name + ".pt"); }

TEST(TorchScriptPolicy, ActsOnRows) {
  EXPECT_TRUE(policy::reads_torch_script());
  const auto policy = policy::load_policy(script("rows"), 3, 2);
  // powers of two: exact in any order
  const std::vector<float> done = {5.25F, 10.5F, -0.25F, -4.75F};
  EXPECT_EQ(acts(*policy, 2, kSeen), done);
  EXPECT_EQ(acts(*policy, 1, kSeen), std::vector<float>(done.begin(), done.begin() + 2));
  EXPECT_EQ(acts(*policy::load_policy(script("strided"), 3, 2), 2, kSeen), done);
}

TEST(TorchScriptPolicy, RefusesWhatIsNone) {
  const Folder folder;
  const std::string sizes = "; accepted: float[n][3] to float[n][2], as the task has";
  const auto refused = [](const std::string& name, int inputs = 3, int outputs = 2) {
    return message([&] { policy::load_policy(name, inputs, outputs); });
  };
  const std::string name = script("rows");
  EXPECT_EQ(refused(name), "accepted");
  EXPECT_EQ(refused(name, 4), name +
                                  ": does not take 4 inputs: mat1 and mat2 shapes cannot be multiplied (2x4 and 3x2)" +
                                  "; accepted: float[n][4] to float[n][2], as the task has");
  EXPECT_EQ(refused(name, 3, 4),
            name + ": makes Float[2, 2] of float[2, 3]; accepted: float[n][3] to float[n][4], as the task has");
  EXPECT_EQ(refused(script("vector")), script("vector") + ": makes Float[2] of float[2, 3]" + sizes);
  EXPECT_EQ(refused(script("doubles")), script("doubles") + ": makes Double[2, 2] of float[2, 3]" + sizes);
  EXPECT_EQ(refused(script("tuple")).find(script("tuple") + ": does not take 3 inputs: "), 0u);
  const std::string good = io::read_text(name);
  for (const std::string& text : {std::string("not a zip file"), std::string(), good.substr(0, good.size() / 2)}) {
    const std::string damaged = folder.write("p.pt", text), said = refused(damaged);
    EXPECT_EQ(said.find(damaged + ": is no TorchScript file: "), 0u) << said;
    EXPECT_EQ(said.find("\\x0a"), std::string::npos) << said;  // one line
  }
}
#else
TEST(TorchScriptPolicy, IsNotReadWithoutLibTorch) {
  const Folder folder;
  EXPECT_FALSE(policy::reads_torch_script());
  const std::string name = folder.write("p.pt", "");
  EXPECT_EQ(message([&] { policy::load_policy(name, 3, 2); }),
            name +
                ": cannot be read by this build, which has no LibTorch; accepted: a C header (.h), the "
                "package flappy-torch, or a build with libtorch-dev installed");
}
#endif

}  // namespace
}  // namespace flappy::deploy
