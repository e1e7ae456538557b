#include "shm/guard/memory_guard.hpp"

#include <atomic>
#include <csignal>
#include <cstdint>
#include <cstdlib>
#include <span>
#include <thread>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <sys/mman.h>
#include <unistd.h>

#include "shm/base/unique_fd.hpp"

namespace plchost {
namespace {

void on_bus_error(int, siginfo_t* info, void*) {
  if (!MemoryGuard::mend(info->si_addr)) std::abort();
}

class GuardedMemory : public testing::Test {
 protected:
  static constexpr std::size_t kSize = 64;

  GuardedMemory() {
    struct sigaction action{};
    action.sa_flags = SA_SIGINFO;
    action.sa_sigaction = on_bus_error;
    ::sigaction(SIGBUS, &action, &before_);
    resize(kSize);
    void* const address = ::mmap(nullptr, kSize, PROT_READ | PROT_WRITE, MAP_SHARED, file_.get(), 0);
    EXPECT_NE(address, MAP_FAILED);
    memory = std::span(static_cast<std::byte*>(address), kSize);
    memory[17] = std::byte{42};
  }
  ~GuardedMemory() override {
    ::munmap(memory.data(), memory.size());
    ::sigaction(SIGBUS, &before_, nullptr);
  }
  GuardedMemory(const GuardedMemory&) = delete;
  GuardedMemory& operator=(const GuardedMemory&) = delete;
  void resize(std::size_t size) const { EXPECT_EQ(::ftruncate(file_.get(), static_cast<off_t>(size)), 0); }
  [[nodiscard]] std::byte look() const { return static_cast<const volatile std::byte&>(memory[17]); }

  std::span<std::byte> memory;
  UniqueFd file_{::memfd_create("guarded", MFD_CLOEXEC)};

 private:
  struct sigaction before_{};
};

TEST_F(GuardedMemory, IsZeroOnceItsFileWasCutShortAndStaysSo) {
  const MemoryGuard sut(memory);
  ASSERT_TRUE(sut);
  EXPECT_EQ(look(), std::byte{42});
  resize(0);
  EXPECT_FALSE(sut.lost()) << "nobody has touched it yet";
  EXPECT_EQ(look(), std::byte{0});
  EXPECT_TRUE(sut.lost());
  resize(kSize);
  memory[17] = std::byte{7};
  EXPECT_EQ(look(), std::byte{7});
  EXPECT_TRUE(sut.lost());
}

// The thread sanitizer makes such an access under a lock of its own, which the handler must not need.
TEST_F(GuardedMemory, IsZeroForAtomicAccessesToo) {
  const auto touch = [this](auto access) {
    const MemoryGuard sut(memory);
    void* const shared =
        ::mmap(memory.data(), kSize, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_FIXED, file_.get(), 0);
    ASSERT_EQ(shared, memory.data());
    resize(0);
    access(std::atomic_ref(*reinterpret_cast<std::uint32_t*>(memory.data())));
    EXPECT_TRUE(sut.lost());
    resize(kSize);
  };
  touch([](auto word) { EXPECT_EQ(word.load(std::memory_order_acquire), 0U); });
  touch([](auto word) { EXPECT_EQ(word.fetch_add(1, std::memory_order_acq_rel), 0U); });
  touch([](auto word) { word.store(1, std::memory_order_release); });
}

TEST_F(GuardedMemory, OtherMemoryIsNotTouched) {
  const MemoryGuard sut(memory);
  const int other = 0;
  EXPECT_FALSE(MemoryGuard::mend(&other));
  EXPECT_FALSE(MemoryGuard::mend(nullptr));
  EXPECT_FALSE(MemoryGuard::mend(memory.data() + kSize));
  EXPECT_EQ(look(), std::byte{42});
}

TEST_F(GuardedMemory, GuardsThatGoMakeRoomForOthers) {
  std::vector<MemoryGuard> guards;
  for (std::size_t i = 0; i < MemoryGuard::kMost; ++i) EXPECT_TRUE(guards.emplace_back(memory));
  EXPECT_FALSE(MemoryGuard(memory));
  guards.clear();
  EXPECT_FALSE(MemoryGuard::mend(memory.data()));
  MemoryGuard first(memory);
  const MemoryGuard sut(std::move(first));
  EXPECT_TRUE(sut);
  resize(0);
  EXPECT_EQ(look(), std::byte{0});
  EXPECT_TRUE(sut.lost());
}

// As the threads of Cyclone DDS, in which the listeners of its readers run.
TEST_F(GuardedMemory, IsGuardedAlsoInAThreadThatHasAllSignalsBlocked) {
  const MemoryGuard sut(memory);
  resize(0);
  std::thread([&] {
    sigset_t all;
    sigfillset(&all);
    pthread_sigmask(SIG_BLOCK, &all, nullptr);
    MemoryGuard::watch_thread();
    EXPECT_EQ(look(), std::byte{0});
  }).join();
  EXPECT_TRUE(sut.lost());
}

}  // namespace
}  // namespace plchost
