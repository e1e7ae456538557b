#pragma once

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <cstdlib>
#include <fstream>
#include <string>
#include <thread>
#include <vector>

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sys/types.h>

#include "api/server/heap_trim.hpp"

namespace plchost {

#ifdef PLCHOST_ADDRESS_SANITIZER
constexpr bool kSanitized = true;  // frees later
#else
constexpr bool kSanitized = false;
#endif

/// Heap and stacks of a process that are in memory.
inline std::int64_t memory_kib(pid_t pid) {
  std::ifstream status(fmt::format("/proc/{}/smaps_rollup", pid));
  std::int64_t sum = 0;
  for (std::string word; status >> word;) {
    std::int64_t kib = 0;
    if (word == "Anonymous:" && status >> kib) sum += kib;
  }
  return sum;
}

/// When the last clients of a server are forgotten and free memory was given back.
inline std::int64_t settled_kib(pid_t server) {
  std::this_thread::sleep_for(3 * HeapTrim::kQuiet);
  return memory_kib(server);
}

template <class Use>
void repeat_at_once(int times, int at_once, const Use& use) {
  std::atomic<int> left{times};
  std::vector<std::jthread> threads;
  for (int i = 0; i < at_once; ++i) {
    threads.emplace_back([&left, &use] {
      while (left.fetch_sub(1) > 0) use();
    });
  }
}

struct Uses {
  int first;
  int then;
  int at_once;
  /// The promise, and Cyclone's buffer of received packets (1 MB), of which more may be in use than before.
  std::int64_t bound_kib = 1024 + 1024;
};

/// After `first` times, which fill all that is bounded, `then` times leave less than the bound in the server.
/// The environment may ask for more of them.
template <class Use>
void expect_bounded_memory(pid_t server, Uses uses, const Use& use) {
  // NOLINTNEXTLINE(concurrency-mt-unsafe): no thread of this test is there yet
  if (const char* const more = std::getenv("PLCHOST_CLIENTS"); more != nullptr) {
    uses.then = std::atoi(more);
    uses.first = std::max(uses.first, uses.then / 5);
  }
  repeat_at_once(uses.first, uses.at_once, use);
  const std::int64_t before = settled_kib(server);
  ASSERT_GT(before, 0);
  repeat_at_once(uses.then, uses.at_once, use);
  const std::int64_t after = settled_kib(server);
  fmt::print("{} and {} times: {} to {} KiB\n", uses.first, uses.then, before, after);
  EXPECT_LT(after - before, uses.bound_kib);
}

}  // namespace plchost
