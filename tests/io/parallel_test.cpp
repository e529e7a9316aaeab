#include "io/parallel.hpp"

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <ctime>
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
  for (int round = 0; round < 2000; ++round) {
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

/// Two jobs that wait for each other: false where one thread has both, and the first gave up.
bool two_meet(std::chrono::milliseconds patience = std::chrono::seconds(10)) {
  std::atomic<int> here = 0, alone = 0;
  parallel_for(2, 2, [&](std::size_t) {
    ++here;
    const auto until = std::chrono::steady_clock::now() + patience;
    while (here < 2 && std::chrono::steady_clock::now() < until) std::this_thread::yield();
    alone += here < 2;
  });
  return alone == 0;
}

TEST(Parallel, SharesOneTeamAmongTheLoopsOfABody) {
  int loops = 0;
  std::atomic<int> called = 0;
  together(2, [&] {
    for (; loops < 100; ++loops) parallel_for(10, 2, [&](std::size_t) { ++called; });
    EXPECT_TRUE(two_meet());
    together(2, [] { EXPECT_TRUE(two_meet()) << "one within the other"; });
    std::thread([] {
      EXPECT_FALSE(two_meet(std::chrono::milliseconds(50))) << "another thread's loop has no team";
    }).join();
  });
  EXPECT_EQ(called, 1000);
  EXPECT_THROW(together(2, [] { parallel_for(2, 2, [](std::size_t) { throw std::runtime_error("job"); }); }),
               std::runtime_error);
  EXPECT_TRUE(two_meet()) << "after it was left by an exception";
}

TEST(Parallel, SleepsWhileThereIsNothingToDo) {
  const auto spent_s = [] {
    timespec t;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
  };
  ASSERT_TRUE(two_meet());
  const double before = spent_s();
  std::this_thread::sleep_for(std::chrono::milliseconds(100));
  EXPECT_LT(spent_s() - before, 2e-3);  // OpenMP that waits as it likes spends 5e-3 or more
#ifndef __clang__                       // whose threads look on as long as a region has tasks
  together(2, [&] {
    ASSERT_TRUE(two_meet());
    const double inside = spent_s();
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
    EXPECT_LT(spent_s() - inside, 2e-3);
  });
#endif
}

TEST(Parallel, RunsInAChildThatWasForkedAfterALoop) {
  const auto child_meets = [] {
    const pid_t child = fork();
    if (child == 0) {
      alarm(20);
      _exit(two_meet() ? 0 : 1);
    }
    int status = -1;
    waitpid(child, &status, 0);
    return status == 0;
  };
  ASSERT_TRUE(two_meet());
  EXPECT_TRUE(child_meets());
  EXPECT_TRUE(two_meet()) << "the parent goes on";
  std::atomic<bool> loops = false, end = false;
  std::thread beside([&] {
    together(2, [&] {
      loops = true;
      while (!end) std::this_thread::yield();
    });
  });
  while (!loops) std::this_thread::yield();
  EXPECT_TRUE(child_meets()) << "while another thread had the team";
  end = true;
  beside.join();
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
