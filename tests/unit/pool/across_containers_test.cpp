// Users of a pool in several PID namespaces. Whether one runs is told by its lock in POOL.clients alone.

#include <array>
#include <atomic>
#include <chrono>
#include <functional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <fcntl.h>
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include "shm/pool/client_locks.hpp"
#include "shm/pool/object_pool.hpp"
#include "shm/pool/pool_clients.hpp"
#include "shm/pool/pool_layout.hpp"
#include "tests/support/another_namespace.hpp"
#include "tests/support/sanitized.hpp"
#include "tests/unit/pool/pool_storm.hpp"
#include "tests/unit/pool/unique_pool_name.hpp"

namespace plchost {
namespace {

using std::chrono::milliseconds;
using UseOfPool = std::function<void(ObjectPool&)>;

constexpr std::uint32_t kAcrossRoom = 256;

/// The words that processes tell each other here.
struct SharedSteps {
  std::atomic<std::uint32_t> step{0};
  std::atomic<std::uint64_t> a{0};
  std::atomic<std::uint64_t> b{0};
};

class AcrossContainers : public testing::Test {
 protected:
  AcrossContainers()
      : steps_(*new(::mmap(nullptr, sizeof(SharedSteps), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS,
                           -1, 0)) SharedSteps),
        pool_(make(name_.get())) {}
  ~AcrossContainers() override { ::munmap(&steps_, sizeof(SharedSteps)); }
  void SetUp() override {
    const InAnotherNamespace probe([] { return 0; });
    if (!probe.permitted()) GTEST_SKIP() << "a PID namespace needs root";
  }

  static ObjectPool make(const std::string& name, mode_t mode = 0660) {
    auto pool = ObjectPool::create(
        name, {.max_objects = kAcrossRoom, .rights = {.mode = mode}, .across_containers = true});
    return std::move(pool.value());
  }
  [[nodiscard]] ObjectPool another() const { return std::move(ObjectPool::attach(name_.get()).value()); }
  [[nodiscard]] std::string locks_path() const {
    return MemoryFile::path(ClientLocks::file_name(name_.get()));
  }
  void await_step(std::uint32_t step) const {
    while (steps_.step.load() != step) std::this_thread::sleep_for(milliseconds(1));
  }
  /// A process in a namespace of its own that does `body` with a pool of its own and then waits.
  [[nodiscard]] InAnotherNamespace client(const UseOfPool& body) const {
    steps_.step = 0;
    InAnotherNamespace process([&] {
      auto pool = another();
      body(pool);
      steps_.step = 1;
      for (;;) ::pause();
      return 0;
    });
    await_step(1);
    return process;
  }
  /// The same that does `body` and ends with its result: 0 is right.
  [[nodiscard]] int result_of(const std::function<int(ObjectPool&)>& body) const {
    return InAnotherNamespace([&] {
             auto pool = another();
             return body(pool);
           })
        .wait();
  }

