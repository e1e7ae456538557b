// The gate of a secured host, and the packets of its own clients.
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include <dlfcn.h>
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
  // 6 handshakes in one process take long on a loaded machine. A client that stays deaf is seen all the same.
  static constexpr auto kLong = std::chrono::seconds(60);
  std::vector<std::jthread> clients;
  for (const auto& client : made) {
    clients.emplace_back([&client] {
      const TimePoint end = MonotonicClock::now() + std::chrono::seconds(8);
      while (MonotonicClock::now() < end) {
        EXPECT_TRUE(can_post(*client, kLong));
        EXPECT_TRUE(client->call({"cell", plc_OPERATION_STOP, "line1", ""}, MonotonicClock::now() + kLong));
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
  EXPECT_THAT(log(), testing::Not(testing::HasSubstr("rejected")));
}

// A libddsc that the client was not built with, by the name of its file.
TEST_F(OwnClients, SayThatAnUnknownCycloneFiltersNothing) {
  start();
  EXPECT_THAT(run("viewer", {"list", "instances"}).errors, testing::Not(testing::HasSubstr("not filtered")));
  Dl_info library{};
  ASSERT_NE(::dladdr(::dlsym(RTLD_DEFAULT, "dds_create_domain"), &library), 0);
  const std::string soname = std::filesystem::path(library.dli_fname).filename();
  const std::string libraries = base_ + "/libraries";
  std::filesystem::create_directory(libraries);
  std::filesystem::copy_file(std::filesystem::canonical(library.dli_fname),
                             libraries + "/libddsc.so.0.10.99");
  std::filesystem::create_symlink("libddsc.so.0.10.99", libraries + "/" + soname);
  ::setenv("LD_LIBRARY_PATH", libraries.c_str(), 1);  // NOLINT(concurrency-mt-unsafe)
  const RunResult listed = run("viewer", {"list", "instances"});
  ::unsetenv("LD_LIBRARY_PATH");  // NOLINT(concurrency-mt-unsafe)
  EXPECT_EQ(listed.code, 0) << listed.errors;
  EXPECT_THAT(listed.errors, testing::HasSubstr("packets of strangers are not filtered"));
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
