// The datagrams of a secured client that does nothing.
#include <chrono>
#include <thread>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "tests/integration/security/secured_host.hpp"
#include "tests/integration/security/wire.hpp"

namespace plchost {
namespace {

using QuietClient = SecuredHost;

// It acknowledges the presence, which comes each 25 ms, and announces itself: some 120 datagrams a second.
// For each sample of the host that Cyclone does not note, it would send thousands.
TEST_F(QuietClient, AsksTheHostForNothingAgainAndAgain) {
  constexpr double kMost = 300;  // a second
  Wire wire;
  start();
  const auto client = make_client();
  ASSERT_TRUE(can_post(*client, kPatience));
  std::this_thread::sleep_for(std::chrono::seconds(1));
  const TimePoint began = MonotonicClock::now();
  const int before = wire.sent();
  std::this_thread::sleep_for(std::chrono::seconds(3));
  const int sent = wire.sent() - before;
  const double passed_s = std::chrono::duration<double>(MonotonicClock::now() - began).count();
  fmt::print("{} datagrams in {:.1f} s\n", sent, passed_s);
  EXPECT_LT(sent, kMost * passed_s);
}

}  // namespace
}  // namespace plchost
