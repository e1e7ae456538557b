// The memory that clients of a secured host leave behind in its API server.
#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <thread>

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <malloc.h>

#include "tests/integration/api/memory_growth.hpp"
#include "tests/integration/security/secured_host.hpp"

namespace plchost {
namespace {

class SecuredMemory : public SecuredHost {
 protected:
  // Five handshakes at a time in one process take seconds on a loaded machine.
  static constexpr Duration kLong = std::chrono::seconds(30);

  static bool ask(ControlClient& client, const char* host = "cell") {
    return client.call({host, plc_OPERATION_READ_CLOCK, "", ""}, MonotonicClock::now() + kLong).has_value();
  }
  static bool ask_and_post(ControlClient& client) {
    return client.call({"cell", plc_OPERATION_STOP, "line1", ""}, MonotonicClock::now() + kLong) &&
           client.post_event({"cell", "line1", "ready"}, 1, {}, kLong);
  }
};

// One that stays has met the server before all others, so it would acknowledge nothing more. It makes its
// writers afterwards: the keys of these come through all the same. 250 clients would leave 4 to 5 MB.
// They only read: so few of them would not fill the memory of answers, which has a bound.
TEST_F(SecuredMemory, KeysThatClientsWereToldGoWithThemWhileOneStays) {
  if (kSanitized) GTEST_SKIP() << "a sanitizer keeps what was freed";
  const MeasuredServer server(host_, {"--identity", folder("cell")});
  const auto staying = make_client();
  ASSERT_TRUE(staying->instances("cell", soon()));
  std::atomic<int> unanswered{0};
  const int clients = expect_bounded_memory(server, {.first = 110, .then = 250, .at_once = 4, .rounds = 3},
                                            [&] { unanswered += ask(*make_client()) ? 0 : 1; });
  // On a busy machine Cyclone may not get over a handshake whose messages have crossed: one of a hundred.
  fmt::print("{} of {} clients were not answered\n", unanswered.load(), clients);
  EXPECT_LE(unanswered, clients / 100);
  EXPECT_TRUE(ask_and_post(*staying));
}

// The least that is in use within some seconds: the servers that were killed are forgotten when their leases
// end.
std::int64_t least_in_use(const std::function<bool()>& work) {
  std::int64_t least = std::numeric_limits<std::int64_t>::max();
  for (const auto end = MonotonicClock::now() + std::chrono::seconds(6); MonotonicClock::now() < end;) {
    std::this_thread::sleep_for(std::chrono::milliseconds(500));
    EXPECT_TRUE(work());
    least = std::min(least, static_cast<std::int64_t>(::mallinfo2().uordblks));
  }
  return least;
}

// A client tells each server anew the keys of its writers and readers, which the other servers need not know.
// Each restart would leave 13 kB in the client. A leak grows in each round, a list only until it is full.
TEST_F(SecuredMemory, OfAClientThatStaysDoesNotGrowWhenAServerIsRestarted) {
  if (kSanitized) GTEST_SKIP() << "a sanitizer keeps what was freed";
  ::mallopt(M_MMAP_THRESHOLD, 128 * 1024);  // receive buffers are not counted here either
  ASSERT_TRUE(plant().add(security::Role::host, "south"));
  start();
  TestHost restarted(domain_, "south");
  restarted.start_server({"--identity", folder("south")});
  const auto client = make_client();
  const auto restart = [&](int times) {
    for (int i = 0; i < times; ++i) {
      restarted.replace_server();
      ASSERT_TRUE(ask(*client, "south"));
    }
  };
  const auto measure = [&] { return least_in_use([&] { return ask(*client) && ask(*client, "south"); }); };
  ASSERT_NO_FATAL_FAILURE(restart(10));
  constexpr int kTimes = 20;
  constexpr std::int64_t kMost = kTimes * std::int64_t{13} * 1024 / 2;
  std::int64_t before = measure();
  for (int round = 1;; ++round) {
    ASSERT_NO_FATAL_FAILURE(restart(kTimes));
    const std::int64_t after = measure();
    fmt::print("{} times {} restarts: {} to {} bytes in use\n", round, kTimes, before, after);
    if (after - before < kMost) break;
    ASSERT_LT(round, 4) << "each round leaves more than " << kMost << " bytes";
    before = after;
  }
}

}  // namespace
}  // namespace plchost
