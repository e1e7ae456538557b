// Cases that fail in each way in which a case can fail, for the test of the runner.

#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <memory>
#include <string>
#include <thread>

#include <gtest/gtest.h>
#include <unistd.h>

namespace {

TEST(Planted, Succeeds) {}

TEST(Planted, Fails) {
  ADD_FAILURE() << "said by the case that fails";
}

TEST(Planted, IsSkipped) {
  GTEST_SKIP();
}

TEST(Planted, Aborts) {
  std::abort();
}

TEST(Planted, SucceedsBehindOneThatAborts) {}

TEST(Planted, EndsTheProcess) {
  std::exit(0);  // NOLINT(concurrency-mt-unsafe): it has one thread
}

TEST(Planted, Hangs) {
  for (;;) ::pause();
}

TEST(Planted, SucceedsAtItsSecondRun) {
  const char* const mark = std::getenv("PLANTED_MARK");  // NOLINT(concurrency-mt-unsafe)
  ASSERT_NE(mark, nullptr);
  ASSERT_EQ(::access(mark, F_OK), 0) << "it is the first run" << std::fclose(std::fopen(mark, "w"));
}

// As stalls.py writes it: from when on, for how long, and how much of that the core did nothing.
TEST(Planted, SucceedsAtItsSecondRunAfterAStall) {
  const char* const stalls = std::getenv("PLCHOST_STALLS");  // NOLINT(concurrency-mt-unsafe)
  ASSERT_NE(stalls, nullptr);
  if (std::filesystem::file_size(stalls) > 0) return;
  std::this_thread::sleep_for(std::chrono::milliseconds(500));  // the runner has heard that it runs
  const auto now = std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
  std::ofstream(stalls) << std::fixed << now - 1.24 << " 1.240 1.240\n";
  FAIL() << "it is the first run";
}

TEST(Planted, HasNoSecondRunWithoutAStall) {
  const char* const mark = std::getenv("PLANTED_MARK");  // NOLINT(concurrency-mt-unsafe)
  ASSERT_NE(mark, nullptr);
  const std::string own = std::string(mark) + ".calm";
  ASSERT_TRUE(std::filesystem::exists(own)) << "it is the first run" << std::ofstream(own).is_open();
}

TEST(Planted, LeavesAProcess) {
  if (::fork() == 0) {
    for (;;) ::pause();
  }
}

// Alone it says nothing, but its process fails: as after a leak.
TEST(Planted, SpoilsTheEnd) {
  ASSERT_EQ(std::atexit([] { ::_exit(7); }), 0);
}

}  // namespace
