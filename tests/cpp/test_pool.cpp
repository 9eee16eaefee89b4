// The thread pool: every item once, errors come back, nested calls and forked children work.
#include "core/threads/pool.h"

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <stdexcept>
#include <thread>
#include <vector>

namespace sheetbend::testing {
namespace {

// How often each item was visited.
std::vector<int> visits(int count, int threads, int grain) {
  std::vector<int> seen(count);
  parallel_for(count, threads, grain, [&](int begin, int end) {
    for (int i = begin; i < end; ++i) ++seen[i];
  });
  return seen;
}

TEST(Pool, VisitsEveryItemOnce) {
  for (const int count : {0, 1, 2, 7, 64, 1001})
    for (const int threads : {1, 2, 3, 8})
      for (const int grain : {0, 1, 16})
        EXPECT_EQ(visits(count, threads, grain), std::vector<int>(count, 1)) << count << " " << threads;
}

TEST(Pool, SplitsOnlyAboveItsGrain) {
  const auto chunks = [](int count, int threads, int grain) {
    std::atomic<int> n = 0;
    parallel_for(count, threads, grain, [&](int, int) { ++n; });
    return n.load();
  };
  EXPECT_EQ(chunks(31, 8, 16), 1);
  EXPECT_EQ(chunks(32, 8, 16), 2);
  EXPECT_EQ(chunks(1000, 3, 16), 3);
  EXPECT_EQ(chunks(5, 8, 1), 5);
}

TEST(Pool, SurvivesManyShortJobs) {
  long long sum = 0;
  for (int round = 0; round < 2000; ++round)
    for (const int v : visits(8, 3, 1)) sum += v;
  EXPECT_EQ(sum, 16000);
}

TEST(Pool, RethrowsAndStaysUsable) {
  for (const int threads : {1, 3}) {
    std::atomic<int> done = 0;
    const auto work = [&](int begin, int end) {
      for (int i = begin; i < end; ++i) {
        if (i == 5) throw std::runtime_error("five");
        ++done;
      }
    };
    EXPECT_THROW(parallel_for(9, threads, 1, work), std::runtime_error);
    EXPECT_GE(done.load(), 5);
    EXPECT_EQ(visits(9, threads, 1), std::vector<int>(9, 1));
  }
}

TEST(Pool, NestedCallsRunInPlace) {
  std::vector<std::vector<int>> seen(6);
  parallel_for(6, 3, 1, [&](int begin, int end) {
    for (int i = begin; i < end; ++i) seen[i] = visits(10, 3, 1);
  });
  for (const auto& inner : seen) EXPECT_EQ(inner, std::vector<int>(10, 1));
}

TEST(Pool, ServesSeveralCallers) {
  std::vector<std::thread> callers;
  std::atomic<int> right = 0;
  for (int c = 0; c < 4; ++c)
    callers.emplace_back([&] {
      for (int round = 0; round < 200; ++round) right += visits(16, 3, 1) == std::vector<int>(16, 1);
    });
  for (std::thread& t : callers) t.join();
  EXPECT_EQ(right.load(), 800);
}

TEST(Pool, WorksInAForkedChild) {
#ifdef __SANITIZE_THREAD__
  GTEST_SKIP() << "ThreadSanitizer does not allow threads in a forked child";
#endif
  ASSERT_EQ(visits(100, 3, 1), std::vector<int>(100, 1));  // the parent's workers exist; the child has none of them
  const pid_t child = fork();
  ASSERT_GE(child, 0);
  if (child == 0) {
    alarm(20);
    _exit(visits(100, 3, 1) == std::vector<int>(100, 1) ? 0 : 1);
  }
  int status = 0;
  ASSERT_EQ(waitpid(child, &status, 0), child);
  EXPECT_TRUE(WIFEXITED(status)) << "the child hung or crashed";
  EXPECT_EQ(WEXITSTATUS(status), 0);
  EXPECT_EQ(visits(100, 3, 1), std::vector<int>(100, 1));
}

}  // namespace
}  // namespace sheetbend::testing
