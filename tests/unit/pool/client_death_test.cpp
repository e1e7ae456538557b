#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <functional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <fcntl.h>
#include <gmock/gmock.h>
#include <sched.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include "shm/files/pool_files.hpp"
#include "shm/pool/object_pool.hpp"
#include "shm/pool/pool_layout.hpp"
#include "shm/threads/process_start.hpp"
#include "tests/support/sanitized.hpp"
#include "tests/unit/pool/pool_storm.hpp"
#include "tests/unit/pool/unique_pool_name.hpp"

namespace plchost {
namespace {

using std::chrono::milliseconds;

constexpr std::uint32_t kRoom = 256;

class ClientDeath : public testing::Test {
 protected:
  ClientDeath() : pool_(std::move(ObjectPool::create(name_.get(), {.max_objects = kRoom}).value())) {}
  [[nodiscard]] ObjectPool another() const { return std::move(ObjectPool::attach(name_.get()).value()); }

  /// A child that does `body` with a pool of its own and then waits to be killed.
  pid_t client(const std::function<void(ObjectPool&)>& body) {
    std::array<int, 2> ready{};
    EXPECT_EQ(::pipe(ready.data()), 0);
    const pid_t child = ::fork();
    if (child == 0) {
      auto pool = another();
      body(pool);
      (void)!::write(ready[1], "x", 1);
      for (;;) ::pause();
    }
    char byte = 0;
    EXPECT_EQ(::read(ready[0], &byte, 1), 1);
    ::close(ready[0]);
    ::close(ready[1]);
    return child;
  }
  static void kill_and_reap(pid_t child) {
    ::kill(child, SIGKILL);
    ::waitpid(child, nullptr, 0);
  }
  /// A client that holds ten objects dies, after `scribble` in its slot: nothing of it stays.
  void expect_all_released(const std::function<void(ClientSlot&)>& scribble, std::uint32_t written) {
    const auto file = MemoryFile::open(name_.get(), 1, MemoryFile::Access::read_write);
    ASSERT_TRUE(file);
    const pid_t child = client([](ObjectPool& pool) {
      static std::vector<SharedSemaphore> held;
      for (int i = 0; i < 10; ++i) {
        held.push_back(std::move(pool.create_semaphore(std::to_string(i), 1)->object));
      }
    });
    auto* const slots = reinterpret_cast<ClientSlot*>(file->bytes().data() + kClientsOffset);
    for (std::uint32_t i = 0; i < kMaxClients; ++i) {
      if (slots[i].pid == static_cast<std::uint32_t>(child)) scribble(slots[i]);
    }
    kill_and_reap(child);
    EXPECT_TRUE(pool_.list()->empty()) << written;
  }
  UniquePoolName name_;
  ObjectPool pool_;
};

TEST_F(ClientDeath, WhatItHeldIsReleasedByTheNextCall) {
  const pid_t child = client([](ObjectPool& pool) {
    static auto memory = pool.create_memory("memory", 4096);
    static auto semaphore = pool.create_semaphore("semaphore", 3);
    static auto kept = pool.create_semaphore("kept", 3, {.keep = true});
    static auto event = pool.create_shared_event("event");
  });
  EXPECT_EQ(pool_.list()->size(), 4U);
  kill_and_reap(child);
  EXPECT_EQ(pool_.open_memory("memory").error().code, ErrorCode::not_found);
  EXPECT_FALSE(std::filesystem::exists("/dev/shm/" + pool_memory_name(name_.get(), "memory")));
  const auto left = pool_.list().value();
  ASSERT_EQ(left.size(), 1U);
  EXPECT_EQ(left[0].name, "kept");
  EXPECT_TRUE(left[0].references.empty());
}

TEST_F(ClientDeath, OfAZombieIsFoundByAList) {
  const pid_t child = client([](ObjectPool& pool) { static auto made = pool.create_semaphore("s", 3); });
  ::kill(child, SIGKILL);
  siginfo_t info{};
  ::waitid(P_PID, static_cast<id_t>(child), &info, WEXITED | WNOWAIT);
  EXPECT_TRUE(pool_.list()->empty());
  kill_and_reap(child);
}

TEST_F(ClientDeath, OfAMutexOwnerIsReportedOnce) {
  const auto sut = pool_.create_mutex("m");
  const pid_t child = client([](ObjectPool& pool) {
    static auto mutex = pool.open_mutex("m");
    (void)mutex->lock();
  });
  EXPECT_EQ(sut->object.try_lock(), ObjectStatus::timed_out);
  kill_and_reap(child);
  EXPECT_EQ(sut->object.lock(), ObjectStatus::owner_died);
  EXPECT_EQ(sut->object.unlock(), ObjectStatus::done);
  EXPECT_EQ(sut->object.lock(), ObjectStatus::done);
}

TEST_F(ClientDeath, OfAWaiterIsNotCountedAmongTheWaiters) {
  const auto sut = pool_.create_semaphore("s", 0);
  const pid_t child = client([](ObjectPool& pool) {
    static auto semaphore = pool.open_semaphore("s");
    static std::thread waiter([] { (void)semaphore->wait(); });
  });
  while (pool_.look_at("s")->waiters != 1) std::this_thread::sleep_for(milliseconds(1));
  kill_and_reap(child);
  EXPECT_EQ(pool_.look_at("s")->waiters, 0U);
}

TEST_F(ClientDeath, ChildOfAForkIsToldToAttachAnew) {
  const auto held = pool_.create_mutex("m");
  const pid_t child = ::fork();
  if (child == 0) {
    const bool told = pool_.create_mutex("other").error().code == ErrorCode::wrong_state;
    ::_exit(told ? 0 : 1);
  }
  int status = -1;
  ::waitpid(child, &status, 0);
  EXPECT_EQ(status, 0);
  EXPECT_TRUE(pool_.open_mutex("m")) << "the child's end took nothing of its parent's";
}

TEST_F(ClientDeath, OfAProgramThatExecReplacedIsNoticed) {
  std::array<int, 2> ready{};
  ASSERT_EQ(::pipe2(ready.data(), O_CLOEXEC), 0);
  const pid_t child = ::fork();
  if (child == 0) {
    auto pool = another();
    auto made = pool.create_semaphore("s", 3);
    ::execlp("sleep", "sleep", "60", static_cast<char*>(nullptr));
    ::_exit(1);
  }
  ::close(ready[1]);
  char byte = 0;
  EXPECT_EQ(::read(ready[0], &byte, 1), 0) << "closed by exec()";
  ::close(ready[0]);
  while (look_at_thread(child)->image == 0) std::this_thread::sleep_for(milliseconds(1));
  EXPECT_TRUE(pool_.list()->empty());
  kill_and_reap(child);
}

TEST_F(ClientDeath, WhoIsStoppedWithTheLockIsNamedAndWhatIsClosedMeanwhileIsReleasedLater) {
  auto mine = pool_.create_semaphore("mine", 3);
  ASSERT_TRUE(mine);
  const auto memory = MemoryFile::open(name_.get(), 1, MemoryFile::Access::read_write);
  const pid_t child =
      client([&](ObjectPool&) { (void)reinterpret_cast<PoolHeader*>(memory->bytes().data())->mutex.lock(); });
  ::kill(child, SIGSTOP);
  const auto refused = pool_.create_semaphore("s", 3);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::timed_out);
  EXPECT_THAT(refused.error().describe(),
              testing::HasSubstr("process " + std::to_string(child) + " (unit_pool) holds its lock"));
  EXPECT_EQ(pool_.list().error().code, ErrorCode::timed_out);
  mine->object.close();
  (void)pool_.tidy();
  kill_and_reap(child);
  EXPECT_TRUE(pool_.list()->empty());
}

TEST_F(ClientDeath, AHolderThatAStrangerHasWrittenAndThatHasNoPoolIsNone) {
  const pid_t other = ::fork();
  if (other == 0) {
    ::execlp("sleep", "sleep", "60", nullptr);
    ::_exit(1);
  }
  // Until it runs another program it has the pool.
  const auto is_sleep = [&] {
    std::ifstream name("/proc/" + std::to_string(other) + "/comm");
    std::string text;
    return std::getline(name, text) && text == "sleep";
  };
  while (!is_sleep()) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  const auto memory = MemoryFile::open(name_.get(), 1, MemoryFile::Access::read_write);
  const auto word = static_cast<std::uint32_t>(other);
  std::memcpy(memory->bytes().data() + offsetof(PoolHeader, mutex), &word, sizeof word);
  const auto made = pool_.create_semaphore("s", 3);
  EXPECT_TRUE(made) << made.error().describe();
  kill_and_reap(other);
}

TEST_F(ClientDeath, OfOneThatHeldMoreThanIsReleasedAtOnceLeavesNothingToBeFound) {
  constexpr int kMemories = 200;
  const pid_t child = client([](ObjectPool& pool) {
    static std::vector<SharedMemory> held;
    for (int i = 0; i < kMemories; ++i) {
      held.push_back(std::move(pool.create_memory(std::to_string(i), 4096)->object));
    }
  });
  kill_and_reap(child);
  EXPECT_EQ(pool_.open_memory(std::to_string(kMemories - 1)).error().code, ErrorCode::not_found);
  EXPECT_TRUE(pool_.create_memory("0", 8192)->made);
  EXPECT_EQ(pool_.open_memory("1").error().code, ErrorCode::not_found);
}

TEST_F(ClientDeath, ReleasesItsReferencesWhereverTheyLieAndThoseOfNobodyElse) {
  constexpr int kObjects = 100;
  std::vector<SharedSemaphore> before;
  for (int i = 0; i < kObjects; ++i) {
    before.push_back(std::move(pool_.create_semaphore(std::to_string(i), 1)->object));
    if (i % 3 == 0) before.pop_back();
  }
  const pid_t child = client([](ObjectPool& pool) {
    static std::vector<SharedSemaphore> held;
    for (int i = 0; i < kObjects; ++i) {
      held.push_back(std::move(pool.create_semaphore(std::to_string(i), 1)->object));
    }
  });
  ObjectPool other = another();
  std::vector<SharedSemaphore> after;
  for (int i = 0; i < kObjects; i += 2) after.push_back(*other.open_semaphore(std::to_string(i)));
  kill_and_reap(child);
  for (const auto all = pool_.list().value(); const ObjectInfo& info : all) {
    const int i = std::stoi(info.name);
    EXPECT_EQ(info.reference_count, (i % 3 != 0 ? 1U : 0U) + (i % 2 == 0 ? 1U : 0U)) << info.name;
    EXPECT_EQ(info.references.size(), info.reference_count) << info.name;
  }
  for (int i = 0; i < kObjects; ++i) {
    EXPECT_EQ(pool_.look_at(std::to_string(i)).has_value(), i % 3 != 0 || i % 2 == 0) << i;
  }
}

// The place where the search for its references goes on lies in the pool, too.
TEST_F(ClientDeath, ReleasesAllThoughAStrangerHasWrittenOverThePlaceOfTheSearch) {
  for (const std::uint32_t place : {1U, 7U, 10U, kRoom, ~0U}) {
    expect_all_released([place](ClientSlot& slot) { slot.released = place; }, place);
  }
}

// The count of its references lies there, too.
TEST_F(ClientDeath, ReleasesAllThoughAStrangerHasWrittenOverTheCount) {
  for (const std::uint32_t count : {0U, 1U, ~0U}) {
    expect_all_released([count](ClientSlot& slot) { slot.reference_count = count; }, count);
  }
}

TEST_F(ClientDeath, ReleasesAllThoughAStrangerHasWrittenOverTheCountAndThePlaceOfTheSearch) {
  for (const std::uint32_t place : {1U, 0xffffffffU}) {
    const auto scribble = [place](ClientSlot& slot) {
      slot.reference_count = 0;
      slot.released = place;
    };
    expect_all_released(scribble, place);
  }
}

TEST_F(ClientDeath, SlotsOfManyDeadClientsAreUsedAgain) {
  for (int i = 0; i < 40; ++i) {
    std::vector<pid_t> children;
    for (int n = 0; n < 15; ++n) {
      children.push_back(client([](ObjectPool& pool) { static auto made = pool.create_semaphore("s", 3); }));
    }
    for (const pid_t child : children) kill_and_reap(child);
  }
  EXPECT_TRUE(pool_.create_semaphore("s", 1)->made);
}

TEST_F(ClientDeath, AtAnyInstructionLeavesAPoolThatTheNextCallRepairs) {
  const auto common = pool_.create_mutex("mutex0", {.keep = true});
  ASSERT_TRUE(common);
  const auto segment = MemoryFile::open(name_.get(), 1, MemoryFile::Access::read_write);
  const PoolView view(segment->bytes(), kRoom);
  // Processes with a sanitizer take long to begin; each instruction is met without one.
  constexpr unsigned kRounds = kSanitized ? 50 : 500;
  constexpr unsigned kSlowest = 20;
  unsigned slower = kSanitized ? 10 : 1;
  // On a busy machine some of them die before they are clients: the next ones have more time.
  std::uint64_t departed = 0;
  const auto enough = [&] { return view.header().departed.load() > kRounds; };
  for (unsigned round = 0; round < kRounds || (!enough() && round < 4 * kRounds); ++round) {
    std::array<pid_t, 3> children{};
    for (unsigned i = 0; pid_t & child : children) {
      child = ::fork();
      if (child == 0) storm(name_.get(), round * 31 + i);
      ++i;
    }
    std::this_thread::sleep_for(std::chrono::microseconds(slower * (400 + 53 * (round % 61))));
    for (const pid_t child : children) kill_and_reap(child);
    const std::uint64_t before = std::exchange(departed, view.header().departed.load());
    if (departed == before) slower = std::min(slower + 1, kSlowest);
    expect_whole_after_a_storm(name_.get(), pool_, view);
    if (HasFatalFailure()) return;
    const ObjectStatus locked = common->object.lock(MonotonicClock::now() + std::chrono::seconds(20));
    ASSERT_TRUE(locked == ObjectStatus::done || locked == ObjectStatus::owner_died);
    ASSERT_EQ(common->object.unlock(), ObjectStatus::done);
    for (int i = 0; i < 5; ++i) {
      ASSERT_TRUE(pool_.create_semaphore("semaphore" + std::to_string(i), 1)->made);
      ASSERT_TRUE(pool_.create_shared_event("event" + std::to_string(i))->made);
    }
  }
  EXPECT_GT(view.header().repairs.load(), 0U) << "none of them died with the pool's lock held";
  EXPECT_EQ(view.header().rebuilds.load(), 0U) << "the unfinished step of one of them was not undone";
  EXPECT_TRUE(enough());
}

/// The result of a process of another PID namespace that tries to use the pool: 0 is right.
int try_from_another_namespace(const std::string& name) {
  const auto is_told = [](const auto& pool) {
    return !pool && pool.error().code == ErrorCode::refused &&
           pool.error().message.find("PID namespace") != std::string::npos;
  };
  if (!is_told(ObjectPool::attach(name))) return 1;
  if (!is_told(ObjectPool::attach(name, ObjectPool::Access::read_only))) return 2;
  return is_told(ObjectPool::create(name)) ? 0 : 3;
}

// It would see no process under the numbers of the others, take all for dead, and release what they hold.
TEST_F(ClientDeath, IsNotSeenByAProcessOfAnotherPidNamespaceWhichIsRefused) {
  constexpr int kNotAllowed = 77;
  const pid_t holder =
      client([](ObjectPool& pool) { (void)new auto(std::move(pool.create_semaphore("held", 1)->object)); });
  const pid_t outside = ::fork();
  if (outside == 0) {
    if (::unshare(CLONE_NEWPID) != 0) ::_exit(kNotAllowed);
    const pid_t inside = ::fork();
    if (inside == 0) ::_exit(try_from_another_namespace(name_.get()));
    int status = 0;
    ::waitpid(inside, &status, 0);
    ::_exit(WEXITSTATUS(status));
  }
  int status = 0;
  ::waitpid(outside, &status, 0);
  const auto held = pool_.look_at("held");
  EXPECT_TRUE(held) << "its holder lives";
  EXPECT_EQ(held ? held->reference_count : 0U, 1U);
  kill_and_reap(holder);
  if (WEXITSTATUS(status) == kNotAllowed) GTEST_SKIP() << "a PID namespace needs root";
  EXPECT_EQ(WEXITSTATUS(status), 0);
}

}  // namespace
}  // namespace plchost
