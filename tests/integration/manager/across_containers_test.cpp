// A host, and users of its pool that run as process 1 of other PID namespaces, as in containers.

#include <atomic>
#include <chrono>
#include <new>
#include <string>
#include <thread>

#include <gmock/gmock.h>
#include <sys/mman.h>

#include "shm/pool/object_pool.hpp"
#include "tests/integration/manager/plant.hpp"
#include "tests/support/another_namespace.hpp"

namespace plchost {
namespace {

using std::chrono::milliseconds;
using testing::HasSubstr;
using testing::IsEmpty;

class HostAcrossContainers : public testing::Test {
 protected:
  void SetUp() override {
    const InAnotherNamespace probe([] { return 0; });
    if (!probe.permitted()) GTEST_SKIP() << "a PID namespace needs root";
    plant.set_host_keys("pool_across_containers = true");
    plant.add("packer1", "packer");
    plant.start_manager();
    ASSERT_TRUE(plant.wait_for("packer1", InstanceState::running)) << plant.log();
  }
  /// It says so of itself once a second, from now on.
  bool has_counted(const std::string& products) {
    const std::size_t before = plant.log().size();
    return Plant::eventually(
        [&] { return plant.log().find("products " + products + ", ", before) != std::string::npos; });
  }
  [[nodiscard]] ObjectPool pool() const { return std::move(ObjectPool::attach(plant.pool()).value()); }
  /// A process of another namespace does `body` with the pool; its result.
  template <class Body>
  [[nodiscard]] int elsewhere(const Body& body) const {
    return InAnotherNamespace([&] {
             auto pool = ObjectPool::attach(plant.pool());
             return pool ? body(*pool) : 99;
           })
        .wait();
  }
  template <class Body>
  [[nodiscard]] InAnotherNamespace stays(const Body& body) {
    started_ = false;
    InAnotherNamespace process([&] {
      auto pool = ObjectPool::attach(plant.pool());
      if (!pool) return 99;
      body(*pool);
      started_ = true;
      for (;;) ::pause();
      return 0;
    });
    while (!started_) std::this_thread::sleep_for(milliseconds(1));
    return process;
  }

  Plant plant;

 private:
  std::atomic<bool>& started_ = *new (::mmap(nullptr, sizeof(std::atomic<bool>), PROT_READ | PROT_WRITE,
                                             MAP_SHARED | MAP_ANONYMOUS, -1, 0)) std::atomic<bool>(false);
};

TEST_F(HostAcrossContainers, RunsTasksForPostsOfAnotherContainerAndShowsItsProcesses) {
  EXPECT_EQ(elsewhere([](ObjectPool& pool) {
              const auto event = pool.open_event("packer1/product");
              for (int i = 0; event && i < 24; ++i) (void)event->post();
              return event ? 0 : 1;
            }),
            0);
  EXPECT_TRUE(has_counted("24"));
  auto firmware = stays([](ObjectPool& pool) { (void)new auto(pool.create_memory("inputs", 4096)); });
  const auto seen = pool().look_at("inputs");
  ASSERT_TRUE(seen && seen->references.size() == 1);
  EXPECT_EQ(seen->references[0].pid, static_cast<std::uint32_t>(firmware.pid()));
  firmware.kill();
  // By the manager, which looks once a second.
  EXPECT_TRUE(Plant::eventually(
      [&] { return ::access(("/dev/shm/" + plant.pool() + ".memory.inputs").c_str(), F_OK) != 0; }));
}

TEST_F(HostAcrossContainers, KilledManagersAndInstancesAndClientsTakeNothingFromOthers) {
  auto firmware = stays([](ObjectPool& pool) {
    const auto& mutex = *new auto(pool.create_mutex("mutex", {.keep = true}));
    (void)mutex->object.lock();
    (void)new auto(pool.create_semaphore("held", 1));
  });
  plant.kill_manager();
  plant.start_manager();
  ASSERT_TRUE(plant.wait_for("packer1", InstanceState::running)) << plant.log();
  EXPECT_THAT(plant.log(), HasSubstr("adopted"));
  plant.kill_instances();
  ASSERT_TRUE(Plant::eventually([&] { return plant.status("packer1").restarts == 1; }));
  ASSERT_TRUE(plant.wait_for("packer1", InstanceState::running));
  EXPECT_EQ(elsewhere([](ObjectPool& pool) {
              if (pool.open_mutex("mutex")->try_lock() != ObjectStatus::timed_out) return 1;
              const auto held = pool.look_at("held");
              if (!held || held->references.size() != 1) return 2;
              const auto event = pool.open_event("packer1/product");
              return event && event->post() == PostResult::posted ? 0 : 3;
            }),
            0);
  EXPECT_TRUE(has_counted("1"));
  firmware.kill();
  EXPECT_EQ(elsewhere([](ObjectPool& pool) {
              if (pool.open_mutex("mutex")->lock() != ObjectStatus::owner_died) return 1;
              return pool.look_at("held") ? 2 : 0;
            }),
            0);
  EXPECT_EQ(plant.stop_manager().describe(), "exit code 0");
  EXPECT_THAT(plant.leftovers(), IsEmpty());
}

TEST_F(HostAcrossContainers, PoolOfTheOtherKindStaysAsItIsAndTheLogSaysSo) {
  plant.kill_manager();
  plant.set_host_keys("");
  plant.start_manager();
  ASSERT_TRUE(plant.wait_for("packer1", InstanceState::running)) << plant.log();
  EXPECT_THAT(plant.log(), HasSubstr("was made with [host] pool_across_containers = true and stays so"));
  EXPECT_TRUE(pool().across_containers());
}

}  // namespace
}  // namespace plchost
