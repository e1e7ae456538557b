// Cases that fail in each way in which a case can fail, for the test of the runner.

#include <cstdlib>
#include <memory>

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
