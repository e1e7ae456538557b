// DDS domains of one process, which several clients use one after the other and at the same time.
#include "api/dds/domain.hpp"

#include <atomic>
#include <chrono>
#include <thread>
#include <vector>

#include <dds/dds.h>
#include <dlfcn.h>
#include <gtest/gtest.h>

#include "tests/integration/api/test_host.hpp"

namespace {

std::atomic<bool> deletes_are_late{false};

}  // namespace

/// In place of Cyclone's own: other threads run before an entity ends, as on a host with much to do.
extern "C" dds_return_t dds_delete(dds_entity_t entity) {
  using Delete = dds_return_t (*)(dds_entity_t);
  static const auto cyclones = reinterpret_cast<Delete>(::dlsym(RTLD_NEXT, "dds_delete"));
  if (deletes_are_late) std::this_thread::sleep_for(std::chrono::milliseconds(4));
  return cyclones(entity);
}

namespace plchost {
namespace {

TEST(DomainOfAProcess, CanBeOpenedWhileItsLastUserCloses) {
  constexpr int kThreads = 3;
  constexpr int kTimes = 20;
  const OwnDomain domain;
  dds::DomainOptions options;
  options.domain = domain.number();
  std::atomic<int> refused{0};
  deletes_are_late = true;
  {
    std::vector<std::jthread> clients;
    for (int i = 0; i < kThreads; ++i) {
      clients.emplace_back([&] {
        for (int time = 0; time < kTimes; ++time) {
          if (!dds::open_domain(dds::Role::client, options)) ++refused;
        }
      });
    }
  }
  deletes_are_late = false;
  EXPECT_EQ(refused, 0);
}

}  // namespace
}  // namespace plchost
