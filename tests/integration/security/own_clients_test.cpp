// The gate of a secured host, and the packets of its own clients.
#include <chrono>
#include <fstream>
#include <iterator>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include <gmock/gmock.h>

#include "tests/integration/security/secured_host.hpp"

namespace plchost {
namespace {

class OwnClients : public SecuredHost {
 protected:
  [[nodiscard]] std::string log() const {
    std::ifstream file(base_ + "/log.errors");
    return {std::istreambuf_iterator<char>(file), {}};
  }
};

// Clients send liveliness at 80 % of their lease, so each sends it several times. The server warns of the
// first datagram that it refuses within a second.
TEST_F(OwnClients, AreNeverRefusedByTheGate) {
  host_.log_to(base_ + "/log");
  start();
  std::vector<std::unique_ptr<ControlClient>> made;
  for (int i = 0; i < 6; ++i) made.push_back(make_client());
  std::vector<std::jthread> clients;
  for (const auto& client : made) {
    clients.emplace_back([&client] {
      const TimePoint end = MonotonicClock::now() + std::chrono::seconds(8);
      while (MonotonicClock::now() < end) {
        EXPECT_TRUE(client->post_event({"cell", 0, "line1", "ready"}, 1, {}, kPatience));
        EXPECT_TRUE(client->call({"cell", plc_OPERATION_STOP, "line1", ""}, soon()));
        std::this_thread::sleep_for(std::chrono::milliseconds(100));
      }
    });
  }
  // Those that come and go: processes, because all clients of a process have one identity.
  for (const char* const identity : {"viewer", "engineer", "admin", "viewer"}) {
    EXPECT_TRUE(sees_host(folder(identity)));
  }
  clients.clear();
  made.clear();
  std::this_thread::sleep_for(std::chrono::seconds(2));
  EXPECT_THAT(log(), testing::Not(testing::HasSubstr("refused")));
}

// The first ones of a process load Cyclone's security plugins.
TEST_F(OwnClients, OfOneProcessCanBeMadeAtTheSameTime) {
  for (int round = 0; round < 12; ++round) {
    std::vector<std::jthread> makers;
    for (int i = 0; i < 6; ++i) {
      makers.emplace_back([this] {
        dds::DomainOptions options;
        options.domain = domain_.number();
        options.identity = folder("operator");
        const auto made = ControlClient::connect(options);
        EXPECT_TRUE(made) << made.error().describe();
      });
    }
  }
}

}  // namespace
}  // namespace plchost