  SharedSteps& steps_;
  UniquePoolName name_;
  ObjectPool pool_;
};

TEST_F(AcrossContainers, ClientIsSeenUnderTheNumberThatItHasHereAndLeavesNothingWhenItIsKilled) {
  auto other = client([](ObjectPool& pool) {
    (void)new auto(pool.create_semaphore("held", 1));
    (void)new auto(pool.create_memory("memory", 4096));
  });
  const auto held = pool_.look_at("held");
  ASSERT_TRUE(held) << "its holder lives";
  ASSERT_EQ(held->references.size(), 1U);
  EXPECT_EQ(held->references[0].pid, static_cast<std::uint32_t>(other.pid()));
  EXPECT_EQ(held->references[0].program, program_name());
  EXPECT_EQ(pool_.list()->size(), 2U);
  other.kill();
  EXPECT_EQ(pool_.open_semaphore("held").error().code, ErrorCode::not_found);
  EXPECT_TRUE(pool_.list()->empty());
}

TEST_F(AcrossContainers, ClientOutsideIsAliveForOneInsideThoughItsNumberIsNothingThere) {
  const auto mine = pool_.create_semaphore("mine", 1);
  ASSERT_TRUE(mine);
  EXPECT_EQ(result_of([](ObjectPool& pool) {
              const auto seen = pool.look_at("mine");
              if (!seen || seen->references.size() != 1) return 1;
              if (seen->references[0].pid != 0 || seen->references[0].program != program_name()) return 2;
              return pool.has_ended(seen->references[0]) ? 3 : 0;
            }),
            0);
  EXPECT_TRUE(mine->object.valid());
  EXPECT_EQ(pool_.look_at("mine")->references.at(0).pid, static_cast<std::uint32_t>(::getpid()));
}

TEST_F(AcrossContainers, EventsSemaphoresAndMemoriesAreShared) {
  const auto event = pool_.create_shared_event("event");
  const auto semaphore = pool_.create_semaphore("semaphore", 0);
  const auto memory = pool_.create_memory("memory", 4096);
  ASSERT_TRUE(event && semaphore && memory);
  std::uint64_t cursor = event->object.count();
  InAnotherNamespace other([&] {
    auto pool = another();
    const auto theirs = pool.open_memory("memory");
    if (!theirs) return 1;
    theirs->bytes()[7] = std::byte{42};
    if (pool.open_shared_event("event")->post() != ObjectStatus::done) return 2;
    return pool.open_semaphore("semaphore")->wait() == ObjectStatus::done ? 0 : 3;
  });
  EXPECT_EQ(event->object.wait(cursor), ObjectStatus::done);
  EXPECT_EQ(memory->object.bytes()[7], std::byte{42});
  EXPECT_EQ(semaphore->object.post(), ObjectStatus::done);
  EXPECT_EQ(other.wait(), 0);
}

TEST_F(AcrossContainers, KilledOwnerOfAMutexIsReportedOnceToOneOutside) {
  const auto sut = pool_.create_mutex("m");
  auto other = client([](ObjectPool& pool) {
    const auto* const mutex = new auto(pool.open_mutex("m"));
    (void)(*mutex)->lock();
  });
  EXPECT_EQ(sut->object.try_lock(), ObjectStatus::timed_out);
  EXPECT_EQ(sut->object.lock(MonotonicClock::now() + milliseconds(100)), ObjectStatus::timed_out);
  const auto seen = pool_.look_at("m");
  EXPECT_EQ(seen->value, 1U) << "the thread's number in its own namespace";
  other.kill();
  EXPECT_EQ(sut->object.lock(), ObjectStatus::owner_died);
  EXPECT_EQ(sut->object.unlock(), ObjectStatus::done);
  EXPECT_EQ(sut->object.lock(), ObjectStatus::done);
}

TEST_F(AcrossContainers, OwnerOutsideIsWaitedForAsLongAsItLives) {
  const auto sut = pool_.create_mutex("m");
  ASSERT_EQ(sut->object.lock(), ObjectStatus::done);
  InAnotherNamespace other([&] {
    auto pool = another();
    const auto mutex = pool.open_mutex("m");
    if (mutex->lock(MonotonicClock::now() + milliseconds(150)) != ObjectStatus::timed_out) return 1;
    steps_.step = 1;
    return mutex->lock() == ObjectStatus::done ? 0 : 2;
  });
  await_step(1);
  EXPECT_EQ(sut->object.unlock(), ObjectStatus::done);
  EXPECT_EQ(other.wait(), 0);
}

// Each of the two is process 1, thread 1.
TEST_F(AcrossContainers, ProcessesOfTheSameNumberKeepEachOtherOut) {
  const auto kept = pool_.create_mutex("m", {.keep = true});
  const auto work = [&] {
    auto pool = another();
    const auto mutex = pool.open_mutex("m");
    for (int i = 0; i < 2000; ++i) {
      if (mutex->lock() != ObjectStatus::done) return 1;
      if (mutex->try_lock() != ObjectStatus::deadlock) return 2;
      if (steps_.a.fetch_add(1) != steps_.b.load()) return 3;
      steps_.b.fetch_add(1);
      if (mutex->unlock() != ObjectStatus::done) return 4;
    }
    return 0;
  };
  InAnotherNamespace one(work);
  InAnotherNamespace two(work);
  EXPECT_EQ(one.wait(), 0);
  EXPECT_EQ(two.wait(), 0);
  EXPECT_EQ(steps_.b.load(), 4000U);
}

TEST_F(AcrossContainers, ThreadThatEndsWithAMutexHandsItToOneInside) {
  const auto sut = pool_.create_mutex("m");
  InAnotherNamespace other([&] {
    auto pool = another();
    const auto mutex = pool.open_mutex("m");
    await_step(1);
    steps_.step = 2;
    return mutex->lock() == ObjectStatus::owner_died ? 0 : 1;
  });
  std::thread([&] {
    EXPECT_EQ(sut->object.lock(), ObjectStatus::done);
    steps_.step = 1;
    await_step(2);
    std::this_thread::sleep_for(milliseconds(20));  // it waits by then
  }).join();
  EXPECT_EQ(other.wait(), 0);
}

TEST_F(AcrossContainers, KilledHolderOfThePoolsLockIsRepairedFromOutside) {
  const auto memory = MemoryFile::open(name_.get(), 1, MemoryFile::Access::read_write);
  auto& header = *reinterpret_cast<PoolHeader*>(memory->bytes().data());
  auto other = client([&](ObjectPool& pool) {
    (void)new auto(pool.create_semaphore("s", 1));
    const std::uint32_t number = PoolMutex::across(header.mutex).client();
    EXPECT_EQ(number, 0U);
    // As if it were in the midst of a call.
    const auto seen = pool.look_at("s");
    const ClientThread self{.client = static_cast<std::uint32_t>(seen->references.at(0).start), .thread = 1};
    (void)PoolMutex::across(header.mutex).try_lock(self);
    header.changes.fetch_or(1);
  });
  other.signal(SIGSTOP);
  const auto refused = pool_.create_semaphore("t", 3);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::timed_out);
  EXPECT_THAT(refused.error().describe(),
              testing::HasSubstr(fmt::format("process {} ({}) holds its lock", other.pid(), program_name())));
  const auto reader = ObjectPool::attach(name_.get(), ObjectPool::Access::read_only);
  EXPECT_TRUE(reader->open_semaphore("s", ObjectPool::Access::read_only)) << "one that reads does not wait";
  EXPECT_EQ(result_of([](ObjectPool& pool) {
              const auto told = pool.create_semaphore("t", 3);
              const std::string text =
                  fmt::format("program '{}' of another container holds its lock", program_name());
              return !told && told.error().message.find(text) != std::string::npos ? 0 : 1;
            }),
            0);
  other.kill();
  EXPECT_TRUE(pool_.list()->empty());
  EXPECT_EQ(header.repairs, 1U);
}

TEST_F(AcrossContainers, ProgramThatExecReplacedIsNoClient) {
  std::array<int, 2> ready{};
  ASSERT_EQ(::pipe(ready.data()), 0);
  const std::string script = fmt::format("echo >&{}; exec sleep 60", ready[1]);
  InAnotherNamespace other([&] {
    auto pool = another();
    auto made = pool.create_mutex("m");
    (void)made->object.lock();
    ::execlp("sh", "sh", "-c", script.c_str(), static_cast<char*>(nullptr));
    return 1;
  });
  char byte = 0;
  EXPECT_EQ(::read(ready[0], &byte, 1), 1) << "written by the next program";
  for (const int end : ready) ::close(end);
  EXPECT_TRUE(pool_.list()->empty());
}

TEST_F(AcrossContainers, ChildOfAForkHasNothingOfItsParents) {
  const auto sut = pool_.create_mutex("m");
  ASSERT_EQ(sut->object.lock(), ObjectStatus::done);
  const pid_t child = ::fork();
  if (child == 0) {
    const bool told = pool_.create_mutex("other").error().code == ErrorCode::wrong_state;
    if (!told || sut->object.unlock() != ObjectStatus::not_owner) ::_exit(1);
    auto own = another();
    const auto mutex = own.open_mutex("m");
    ::_exit(mutex && mutex->try_lock() == ObjectStatus::timed_out ? 0 : 2);
  }
  int status = -1;
  ::waitpid(child, &status, 0);
  EXPECT_EQ(WEXITSTATUS(status), 0);
  EXPECT_EQ(result_of([](ObjectPool& pool) {
              return pool.open_mutex("m")->try_lock() == ObjectStatus::timed_out ? 0 : 1;
            }),
            0)
      << "the child's end took nothing of its parent's";
  EXPECT_EQ(sut->object.unlock(), ObjectStatus::done);
}

TEST_F(AcrossContainers, ParentThatEndsIsNoClientThoughItsChildRunsOn) {
  const pid_t parent = ::fork();
  if (parent == 0) {
    auto pool = another();
    (void)new auto(pool.create_semaphore("s", 1));
    const pid_t child = ::fork();
    if (child == 0) {
      steps_.step = 1;
      for (;;) ::pause();
    }
    steps_.a = static_cast<std::uint64_t>(child);
    await_step(1);
    ::_exit(0);
  }
  ::waitpid(parent, nullptr, 0);
  EXPECT_TRUE(pool_.list()->empty());
  ::kill(static_cast<pid_t>(steps_.a.load()), SIGKILL);
}

// That takes away the locks of the process: another program's bug, or a second copy of the library.
TEST_F(AcrossContainers, CloseOfTheFileByTheProgramIsMadeGoodByItsNextCall) {
  const auto held = pool_.create_semaphore("held", 1);
  ASSERT_TRUE(held);
  ::close(::open(locks_path().c_str(), O_RDONLY | O_CLOEXEC));
  ASSERT_TRUE(pool_.list());
  const auto still_there = [](ObjectPool& pool) { return pool.open_semaphore("held") ? 0 : 1; };
  EXPECT_EQ(result_of(still_there), 0);
  // All descriptors, as a daemon does; and another file is opened under the number.
  struct stat locks{};
  ASSERT_EQ(::stat(locks_path().c_str(), &locks), 0);
  for (int fd = 3; fd < 64; ++fd) {
    struct stat status{};
    if (::fstat(fd, &status) == 0 && status.st_ino == locks.st_ino && status.st_dev == locks.st_dev) {
      const int other = ::open("/dev/null", O_RDONLY | O_CLOEXEC);
      ::dup3(other, fd, O_CLOEXEC);
      ::close(other);
    }
  }
  ASSERT_TRUE(pool_.list());
  EXPECT_EQ(result_of(still_there), 0);
}

TEST_F(AcrossContainers, OnlyThoseWhoMayWriteThePoolMayTouchTheLocks) {
  const UniquePoolName name;
  const auto pool = make(name.get(), 0664);
  struct stat status{};
  ASSERT_EQ(::stat(MemoryFile::path(ClientLocks::file_name(name.get())).c_str(), &status), 0);
  EXPECT_EQ(status.st_mode & 07777U, 0660U);
}

TEST_F(AcrossContainers, PoolWhoseLocksWereTakenAwayIsRefusedToNewClientsWithATextThatNamesThem) {
  ASSERT_EQ(::unlink(locks_path().c_str()), 0);
  EXPECT_EQ(InAnotherNamespace([&] {
              const auto refused = ObjectPool::attach(name_.get());
              const bool told = !refused && refused.error().code == ErrorCode::corrupt &&
                                refused.error().message.find(locks_path()) != std::string::npos;
              return told ? 0 : 1;
            }).wait(),
            0);
  EXPECT_TRUE(pool_.create_semaphore("s", 1)) << "those that have it go on";
}

TEST_F(AcrossContainers, PoolOfThatKindHasAnotherVersionSoThatOlderProgramsRefuseIt) {
  EXPECT_TRUE(pool_.across_containers());
  EXPECT_TRUE(another().across_containers());
  const auto memory = MemoryFile::open(name_.get(), 1, MemoryFile::Access::read_only);
  EXPECT_EQ(reinterpret_cast<const PoolHeader*>(memory->bytes().data())->version, kPoolVersionAcross);
  const UniquePoolName plain;
  const auto pool = std::move(ObjectPool::create(plain.get(), {.max_objects = kAcrossRoom}).value());
  EXPECT_FALSE(pool.across_containers());
  EXPECT_NE(::access(MemoryFile::path(ClientLocks::file_name(plain.get())).c_str(), F_OK), 0);
  EXPECT_FALSE(ObjectPool::create(plain.get(), {.across_containers = true})->across_containers())
      << "the way that it was made counts";
}

TEST_F(AcrossContainers, AtAnyInstructionLeavesAPoolThatTheNextCallRepairs) {
  const auto common = pool_.create_mutex("mutex0", {.keep = true});
  ASSERT_TRUE(common);
  const auto segment = MemoryFile::open(name_.get(), 1, MemoryFile::Access::read_write);
  const PoolView view(segment->bytes(), kAcrossRoom);
  constexpr unsigned kRounds = kSanitized ? 10 : 60;
  for (unsigned round = 0; round < kRounds; ++round) {
    std::vector<InAnotherNamespace> clients;
    for (unsigned i = 0; i < 3; ++i) {
      clients.emplace_back([&]() -> int { storm(name_.get(), round * 31 + i); });
    }
    std::this_thread::sleep_for(std::chrono::microseconds((kSanitized ? 20 : 3) * (400 + 53 * (round % 61))));
    for (InAnotherNamespace& one : clients) one.kill();
    expect_whole_after_a_storm(name_.get(), pool_, view);
    if (HasFatalFailure()) return;
    const ObjectStatus locked = common->object.lock(MonotonicClock::now() + std::chrono::seconds(20));
    ASSERT_TRUE(locked == ObjectStatus::done || locked == ObjectStatus::owner_died);
    ASSERT_EQ(common->object.unlock(), ObjectStatus::done);
  }
  EXPECT_GT(view.header().departed.load(), 0U);
  EXPECT_GT(view.header().repairs.load(), 0U) << "none of them died with the pool's lock held";
  EXPECT_EQ(view.header().rebuilds.load(), 0U) << "the unfinished step of one of them was not undone";
}

}  // namespace
}  // namespace plchost
