#include "shm/plc_pool.h"

#include <chrono>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <set>
#include <string>
#include <string_view>
#include <thread>

#include <gmock/gmock.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include "shm/plc_obj_tab.h"
#include "tests/unit/pool_library/library_fixture.hpp"

namespace {

using testing::HasSubstr;

constexpr rlimit kNoCore{};

class PlcPool : public LibraryFixture {};

TEST_F(PlcPool, SaysInWordsWhatWasWrong) {
  plc_pool* none = nullptr;
  EXPECT_EQ(plc_pool_open("plchost-test-none", PLC_POOL_READ_WRITE, &none), PLC_POOL_NO_OBJECT);
  EXPECT_THAT(plc_pool_error(), HasSubstr("plchost-test-none"));
  EXPECT_EQ(plc_pool_open("../etc/passwd", PLC_POOL_READ_WRITE, &none), PLC_POOL_ARGUMENT);
  EXPECT_EQ(plc_pool_open(name_.c_str(), 7, &none), PLC_POOL_ARGUMENT);
  EXPECT_EQ(plc_pool_open(name_.c_str(), PLC_POOL_READ, nullptr), PLC_POOL_ARGUMENT);
  EXPECT_EQ(none, nullptr);
  std::set<std::string> texts;
  for (int result = PLC_POOL_SYSTEM; result <= PLC_POOL_OWNER_DIED; ++result)
    texts.insert(plc_pool_text(result));
  EXPECT_EQ(texts.size(), 15U) << "each result has a text of its own";
  EXPECT_STREQ(plc_pool_text(99), "unknown result");
}

TEST_F(PlcPool, EachResultOfACreateIsToldApart) {
  plc_memory* memory = nullptr;
  plc_memory* again = nullptr;
  plc_mutex* mutex = nullptr;
  EXPECT_EQ(plc_memory_create(pool_, "m", 100, nullptr, &memory), PLC_POOL_OK);
  EXPECT_EQ(plc_memory_create(pool_, "m", 100, nullptr, &again), PLC_POOL_ALREADY_THERE);
  EXPECT_EQ(plc_memory_size(again), 100U);
  static_cast<char*>(plc_memory_address(memory))[99] = 'x';
  EXPECT_EQ(static_cast<char*>(plc_memory_address(again))[99], 'x');
  plc_memory_close(again);
  EXPECT_EQ(plc_memory_create(pool_, "m", 101, nullptr, &again), PLC_POOL_WRONG_SIZE);
  EXPECT_EQ(plc_mutex_create(pool_, "m", nullptr, &mutex), PLC_POOL_WRONG_TYPE);
  EXPECT_EQ(plc_mutex_create(pool_, "", nullptr, &mutex), PLC_POOL_ARGUMENT);
  EXPECT_EQ(plc_mutex_create(pool_, nullptr, nullptr, &mutex), PLC_POOL_ARGUMENT);
  EXPECT_EQ(plc_mutex_create(nullptr, "x", nullptr, &mutex), PLC_POOL_ARGUMENT);
  EXPECT_EQ(plc_memory_create(pool_, "huge", std::size_t{1} << 50, nullptr, &again), PLC_POOL_FULL);
  EXPECT_EQ(plc_mutex_open(pool_, "none", &mutex), PLC_POOL_NO_OBJECT);
  plc_memory_close(memory);
  EXPECT_EQ(plc_memory_open(pool_, "m", PLC_POOL_READ, &memory), PLC_POOL_NO_OBJECT)
      << "gone with its last reference";
}

TEST_F(PlcPool, OptionsOfAnotherHeaderAreRefused) {
  plc_object_options options{};
  plc_mutex* mutex = nullptr;
  EXPECT_EQ(plc_mutex_create(pool_, "m", &options, &mutex), PLC_POOL_ARGUMENT);
  options.size = sizeof(options);
  options.flags = 64;
  EXPECT_EQ(plc_mutex_create(pool_, "m", &options, &mutex), PLC_POOL_ARGUMENT);
  options.flags = PLC_POOL_KEEP;
  options.mode = 01777;
  EXPECT_EQ(plc_mutex_create(pool_, "m", &options, &mutex), PLC_POOL_ARGUMENT);
  options.mode = 0640;
  ASSERT_EQ(plc_mutex_create(pool_, "m", &options, &mutex), PLC_POOL_OK);
  plc_mutex_close(mutex);
  EXPECT_EQ(plc_mutex_open(pool_, "m", &mutex), PLC_POOL_OK) << "kept";
  plc_mutex_close(mutex);
  EXPECT_EQ(plc_pool_remove(pool_, "m"), PLC_POOL_OK);
  EXPECT_EQ(plc_pool_remove(pool_, "m"), PLC_POOL_NO_OBJECT);
}

TEST_F(PlcPool, EventsAreCounted) {
  plc_event* event = nullptr;
  ASSERT_EQ(plc_event_create(pool_, "e", nullptr, &event), PLC_POOL_OK);
  plc_pool_u64 cursor = plc_event_count(event);
  EXPECT_EQ(plc_event_wait(event, &cursor, PLC_POOL_NO_WAIT), PLC_POOL_TIMED_OUT);
  EXPECT_EQ(plc_event_wait(event, &cursor, PLC_POOL_FOREVER - 1), PLC_POOL_TIMED_OUT)
      << "a time that is over";
  EXPECT_EQ(plc_event_wait(event, &cursor, 1'000'000), PLC_POOL_TIMED_OUT);
  std::thread poster([&] {
    for (int i = 0; i < 3; ++i) plc_event_post(event);
  });
  while (cursor < 3) EXPECT_EQ(plc_event_wait(event, &cursor, PLC_POOL_FOREVER), PLC_POOL_OK);
  poster.join();
  EXPECT_EQ(cursor, 3U);
  EXPECT_EQ(plc_event_post(nullptr), PLC_POOL_ARGUMENT);
  plc_event_close(event);
}

TEST_F(PlcPool, SemaphoresAndMutexesSayWhatHappened) {
  plc_semaphore* semaphore = nullptr;
  EXPECT_EQ(plc_semaphore_create(pool_, "s", PLC_POOL_MAX_VALUE + 1, nullptr, &semaphore), PLC_POOL_ARGUMENT);
  ASSERT_EQ(plc_semaphore_create(pool_, "s", PLC_POOL_MAX_VALUE, nullptr, &semaphore), PLC_POOL_OK);
  EXPECT_EQ(plc_semaphore_post(semaphore), PLC_POOL_FULL);
  EXPECT_EQ(plc_semaphore_wait(semaphore, PLC_POOL_NO_WAIT), PLC_POOL_OK);
  EXPECT_EQ(plc_semaphore_value(semaphore), PLC_POOL_MAX_VALUE - 1);
  plc_semaphore_close(semaphore);
  ASSERT_EQ(plc_semaphore_create(pool_, "s", 0, nullptr, &semaphore), PLC_POOL_OK);
  EXPECT_EQ(plc_semaphore_wait(semaphore, 1'000'000), PLC_POOL_TIMED_OUT);
  plc_mutex* mutex = nullptr;
  ASSERT_EQ(plc_mutex_create(pool_, "m", nullptr, &mutex), PLC_POOL_OK);
  EXPECT_EQ(plc_mutex_unlock(mutex), PLC_POOL_NOT_OWNER);
  EXPECT_EQ(plc_mutex_lock(mutex, PLC_POOL_FOREVER), PLC_POOL_OK);
  EXPECT_EQ(plc_mutex_lock(mutex, PLC_POOL_FOREVER), PLC_POOL_DEADLOCK);
  EXPECT_EQ(plc_mutex_unlock(mutex), PLC_POOL_OK);
  std::thread([&] { plc_mutex_lock(mutex, PLC_POOL_FOREVER); }).join();
  EXPECT_EQ(plc_mutex_lock(mutex, PLC_POOL_FOREVER), PLC_POOL_OWNER_DIED);
  plc_mutex_close(mutex);
  plc_semaphore_close(semaphore);
}

TEST_F(PlcPool, WhoseFileIsCutShortIsCorruptInEachCallAndNotTheEnd) {
  plc_event* event = nullptr;
  plc_semaphore* semaphore = nullptr;
  plc_mutex* mutex = nullptr;
  plc_memory* memory = nullptr;
  ASSERT_EQ(plc_event_create(pool_, "e", nullptr, &event), PLC_POOL_OK);
  ASSERT_EQ(plc_semaphore_create(pool_, "s", 5, nullptr, &semaphore), PLC_POOL_OK);
  ASSERT_EQ(plc_mutex_create(pool_, "m", nullptr, &mutex), PLC_POOL_OK);
  ASSERT_EQ(plc_memory_create(pool_, "b", 8192, nullptr, &memory), PLC_POOL_OK);
  std::filesystem::resize_file("/dev/shm/" + name_, 0);
  std::filesystem::resize_file("/dev/shm/" + name_ + ".memory.b", 0);
  plc_pool_u64 cursor = 0;
  plc_memory* other = nullptr;
  EXPECT_EQ(plc_event_post(event), PLC_POOL_CORRUPT);
  EXPECT_EQ(plc_event_wait(event, &cursor, PLC_POOL_FOREVER), PLC_POOL_CORRUPT);
  EXPECT_EQ(plc_event_count(event), 0U);
  EXPECT_EQ(plc_semaphore_post(semaphore), PLC_POOL_CORRUPT);
  EXPECT_EQ(plc_semaphore_wait(semaphore, PLC_POOL_FOREVER), PLC_POOL_CORRUPT);
  EXPECT_EQ(plc_mutex_lock(mutex, PLC_POOL_FOREVER), PLC_POOL_CORRUPT);
  EXPECT_EQ(plc_mutex_unlock(mutex), PLC_POOL_CORRUPT);
  EXPECT_EQ(static_cast<char*>(plc_memory_address(memory))[8191], 0);
  EXPECT_EQ(plc_memory_open(pool_, "b", PLC_POOL_READ_WRITE, &other), PLC_POOL_CORRUPT);
  EXPECT_THAT(plc_pool_error(), HasSubstr("cut its file in /dev/shm short"));
  EXPECT_EQ(plc_memory_create(pool_, "c", 10, nullptr, &other), PLC_POOL_CORRUPT);
  EXPECT_EQ(plc_pool_remove(pool_, "b"), PLC_POOL_CORRUPT);
  EXPECT_EQ(plc_pool_list(pool_, [](const plc_object_info*, void*) { return 0; }, nullptr), PLC_POOL_CORRUPT);
  plc_event_close(event);
  plc_semaphore_close(semaphore);
  plc_mutex_close(mutex);
  plc_memory_close(memory);
}

TEST_F(PlcPool, ASigbusThatIsNotOfItsMemoryGoesToTheHandlerThatWasThere) {
  const auto in_a_child = [&](bool with_handler) {
    const pid_t child = ::fork();
    if (child == 0) {
      ::alarm(20);
      // In a program of its own: the library sets its handler once for each process.
      ::execl("/proc/self/exe", "bus", "--gtest_also_run_disabled_tests",
              with_handler ? "--gtest_filter=*DISABLED_BusOfOthersWithAHandler"
                           : "--gtest_filter=*DISABLED_BusOfOthers",
              static_cast<char*>(nullptr));
      ::_exit(1);
    }
    int status = -1;
    ::waitpid(child, &status, 0);
    return status;
  };
  const int handled = in_a_child(true);
  EXPECT_TRUE(WIFEXITED(handled) && WEXITSTATUS(handled) == 7) << handled;
  const int ended = in_a_child(false);
  EXPECT_TRUE(WIFSIGNALED(ended) && WTERMSIG(ended) == SIGBUS) << ended;
}

// Touches a page of a file of its own that is not there.
void touch_beyond_the_end() {
  plc_pool* pool = nullptr;
  (void)plc_pool_open("plchost-test-none", PLC_POOL_READ_WRITE, &pool);
  const int file = ::memfd_create("short", 0);
  void* const address = ::mmap(nullptr, 4096, PROT_READ, MAP_SHARED, file, 0);
  (void)*static_cast<const volatile char*>(address);
}
TEST(PlcPoolChild, DISABLED_BusOfOthers) {
  ::setrlimit(RLIMIT_CORE, &kNoCore);
  touch_beyond_the_end();
}
TEST(PlcPoolChild, DISABLED_BusOfOthersWithAHandler) {
  ::signal(SIGBUS, [](int) { ::_exit(7); });
  touch_beyond_the_end();
}

TEST_F(PlcPool, ToReadOnlyIsToLookOnly) {
  plc_semaphore* semaphore = nullptr;
  ASSERT_EQ(plc_semaphore_create(pool_, "s", 5, nullptr, &semaphore), PLC_POOL_OK);
  plc_pool* reader = nullptr;
  ASSERT_EQ(plc_pool_open(name_.c_str(), PLC_POOL_READ, &reader), PLC_POOL_OK);
  plc_semaphore* seen = nullptr;
  EXPECT_EQ(plc_semaphore_open(reader, "s", PLC_POOL_READ_WRITE, &seen), PLC_POOL_REFUSED);
  ASSERT_EQ(plc_semaphore_open(reader, "s", PLC_POOL_READ, &seen), PLC_POOL_OK);
  EXPECT_EQ(plc_semaphore_value(seen), 5U);
  EXPECT_EQ(plc_semaphore_wait(seen, PLC_POOL_NO_WAIT), PLC_POOL_REFUSED);
  plc_semaphore_close(seen);
  plc_pool_close(reader);
  plc_semaphore_close(semaphore);
}

void post_soon(plc_event* event) {
  std::this_thread::sleep_for(std::chrono::milliseconds(20));
  plc_event_post(event);
}

TEST_F(PlcPool, WhoMayOnlyReadCanWaitForAnEvent) {
  plc_event* event = nullptr;
  ASSERT_EQ(plc_event_create(pool_, "e", nullptr, &event), PLC_POOL_OK);
  plc_pool* reader = nullptr;
  ASSERT_EQ(plc_pool_open(name_.c_str(), PLC_POOL_READ, &reader), PLC_POOL_OK);
  for (plc_pool* const through : {pool_, reader}) {
    plc_event* seen = nullptr;
    ASSERT_EQ(plc_event_open(through, "e", PLC_POOL_READ, &seen), PLC_POOL_OK);
    EXPECT_EQ(plc_event_post(seen), PLC_POOL_REFUSED);
    plc_pool_u64 cursor = plc_event_count(seen);
    EXPECT_EQ(plc_event_wait(seen, &cursor, 2'000'000), PLC_POOL_TIMED_OUT);
    std::thread poster(post_soon, event);
    EXPECT_EQ(plc_event_wait(seen, &cursor, PLC_POOL_FOREVER), PLC_POOL_OK);
    poster.join();
    EXPECT_EQ(cursor, plc_event_count(event));
    plc_event_close(seen);
  }
  plc_pool_close(reader);
  plc_event_close(event);
}

TEST_F(PlcPool, ACursorAheadOfThePostsIsAnError) {
  plc_event* event = nullptr;
  ASSERT_EQ(plc_event_create(pool_, "e", nullptr, &event), PLC_POOL_OK);
  plc_event_post(event);
  for (const plc_pool_u64 wrong :
       {plc_pool_u64{2}, plc_pool_u64{1} << 46, plc_pool_u64{1} << 48, ~plc_pool_u64{0}}) {
    plc_pool_u64 cursor = wrong;
    EXPECT_EQ(plc_event_wait(event, &cursor, PLC_POOL_FOREVER), PLC_POOL_ARGUMENT) << wrong;
    EXPECT_EQ(cursor, wrong);
  }
  plc_event_close(event);
}

// Runs `look` in a child of this process; its exit code.
int in_child(int (*look)(plc_pool*), plc_pool* pool) {
  const pid_t child = ::fork();
  if (child == 0) ::_exit(look(pool));
  int status = 0;
  ::waitpid(child, &status, 0);
  return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

TEST_F(PlcPool, AChildOfForkIsToldThatItCannotList) {
  const auto list = [](plc_pool* pool) {
    const int listed = plc_pool_list(pool, [](const plc_object_info*, void*) { return 0; }, nullptr);
    return listed == PLC_POOL_SYSTEM && std::strstr(plc_pool_error(), "anew") != nullptr ? 0 : 1;
  };
  EXPECT_EQ(in_child(list, pool_), 0);
}

TEST_F(PlcPool, AChildOfForkHasATableOfItsOwn) {
  // Its library does not see pthread_mutex_clocklock(), and so an unlock without a lock.
  if (std::string_view(SANITIZERS) == "thread")
    GTEST_SKIP() << "the thread sanitizer misunderstands a timed mutex";
  plc_semaphore* semaphore = nullptr;
  ASSERT_EQ(plc_semaphore_create(pool_, "s", 1, nullptr, &semaphore), PLC_POOL_OK);
  // The table belongs to the whole process: one that has another pool is none of this one's.
  const auto in_a_process_of_its_own = [](plc_pool*) {
    if (g_PlcObjTab == nullptr || g_PlcObjTab->ulSize != 1) return 2;
    semTake(g_PlcObjTab->hSem, WAIT_FOREVER);  // the child shall not find it held
    return in_child(
        [](plc_pool*) {
          if (g_PlcObjTab == nullptr || g_PlcObjTab->ulSize != 1) return 3;
          if (semTake(g_PlcObjTab->hSem, NO_WAIT) != OK || semGive(g_PlcObjTab->hSem) != OK) return 4;
          const objEntry_t& entry = g_PlcObjTab->ptEntries[0];
          return semTake(entry.u.tSemEntry.hSem, NO_WAIT) == OK ? 0 : 5;
        },
        nullptr);
  };
  ::setenv("PLCHOST_POOL", name_.c_str(), 1);
  EXPECT_EQ(in_child(in_a_process_of_its_own, nullptr), 0);
  ::unsetenv("PLCHOST_POOL");
  EXPECT_EQ(plc_semaphore_value(semaphore), 0U) << "the child of the child has taken it";
  plc_semaphore_close(semaphore);
}

TEST_F(PlcPool, ListsWhatThereIs) {
  plc_semaphore* semaphore = nullptr;
  ASSERT_EQ(plc_semaphore_create(pool_, "s", 5, nullptr, &semaphore), PLC_POOL_OK);
  std::string seen;
  const auto visitor = [](const plc_object_info* info, void* user) {
    *static_cast<std::string*>(user) += std::string(info->name) + " " + std::to_string(info->value);
    return 0;
  };
  EXPECT_EQ(plc_pool_list(pool_, visitor, &seen), 1);
  EXPECT_EQ(seen, "s 5");
  plc_semaphore_close(semaphore);
  EXPECT_EQ(plc_pool_list(pool_, visitor, &seen), 0);
}

TEST_F(PlcPool, FirmwareInCAndCppShareATray) {
  // The first one makes the objects; they go with both.
  std::thread feeder([&] { EXPECT_EQ(run({PROGRAMS "/feeder", name_, "500"}).text, "fed 500 parts\n"); });
  EXPECT_EQ(run({PROGRAMS "/gripper", name_, "500"}).text, "took 500 parts of 500\n");
  feeder.join();
  EXPECT_EQ(plc_pool_list(pool_, [](const plc_object_info*, void*) { return 0; }, nullptr), 0);
  const Run wrong = run({PROGRAMS "/feeder", name_});
  EXPECT_EQ(wrong.code, 2);
}

TEST_F(PlcPool, PythonSeesAndPosts) {
  if (std::string(SANITIZERS) != "")
    GTEST_SKIP() << "Python cannot load a library that was built with sanitizers";
  plc_event* event = nullptr;
  ASSERT_EQ(plc_event_create(pool_, "line1/ready ☃", nullptr, &event), PLC_POOL_OK);
  const Run look =
      run({"/usr/bin/python3", EXAMPLES "/parts_feeder/look.py", LIBRARY, name_, "line1/ready ☃"});
  EXPECT_EQ(look.code, 0) << look.text;
  EXPECT_THAT(look.text, HasSubstr("was posted 1 times"));
  EXPECT_THAT(look.text, HasSubstr("line1/ready ☃: event, value 1, 1 references")) << "its own is closed";
  EXPECT_EQ(plc_event_count(event), 1U);
  plc_event_close(event);
}

TEST_F(PlcPool, FirmwareThatWalksTheTableOfTheSeedFindsEverything) {
  plc_event* event = nullptr;
  plc_semaphore* semaphore = nullptr;
  plc_mutex* mutex = nullptr;
  plc_memory* memory = nullptr;
  ASSERT_EQ(plc_event_create(pool_, "event", nullptr, &event), PLC_POOL_OK);
  ASSERT_EQ(plc_semaphore_create(pool_, "semaphore", 1, nullptr, &semaphore), PLC_POOL_OK);
  ASSERT_EQ(plc_mutex_create(pool_, "mutex", nullptr, &mutex), PLC_POOL_OK);
  ASSERT_EQ(plc_memory_create(pool_, "memory", 10, nullptr, &memory), PLC_POOL_OK);
  static_cast<char*>(plc_memory_address(memory))[0] = 42;
  EXPECT_EQ(walk("event").text, "event, set\n");
  EXPECT_EQ(plc_event_count(event), 1U);
  EXPECT_EQ(walk("semaphore").text, "semaphore, taken and given\n");
  EXPECT_EQ(walk("mutex").text, "semaphore, taken and given\n");
  EXPECT_EQ(walk("memory").text, "memory of 10 bytes, the first is 42\n");
  EXPECT_EQ(walk("none").code, 3);
  plc_memory_close(memory);
  plc_mutex_close(mutex);
  plc_semaphore_close(semaphore);
  plc_event_close(event);
}

}  // namespace
