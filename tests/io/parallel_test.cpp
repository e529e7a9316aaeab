#include "io/parallel.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <fstream>
#include <numeric>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

namespace flappy::io {
namespace {

TEST(Parallel, CallsEveryJobOnceOnTheThreadsAllowed) {
  for (const int threads : {1, 2, 3, 8, 0})
    for (const std::size_t count : {0, 1, 2, 7, 64, 1000}) {
      std::vector<std::atomic<int>> called(count);
      std::vector<std::atomic<int>> inside(static_cast<std::size_t>(thread_count(threads)));
      parallel_for(count, threads, [&](std::size_t i, int thread) {
        const auto t = static_cast<std::size_t>(thread);
        ASSERT_LT(t, inside.size());
        EXPECT_EQ(inside[t]++, 0) << "two threads of one number";
        ++called[i];
        --inside[t];
      });
      for (const auto& times : called) EXPECT_EQ(times, 1) << count << " jobs, " << threads << " threads";
    }
}

TEST(Parallel, FinishesManySmallLoopsInOrder) {
  std::vector<std::size_t> sums(5);
  for (int round = 0; round < 20000; ++round) {
    parallel_for(sums.size(), 1 + round % 4, [&](std::size_t i) { sums[i] += i + 1; });
    ASSERT_EQ(std::accumulate(sums.begin(), sums.end(), std::size_t{0}), 15 * static_cast<std::size_t>(round + 1));
  }
}

TEST(Parallel, ThrowsWhatTheFirstJobByIndexThrewAndCallsTheOthers) {
  for (const int threads : {1, 2, 5})
    for (int round = 0; round < 200; ++round) {
      std::atomic<int> called = 0;
      std::string what;
      try {
        parallel_for(100, threads, [&](std::size_t i) {
          ++called;
          if (i % 10 == 3) throw std::runtime_error("job " + std::to_string(i));
        });
      } catch (const std::runtime_error& e) {
        what = e.what();
      }
      EXPECT_EQ(what, "job 3");
      EXPECT_EQ(called, 100);
    }
}

TEST(Parallel, TakesWorkFromAThreadThatIsHeldUp) {
  // whoever has the first job keeps it until all others are done, so those behind it have to go to somebody else
  std::atomic<int> others = 0;
  parallel_for(100, 2, [&](std::size_t i) {
    if (i == 0)
      while (others < 99) std::this_thread::yield();
    else ++others;
  });
  EXPECT_EQ(others, 99);
}

TEST(Parallel, WaitsForWhatOthersHaveBegun) {
  int helped = 0;
  parallel_for(4, 4, [](std::size_t) {});  // some more that could help, but are not allowed to
  for (int round = 0; round < 1000 && helped < 20; ++round) {
    std::atomic<int> done = 0, by_others = 0;
    parallel_for(8, 2, [&](std::size_t, int thread) {
      std::this_thread::sleep_for(std::chrono::microseconds(thread == 0 ? 50 : 500));
      EXPECT_LT(thread, 2);
      by_others += thread != 0;
      ++done;
    });
    ASSERT_EQ(done, 8);
    helped += by_others > 0;
  }
  EXPECT_GT(helped, 0);
}

TEST(Parallel, RunsLoopsInLoopsAndBesideLoops) {
  std::atomic<int> called = 0;
  const auto nest = [&] {
    for (int round = 0; round < 200; ++round)
      parallel_for(4, 3, [&](std::size_t) {
        parallel_for(5, 3, [&](std::size_t, int thread) {
          EXPECT_EQ(thread, 0);
          ++called;
        });
      });
  };
  { const std::jthread one(nest), two(nest); }
  EXPECT_EQ(called, 2 * 200 * 4 * 5);
}

TEST(Parallel, KnowsWhatItsControlGroupPaysFor) {
  const std::filesystem::path root = std::filesystem::path(testing::TempDir()) / "parallel_test_groups";
  const auto write = [](const std::filesystem::path& file, const std::string& text) {
    std::filesystem::create_directories(file.parent_path());
    std::ofstream(file) << text;
  };
  const auto processors_of = [&](const std::string& membership) {
    write(root / "membership", membership);
    return processors_of_group(root / "membership", root);
  };
  write(root / "batch/cpu.max", "350000 100000\n");
  write(root / "batch/job/cpu.max", "max 100000\n");
  write(root / "batch/job/step/cpu.max", "120000 100000\n");
  write(root / "free/cpu.max", "max 100000\n");
  EXPECT_EQ(processors_of("1:cpu:/batch\n0::/batch/job/step\n"), 2);
  EXPECT_EQ(processors_of("0::/batch/job\n"), 4) << "of the folder above";
  EXPECT_EQ(processors_of("0::/free\n"), 0);
  EXPECT_EQ(processors_of("0::/\n"), 0);
  EXPECT_EQ(processors_of_group(root / "no such file", root), 0);
  EXPECT_GE(processors(), 1);
}

}  // namespace
}  // namespace flappy::io
