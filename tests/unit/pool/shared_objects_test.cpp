#include <algorithm>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <string>
#include <thread>
#include <vector>

#include <fcntl.h>
#include <gmock/gmock.h>
#include <grp.h>
#include <sys/wait.h>
#include <unistd.h>

#include "shm/base/counting_semaphore.hpp"
#include "shm/files/pool_files.hpp"
#include "shm/pool/object_pool.hpp"
#include "tests/unit/pool/unique_pool_name.hpp"

namespace plchost {
namespace {

using std::chrono::milliseconds;
using testing::HasSubstr;
constexpr auto kReadOnly = MemoryFile::Access::read_only;

TimePoint in(milliseconds time) {
  return MonotonicClock::now() + time;
}

class SharedObjects : public testing::Test {
 protected:
  SharedObjects() : pool_(std::move(ObjectPool::create(name_.get(), {.max_objects = 64}).value())) {}
  [[nodiscard]] ObjectPool another() const { return std::move(ObjectPool::attach(name_.get()).value()); }
  [[nodiscard]] std::vector<std::string> names() const {
    std::vector<std::string> names;
    for (const auto all = pool_.list().value(); const ObjectInfo& info : all) names.push_back(info.name);
    std::ranges::sort(names);
    return names;
  }
  UniquePoolName name_;
  ObjectPool pool_;
};

TEST_F(SharedObjects, AreMadeOnceAndOpenedByAllOthers) {
  auto other = another();
  EXPECT_TRUE(pool_.create_semaphore("s", 3)->made);
  const auto first = pool_.create_semaphore("s", 3);
  ASSERT_TRUE(first);
  EXPECT_TRUE(first->made) << "the first one went with its reference";
  const auto second = other.create_semaphore("s", 7);
  ASSERT_TRUE(second);
  EXPECT_FALSE(second->made);
  EXPECT_EQ(second->object.value(), 3U) << "an object that is there keeps its value";
  EXPECT_EQ(second->object.post(), ObjectStatus::done);
  EXPECT_EQ(first->object.value(), 4U);
}

TEST_F(SharedObjects, GoWithTheirLastReferenceUnlessTheyAreKept) {
  auto mutex = std::move(pool_.create_mutex("goes")->object);
  auto same = std::move(another().open_mutex("goes").value());
  ASSERT_TRUE(pool_.create_mutex("stays", {.keep = true}));
  mutex.close();
  EXPECT_THAT(names(), testing::ElementsAre("goes", "stays"));
  EXPECT_EQ(mutex.lock(), ObjectStatus::gone);
  same.close();
  EXPECT_THAT(names(), testing::ElementsAre("stays"));
  EXPECT_EQ(pool_.open_mutex("goes").error().code, ErrorCode::not_found);
  EXPECT_TRUE(pool_.remove_object("stays"));
  EXPECT_TRUE(names().empty());
  EXPECT_EQ(pool_.remove_object("stays").error().code, ErrorCode::not_found);
}

TEST_F(SharedObjects, OutliveThePoolThatTheyWereOpenedThrough) {
  SharedSemaphore sut;
  {
    auto other = another();
    sut = std::move(other.create_semaphore("s", 1)->object);
  }
  EXPECT_EQ(sut.wait(), ObjectStatus::done);
  EXPECT_THAT(names(), testing::ElementsAre("s"));
}

TEST_F(SharedObjects, OfAnotherTypeOrSizeAreRefused) {
  const auto held = pool_.create_memory("m", 100);
  ASSERT_TRUE(held);
  EXPECT_EQ(pool_.create_semaphore("m", 0).error().code, ErrorCode::wrong_type);
  EXPECT_EQ(pool_.open_mutex("m").error().code, ErrorCode::wrong_type);
  EXPECT_EQ(pool_.open_event("m").error().code, ErrorCode::wrong_type);
  const auto other = pool_.create_memory("m", 101);
  EXPECT_EQ(other.error().code, ErrorCode::wrong_size);
  EXPECT_THAT(other.error().message, HasSubstr("has 100 bytes, not 101"));
  EXPECT_TRUE(pool_.create_memory("m", 100));
}

TEST_F(SharedObjects, BoundsOfValuesAndSizesAreChecked) {
  EXPECT_EQ(pool_.create_memory("m", 0).error().code, ErrorCode::invalid_argument);
  EXPECT_EQ(pool_.create_memory("m", ~std::size_t{0}).error().code, ErrorCode::invalid_argument);
  EXPECT_EQ(pool_.create_memory("m", std::size_t{1} << 50).error().code, ErrorCode::full);
  EXPECT_TRUE(names().empty());
  EXPECT_TRUE(pool_.create_memory("m", 1));
  EXPECT_TRUE(pool_.create_semaphore("s", CountingSemaphore::kMaxValue));
  EXPECT_EQ(pool_.create_semaphore("s", CountingSemaphore::kMaxValue + 1).error().code,
            ErrorCode::invalid_argument);
}

TEST_F(SharedObjects, NamesAreUtf8OfUpTo95Bytes) {
  const std::string umlaut = "Füllstand/Behälter-3 ☃ 𝄞";
  ASSERT_TRUE(pool_.create_memory(umlaut, 8, {.keep = true}));
  EXPECT_THAT(names(), testing::ElementsAre(umlaut));
  EXPECT_TRUE(pool_.open_memory(umlaut));
  EXPECT_TRUE(pool_.create_mutex(std::string(95, 'x')));
  EXPECT_TRUE(pool_.create_mutex(std::string(93, 'x') + "ü"));
  for (const std::string& name :
       {std::string(), std::string(96, 'x'), std::string(94, 'x') + "ü", std::string("\xff"),
        std::string("\xc0\xaf"), std::string("\xed\xa0\x80"), std::string("\xf4\x90\x80\x80"),
        std::string("\xe2\x82"), std::string("a\tb"), std::string("\xc2\x85")}) {
    EXPECT_EQ(pool_.create_mutex(name).error().code, ErrorCode::invalid_argument)
        << testing::PrintToString(name);
  }
}

TEST_F(SharedObjects, ThousandCreatesAndClosesLeaveNothing) {
  for (int i = 0; i < 1000; ++i) {
    ASSERT_TRUE(pool_.create_memory("m" + std::to_string(i), 4096));
    ASSERT_TRUE(pool_.create_semaphore("s" + std::to_string(i), 1));
  }
  EXPECT_TRUE(names().empty());
  for (const auto& file : std::filesystem::directory_iterator("/dev/shm")) {
    EXPECT_FALSE(file.path().filename().string().starts_with(name_.get() + ".memory."));
  }
}

TEST_F(SharedObjects, FullTableAndFullReferencesAreSaid) {
  std::vector<SharedMutex> mutexes;
  for (int i = 0; i < 64; ++i)
    mutexes.push_back(std::move(pool_.create_mutex("m" + std::to_string(i))->object));
  EXPECT_EQ(pool_.create_mutex("one more").error().code, ErrorCode::full);
  EXPECT_EQ(pool_.create_memory("one more", 10).error().code, ErrorCode::full);
  EXPECT_FALSE(std::filesystem::exists("/dev/shm/" + pool_memory_name(name_.get(), "one more")));
  std::vector<SharedMutex> same;
  for (;;) {
    auto opened = pool_.open_mutex("m0");
    if (!opened) {
      EXPECT_EQ(opened.error().code, ErrorCode::full);
      EXPECT_THAT(opened.error().message, HasSubstr("references"));
      break;
    }
    same.push_back(*std::move(opened));
  }
  EXPECT_EQ(same.size(), 2U * 64 + 1024 - 64);
}

TEST_F(SharedObjects, AMemoryTakesThePlaceOfAnotherAlsoIfAllReferencesAreTaken) {
  auto first = pool_.prepare_memory("retain", 100).value();
  const auto old = pool_.replace_memory("retain", first);
  ASSERT_TRUE(old) << old.error().describe();
  const auto mutex = pool_.create_mutex("m");
  std::vector<SharedMutex> same;
  for (auto opened = pool_.open_mutex("m"); opened; opened = pool_.open_mutex("m")) {
    same.push_back(*std::move(opened));
  }
  // The one that `old` had is free by then.
  auto prepared = pool_.prepare_memory("retain", 200).value();
  const auto sut = pool_.replace_memory("retain", prepared);
  ASSERT_TRUE(sut) << sut.error().describe();
  auto again = pool_.prepare_memory("retain", 300).value();
  same.push_back(pool_.open_mutex("m").value_or(SharedMutex{}));
  const auto next = pool_.replace_memory("retain", again);
  ASSERT_TRUE(next) << next.error().describe();
  EXPECT_EQ(next->bytes().size(), 300U);
  EXPECT_EQ(pool_.look_at("retain")->size, 300U);
}

TEST_F(SharedObjects, EventsAreSeenByEachWaiterWithItsOwnCursor) {
  const auto sut = pool_.create_shared_event("e");
  auto other = another();
  const auto same = other.open_shared_event("e");
  ASSERT_TRUE(sut && same);
  std::uint64_t mine = sut->object.count();
  std::uint64_t theirs = same->count();
  EXPECT_EQ(sut->object.wait(mine, in(milliseconds(1))), ObjectStatus::timed_out);
  EXPECT_EQ(same->post(), ObjectStatus::done);
  EXPECT_EQ(same->post(), ObjectStatus::done);
  EXPECT_EQ(sut->object.wait(mine), ObjectStatus::done);
  EXPECT_EQ(mine, 2U);
  EXPECT_EQ(same->wait(theirs), ObjectStatus::done);
  EXPECT_EQ(theirs, 2U);
  std::thread poster([&] { (void)same->post(); });
  EXPECT_EQ(sut->object.wait(mine, in(milliseconds(20'000))), ObjectStatus::done);
  poster.join();
}

TEST_F(SharedObjects, EventOfTheLibraryAndOfTheRuntimeAreOne) {
  const auto sut = pool_.create_shared_event("line1/ready");
  ASSERT_TRUE(sut);
  const auto bound = pool_.open_event("line1/ready");
  ASSERT_TRUE(bound);
  EXPECT_TRUE(bound->set_bound_tasks(1));
  EXPECT_EQ(bound->post(), PostResult::posted);
  EXPECT_EQ(sut->object.count(), 1U);
}

TEST_F(SharedObjects, MutexBelongsToTheThreadThatLockedIt) {
  const auto sut = pool_.create_mutex("m");
  ASSERT_TRUE(sut);
  EXPECT_EQ(sut->object.unlock(), ObjectStatus::not_owner);
  EXPECT_EQ(sut->object.lock(), ObjectStatus::done);
  EXPECT_EQ(sut->object.lock(), ObjectStatus::deadlock);
  std::thread([&] {
    EXPECT_EQ(sut->object.try_lock(), ObjectStatus::timed_out);
    EXPECT_EQ(sut->object.unlock(), ObjectStatus::not_owner);
  }).join();
  EXPECT_EQ(pool_.look_at("m")->value, static_cast<std::uint64_t>(::gettid()));
  EXPECT_EQ(sut->object.unlock(), ObjectStatus::done);
}

TEST_F(SharedObjects, SemaphoreIsFullAtItsGreatestValue) {
  const auto sut = pool_.create_semaphore("s", CountingSemaphore::kMaxValue);
  ASSERT_TRUE(sut);
  EXPECT_EQ(sut->object.post(), ObjectStatus::full);
  EXPECT_EQ(sut->object.wait(), ObjectStatus::done);
}

TEST_F(SharedObjects, MemoryIsOneForAllAndSurvivesWhenKept) {
  {
    const auto made = pool_.create_memory("line1/outputs", 100'000, {.keep = true});
    ASSERT_TRUE(made);
    EXPECT_TRUE(std::ranges::all_of(made->object.bytes(), [](std::byte b) { return b == std::byte{}; }));
    made->object.bytes()[99'999] = std::byte{42};
  }
  auto other = another();
  const auto sut = other.open_memory("line1/outputs", kReadOnly);
  ASSERT_TRUE(sut);
  EXPECT_FALSE(sut->writable());
  EXPECT_EQ(sut->bytes()[99'999], std::byte{42});
}

TEST_F(SharedObjects, FileWithoutAnObjectIsReplacedByTheNextMemoryOfItsName) {
  std::ofstream("/dev/shm/" + pool_memory_name(name_.get(), "m")) << "left over from another pool";
  const auto sut = pool_.create_memory("m", 10);
  ASSERT_TRUE(sut) << sut.error().describe();
  EXPECT_EQ(sut->object.bytes().size(), 10U);
  EXPECT_EQ(sut->object.bytes()[0], std::byte{});
}

TEST_F(SharedObjects, MemoryWhoseFileAStrangerCutIsAnError) {
  const auto made = pool_.create_memory("m", 8192, {.keep = true});
  ASSERT_EQ(::truncate(("/dev/shm/" + pool_memory_name(name_.get(), "m")).c_str(), 100), 0);
  EXPECT_EQ(pool_.open_memory("m").error().code, ErrorCode::corrupt);
  std::filesystem::remove("/dev/shm/" + pool_memory_name(name_.get(), "m"));
  EXPECT_EQ(pool_.open_memory("m").error().code, ErrorCode::not_found) << "the object goes with its file";
  EXPECT_EQ(pool_.remove_object("m").error().code, ErrorCode::not_found);
}

TEST_F(SharedObjects, ListSaysWhoHoldsThemAndWhoWaits) {
  const auto sut = pool_.create_semaphore("s", 0, {.keep = true, .mode = 0640});
  ASSERT_TRUE(sut);
  auto other = another();
  const auto reader = other.open_semaphore("s", kReadOnly);
  ASSERT_TRUE(reader);
  std::thread waiter([&] { EXPECT_EQ(sut->object.wait(), ObjectStatus::done); });
  ObjectInfo info;
  while (info.waiters == 0) info = pool_.look_at("s").value();
  EXPECT_EQ(info.type, ObjectType::semaphore);
  EXPECT_TRUE(info.kept);
  EXPECT_EQ(info.mode, 0640U);
  EXPECT_EQ(info.owner, ::geteuid());
  ASSERT_EQ(info.references.size(), 2U);
  for (const ReferenceInfo& reference : info.references) {
    EXPECT_EQ(reference.pid, static_cast<std::uint32_t>(::getpid()));
    EXPECT_EQ(reference.program, ::program_invocation_short_name);
    EXPECT_EQ(reference.waiting, reference.writable ? 1U : 0U);
  }
  EXPECT_EQ(sut->object.post(), ObjectStatus::done);
  waiter.join();
  EXPECT_EQ(pool_.look_at("s")->waiters, 0U);
}

TEST_F(SharedObjects, ReadersOfThePoolSeeAllAndChangeNothing) {
  const auto memory = pool_.create_memory("m", 10);
  const auto semaphore = pool_.create_semaphore("s", 5);
  auto sut = ObjectPool::attach(name_.get(), kReadOnly);
  ASSERT_TRUE(sut) << sut.error().describe();
  EXPECT_EQ(sut->list()->size(), 2U);
  EXPECT_EQ(sut->look_at("s")->value, 5U);
  const auto reader = sut->open_semaphore("s", kReadOnly);
  ASSERT_TRUE(reader);
  EXPECT_EQ(reader->value(), 5U);
  EXPECT_EQ(reader->post(), ObjectStatus::not_permitted);
  EXPECT_EQ(reader->wait(), ObjectStatus::not_permitted);
  EXPECT_EQ(sut->open_memory("m", kReadOnly)->bytes().size(), 10U);
  EXPECT_EQ(sut->open_semaphore("s").error().code, ErrorCode::refused);
  EXPECT_EQ(sut->create_mutex("x").error().code, ErrorCode::refused);
  EXPECT_EQ(sut->open_semaphore("none", kReadOnly).error().code, ErrorCode::not_found);
}

/// Whether `body` holds in a child of another user, who has no groups.
template <class Body>
bool holds_for_a_stranger(Body body) {
  const pid_t child = ::fork();
  if (child == 0) {
    constexpr uid_t kNobody = 65534;
    const bool left = ::setgroups(0, nullptr) == 0 && ::setgid(kNobody) == 0 && ::setuid(kNobody) == 0;
    ::_exit(left && body() ? 0 : 1);
  }
  int status = -1;
  ::waitpid(child, &status, 0);
  return WIFEXITED(status) && WEXITSTATUS(status) == 0;
}

class OtherUsers : public testing::Test {
 protected:
  void SetUp() override {
    if (::geteuid() != 0) GTEST_SKIP() << "needs root to become another user";
  }
  [[nodiscard]] ObjectPool create(mode_t mode) const {
    return std::move(ObjectPool::create(name_.get(), {.rights = {.mode = mode}}).value());
  }
  UniquePoolName name_;
};

TEST_F(OtherUsers, CannotMapAPoolThatIsNotForThem) {
  const auto pool = create(0660);
  EXPECT_TRUE(holds_for_a_stranger([&] {
    return ObjectPool::attach(name_.get()).error().code == ErrorCode::refused &&
           ObjectPool::attach(name_.get(), kReadOnly).error().code == ErrorCode::refused &&
           ObjectPool::create(name_.get()).error().code == ErrorCode::refused;
  }));
}

TEST_F(OtherUsers, MayReadWhereTheModeSaysSo) {
  auto pool = create(0664);
  const auto open = pool.create_memory("open", 10);
  const auto shut = pool.create_memory("shut", 10, {.mode = 0660});
  EXPECT_TRUE(holds_for_a_stranger([&] {
    auto sut = ObjectPool::attach(name_.get(), kReadOnly);
    return sut && ObjectPool::attach(name_.get()).error().code == ErrorCode::refused &&
           sut->open_memory("open", kReadOnly).has_value() &&
           sut->open_memory("shut", kReadOnly).error().code == ErrorCode::refused;
  }));
}

TEST_F(OtherUsers, MakeObjectsOfAllTypesForGroupsThatTheyAreInAndForNoOthers) {
  const auto pool = create(0666);
  constexpr gid_t kNobodys = 65534;
  EXPECT_TRUE(holds_for_a_stranger([&] {
    auto sut = ObjectPool::attach(name_.get());
    if (!sut) return false;
    const auto memory = sut->create_memory("m", 10);
    const auto event = sut->create_shared_event("e");
    return memory && event && sut->look_at("m")->group == kNobodys && sut->look_at("e")->group == kNobodys;
  })) << "not being in the pool's group, for their own";
  EXPECT_TRUE(holds_for_a_stranger([&] {
    auto sut = ObjectPool::attach(name_.get());
    const ObjectOptions of_root{.group = 0};
    return sut && sut->create_memory("m", 10, of_root).error().code == ErrorCode::refused &&
           sut->create_shared_event("e", of_root).error().code == ErrorCode::refused &&
           sut->create_mutex("x", of_root).error().code == ErrorCode::refused;
  }));
}

TEST_F(OtherUsers, AreKeptFromObjectsThatAreNotForThem) {
  auto pool = create(0666);
  const auto memory = pool.create_memory("m", 10, {.mode = 0664});
  const auto mutex = pool.create_mutex("x", {.mode = 0600});
  EXPECT_TRUE(holds_for_a_stranger([&] {
    auto sut = ObjectPool::attach(name_.get());
    const bool may = sut && sut->create_semaphore("own", 1).has_value();
    return may && sut->open_memory("m").error().code == ErrorCode::refused &&
           sut->open_memory("m", kReadOnly).has_value() &&
           sut->open_mutex("x").error().code == ErrorCode::refused &&
           sut->remove_object("x").error().code == ErrorCode::refused &&
           ::open(("/dev/shm/" + pool_memory_name(name_.get(), "m")).c_str(), O_RDWR) < 0;
  }));
}

}  // namespace
}  // namespace plchost
