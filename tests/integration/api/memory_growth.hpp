#pragma once

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sys/types.h>

#include "api/server/heap_trim.hpp"
#include "tests/integration/api/test_host.hpp"
#include "tests/support/own_name.hpp"
#include "tests/support/sanitized.hpp"

namespace plchost {

/// The memory of a process.
struct MemoryUse {
  std::int64_t resident = 0;  ///< bytes: heap and stacks, also what is free in pages that malloc keeps
  std::int64_t used = 0;      ///< bytes: small blocks of the heap that were not freed
};

/// Bytes of heap and stacks of a process that are in memory.
inline std::int64_t resident_bytes(pid_t pid) {
  std::ifstream status(fmt::format("/proc/{}/smaps_rollup", pid));
  std::int64_t sum = 0;
  for (std::string word; status >> word;) {
    std::int64_t kib = 0;
    if (word == "Anonymous:" && status >> kib) sum += kib * 1024;
  }
  return sum;
}

/// The server of a host whose heap is measured. The server must not run yet.
class MeasuredServer {
 public:
  MeasuredServer(TestHost& host, std::vector<std::string> arguments = {}) : host_(host) {
    std::ofstream(file_) << std::string(sizeof(std::uint64_t), '\0');
    // NOLINTBEGIN(concurrency-mt-unsafe): the host's thread reads no environment
    ::setenv("LD_PRELOAD", HEAP_METER, 1);
    ::setenv("HEAP_METER", file_.c_str(), 1);
    host_.start_server(std::move(arguments));
    ::unsetenv("LD_PRELOAD");
    ::unsetenv("HEAP_METER");
    // NOLINTEND(concurrency-mt-unsafe)
  }
  MeasuredServer(const MeasuredServer&) = delete;
  MeasuredServer& operator=(const MeasuredServer&) = delete;
  ~MeasuredServer() { std::filesystem::remove(file_); }

  /// When the last clients are forgotten and free memory was given back. On a loaded machine some of them go
  /// later than others.
  [[nodiscard]] MemoryUse settled() const {
    constexpr std::int64_t kStill = std::int64_t{16} * 1024;
    std::this_thread::sleep_for(3 * HeapTrim::kQuiet);
    MemoryUse use = look();
    for (int looks = 0; looks < 10; ++looks) {
      std::this_thread::sleep_for(HeapTrim::kQuiet);
      const std::int64_t before = std::exchange(use, look()).used;
      if (use.used > before - kStill) break;
    }
    return use;
  }

 private:
  [[nodiscard]] MemoryUse look() const {
    std::int64_t used = 0;
    std::ifstream(file_, std::ios::binary).read(reinterpret_cast<char*>(&used), sizeof used);
    return {.resident = resident_bytes(host_.server().pid()), .used = used};
  }

  TestHost& host_;
  std::string file_ = own_path("heap");
};

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
  int first;  ///< they fill the tables that have a bound: see kFill
  int then;
  int at_once;
  /// Each has `then` uses; one of them must be within the bounds. A leak grows in each round, a list only
  /// until it is full.
  int rounds = 1;
};

/// The promise: 10,000 clients come and go within 1 MiB. A test with fewer clients bounds the blocks that
/// they leave in proportion. The environment may ask for more clients.
constexpr std::int64_t kPromise = std::int64_t{1024} * 1024;
constexpr int kPromised = 10'000;
/// So much more is in use without a leak, because lists with a bound fill: each thread's freed blocks in
/// malloc, freed samples and messages in Cyclone.
constexpr std::int64_t kNoise = std::int64_t{256} * 1024;
/// So many clients fill them all: the answers and posts of the last 1,024 are the longest.
constexpr int kFill = 1024;
/// From then on so much comes and goes. 1,000 clients that leave 200 bytes each are seen.
constexpr std::int64_t kNoiseWhenFull = std::int64_t{80} * 1024;

/// Returns how many clients there were.
template <class Use>
int expect_bounded_memory(const MeasuredServer& server, Uses uses, const Use& use) {
  const auto ask_environment = [](const char* name, int& number) {
    // NOLINTNEXTLINE(concurrency-mt-unsafe): no thread of this test is there yet
    if (const char* const other = std::getenv(name); other != nullptr) number = std::atoi(other);
  };
  ask_environment("PLCHOST_FIRST_CLIENTS", uses.first);
  ask_environment("PLCHOST_CLIENTS", uses.then);
  repeat_at_once(uses.first, uses.at_once, use);
  MemoryUse before = server.settled();
  EXPECT_GT(before.used, 0);
  for (int round = 1;; ++round) {
    repeat_at_once(uses.then, uses.at_once, use);
    const MemoryUse after = server.settled();
    const std::int64_t noise = uses.first > kFill ? kNoiseWhenFull : kNoise;
    const std::int64_t most = noise + kPromise * uses.then / kPromised;
    fmt::print("{} and {} times {}: {} to {} bytes in memory, {} to {} of them in use\n", uses.first, round,
               uses.then, before.resident, after.resident, before.used, after.used);
    const bool is_bounded = after.resident - before.resident < kPromise && after.used - before.used < most;
    if (is_bounded || round == uses.rounds) {
      EXPECT_LT(after.resident - before.resident, kPromise);
      EXPECT_LT(after.used - before.used, most);
      return uses.first + round * uses.then;
    }
    before = after;
  }
}

}  // namespace plchost
