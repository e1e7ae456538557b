// A client that is killed after each instruction in turn that changes the lists of the pool, by a debugger.

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <functional>
#include <set>
#include <string>
#include <utility>

#include <gtest/gtest.h>
#include <signal.h>
#include <sys/ptrace.h>
#include <sys/user.h>
#include <sys/wait.h>
#include <unistd.h>

#include "shm/pool/object_pool.hpp"
#include "tests/support/sanitized.hpp"
#include "tests/unit/pool/pool_invariants.hpp"
#include "tests/unit/pool/unique_pool_name.hpp"

namespace plchost {
namespace {

constexpr std::uint32_t kPlaces = 16;

using Work = std::function<void(ObjectPool&)>;

class EachInstruction : public testing::Test {
 protected:
  void SetUp() override {
    if (kSanitized) GTEST_SKIP() << "too many instructions";
  }
  explicit EachInstruction(bool across_containers = false)
      : pool_(std::move(
            ObjectPool::create(name_.get(), {.max_objects = kPlaces, .across_containers = across_containers})
                .value())),
        memory_(std::move(MemoryFile::open(name_.get(), 1, MemoryFile::Access::read_write).value())) {}

  /// Where the pool's file is mapped in this process.
  [[nodiscard]] std::set<std::uintptr_t> mappings() const {
    std::set<std::uintptr_t> found;
    std::ifstream maps("/proc/self/maps");
    for (std::string line; std::getline(maps, line);) {
      if (line.ends_with("/" + name_.get())) found.insert(std::stoull(line, nullptr, 16));
    }
    return found;
  }

  /// A child that attaches, does `before` and `call`, and `call` again, in which it is killed. That is
  /// `steps` instructions after the `write`-th time that it has written how much it had noted. False: it came
  /// to its end.
  bool kill_within(const Work& before, const Work& call, int write, int steps) {
    std::array<int, 2> told{};
    EXPECT_EQ(::pipe(told.data()), 0);
    const pid_t child = ::fork();
    if (child == 0) {
      const auto others = mappings();
      auto pool = std::move(ObjectPool::attach(name_.get()).value());
      for (const std::uintptr_t address : mappings()) {
        if (!others.contains(address)) (void)!::write(told[1], &address, sizeof address);
      }
      before(pool);
      call(pool);  // the work that a process does only once is not counted
      ::ptrace(PTRACE_TRACEME, 0, nullptr, nullptr);
      ::raise(SIGSTOP);
      call(pool);
      ::_exit(0);
    }
    std::uintptr_t address = 0;
    EXPECT_EQ(::read(told[0], &address, sizeof address), ssize_t{sizeof address});
    ::close(told[0]);
    ::close(told[1]);
    int status = 0;
    ::waitpid(child, &status, 0);
    EXPECT_TRUE(WIFSTOPPED(status));
    const bool watched = watch(child, address + offsetof(PoolHeader, noted));
    for (int i = 0; watched && i < write && WIFSTOPPED(status); ++i) go_on(PTRACE_CONT, child, status);
    for (int i = 0; i < steps && WIFSTOPPED(status); ++i) go_on(PTRACE_SINGLESTEP, child, status);
    if (!WIFSTOPPED(status)) return false;
    ::kill(child, SIGKILL);
    ::waitpid(child, &status, 0);
    return watched;
  }
  static void go_on(__ptrace_request how, pid_t child, int& status) {
    ::ptrace(how, child, nullptr, nullptr);
    ::waitpid(child, &status, 0);
  }
  /// Stops the child after each time that it writes the word.
  static bool watch([[maybe_unused]] pid_t child, [[maybe_unused]] std::uintptr_t word) {
#if defined(__x86_64__)
    constexpr std::uintptr_t kFourBytesWritten = 0b1101U << 16U | 1U;
    const auto set = [child](std::size_t number, std::uintptr_t value) {
      const std::size_t place = offsetof(user, u_debugreg) + number * sizeof(std::uintptr_t);
      return ::ptrace(PTRACE_POKEUSER, child, place, value) == 0;
    };
    return set(0, word) && set(7, kFourBytesWritten);
#else
    return false;
#endif
  }

  /// Some virtual machines take watchpoints and never report them.
  static bool reports_watchpoints() {
    static std::atomic<std::uint32_t> word{0};
    const pid_t child = ::fork();
    if (child == 0) {
      ::ptrace(PTRACE_TRACEME, 0, nullptr, nullptr);
      ::raise(SIGSTOP);
      word.store(1);
      ::_exit(0);
    }
    int status = 0;
    ::waitpid(child, &status, 0);
    const bool watched = WIFSTOPPED(status) && watch(child, reinterpret_cast<std::uintptr_t>(&word));
    go_on(PTRACE_CONT, child, status);
    const bool reported = watched && WIFSTOPPED(status);
    if (WIFSTOPPED(status)) {
      ::kill(child, SIGKILL);
      ::waitpid(child, &status, 0);
    }
    return reported;
  }

