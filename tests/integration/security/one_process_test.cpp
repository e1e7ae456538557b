// Secured clients of one process, which are participants of one domain and know the host together.
#include <chrono>
#include <cstdint>
#include <thread>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <malloc.h>

#include "tests/integration/api/memory_growth.hpp"
#include "tests/integration/security/secured_host.hpp"
#include "tests/integration/security/wire.hpp"

namespace plchost {
namespace {

using ClientsOfOneProcess = SecuredHost;

TEST_F(ClientsOfOneProcess, OneWithoutTheKeysOfTheHostSilencesNoOther) {
  Wire wire;
  start();
  const auto first = make_client();
  ASSERT_TRUE(can_post(*first, kPatience));
  wire.lose_keys_but_of(wire.client());
  const auto second = make_client();
  ASSERT_TRUE(second);
  for (const auto end = soon(); wire.lost_keys() == 0 && MonotonicClock::now() < end;) {
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  ASSERT_GT(wire.lost_keys(), 0);
  std::this_thread::sleep_for(std::chrono::milliseconds(500));
  EXPECT_TRUE(can_post(*first, kPatience));
  wire.lose_keys_but_of("");
  EXPECT_TRUE(can_post(*second, kPatience));
}

// Each message that comes would leave its size in the process: some 4 MB together.
TEST_F(ClientsOfOneProcess, KeepNothingOfWhatTheyReceive) {
  if (kSanitized) GTEST_SKIP() << "a sanitizer keeps what was freed";
  ::mallopt(M_MMAP_THRESHOLD, 128 * 1024);  // receive buffers are not counted
  start();
  const auto first = make_client();
  const auto second = make_client();
  ASSERT_TRUE(can_post(*first, kPatience));
  ASSERT_TRUE(can_post(*second, kPatience));
  const auto ask = [&](int times) {
    for (int i = 0; i < times; ++i) {
      ASSERT_TRUE(first->call({"cell", plc_OPERATION_READ_CLOCK, "", ""}, soon()));
    }
  };
  ASSERT_NO_FATAL_FAILURE(ask(500));
  const auto before = static_cast<std::int64_t>(::mallinfo2().uordblks);
  ASSERT_NO_FATAL_FAILURE(ask(6000));
  const auto after = static_cast<std::int64_t>(::mallinfo2().uordblks);
  fmt::print("6000 answers: {} to {} bytes in use\n", before, after);
  EXPECT_LT(after - before, kPromise);
}

}  // namespace
}  // namespace plchost