  [[nodiscard]] std::size_t files() const {
    std::size_t count = 0;
    for (const auto& file : std::filesystem::directory_iterator("/dev/shm")) {
      if (file.path().filename().string().starts_with(name_.get() + ".memory.")) ++count;
    }
    return count;
  }

  void campaign(const Work& before, const Work& call) {
    if (!reports_watchpoints()) GTEST_SKIP() << "this host has no watchpoints";
    constexpr int kSteps = 24;  // more than there are between two notes
    const PoolView view(memory_.bytes(), kPlaces);
    int writes = 1;
    for (int steps = 0; kill_within(before, call, writes, steps); ++steps) {
      const std::string where = fmt::format("{} instructions after note {}", steps, writes);
      (void)pool_.tidy();
      ASSERT_EQ(damage_of(view), "") << where;
      std::size_t memories = 0;
      const auto objects = pool_.list().value();
      for (const ObjectInfo& info : objects) {
        ASSERT_TRUE(info.kept || info.type == ObjectType::event) << info.name << ", " << where;
        ASSERT_EQ(info.reference_count, 0U) << info.name << ", " << where;
        memories += info.type == ObjectType::memory ? 1 : 0;
      }
      ASSERT_EQ(files(), memories) << where;
      for (const char* const name : {"a", "b", "kept"}) (void)pool_.remove_object(name);
      if (steps < kSteps) continue;
      steps = -1;
      ++writes;
    }
    EXPECT_GT(writes, 5);
    EXPECT_GT(view.header().repairs.load(), 0U);
    EXPECT_EQ(view.header().rebuilds.load(), 0U) << "nothing was made anew that could be undone";
  }

  UniquePoolName name_;
  ObjectPool pool_;
  MemoryFile memory_;
};

TEST_F(EachInstruction, OfMakingAndClosingAMemory) {
  campaign([](ObjectPool&) {}, [](ObjectPool& pool) { (void)pool.create_memory("a", 100); });
}

TEST_F(EachInstruction, OfMakingAKeptMemoryAndRemovingIt) {
  campaign([](ObjectPool& pool) { (void)pool.create_semaphore("b", 1); },
           [](ObjectPool& pool) {
             (void)pool.create_memory("kept", 100, {.keep = true});
             (void)pool.remove_object("kept");
           });
}

TEST_F(EachInstruction, OfMakingOpeningAndClosingASemaphore) {
  campaign([](ObjectPool& pool) { static const auto held = pool.create_semaphore("a", 1); },
           [](ObjectPool& pool) {
             (void)pool.create_semaphore("b", 1);
             (void)pool.open_semaphore("a");
           });
}

TEST_F(EachInstruction, OfTheReleaseOfWhatADeadOneHeld) {
  bool again = false;
  campaign(
      [&](ObjectPool& mine) {
        (void)mine.open_semaphore("none");
        const pid_t other = ::fork();
        if (other == 0) {
          auto pool = std::move(ObjectPool::attach(name_.get()).value());
          const auto memory = pool.create_memory("a", 100);
          const auto semaphore = pool.create_semaphore("b", 1);
          ::_exit(0);
        }
        ::waitpid(other, nullptr, 0);
      },
      [&](ObjectPool& pool) {
        if (std::exchange(again, true)) (void)pool.open_semaphore("none");
      });
}

TEST_F(EachInstruction, OfMakingAnEventInThePlaceOfOneThatNobodyNeeds) {
  for (std::uint32_t i = 0; i < kPlaces; ++i) ASSERT_TRUE(pool_.create_event("event" + std::to_string(i)));
  campaign([](ObjectPool&) {},
           [made = 0](ObjectPool& pool) mutable { (void)pool.create_event("new" + std::to_string(made++)); });
}

/// The same in a pool whose users know each other by locks alone.
class EachInstructionAcrossContainers : public EachInstruction {
 protected:
  EachInstructionAcrossContainers() : EachInstruction(true) {}
};

TEST_F(EachInstructionAcrossContainers, OfMakingAKeptMemoryAndRemovingIt) {
  campaign([](ObjectPool& pool) { (void)pool.create_semaphore("b", 1); },
           [](ObjectPool& pool) {
             (void)pool.create_memory("kept", 100, {.keep = true});
             (void)pool.remove_object("kept");
           });
}

TEST_F(EachInstructionAcrossContainers, OfMakingOpeningAndClosingASemaphore) {
  campaign([](ObjectPool& pool) { static const auto held = pool.create_semaphore("a", 1); },
           [](ObjectPool& pool) {
             (void)pool.create_semaphore("b", 1);
             (void)pool.open_semaphore("a");
           });
}

}  // namespace
}  // namespace plchost
