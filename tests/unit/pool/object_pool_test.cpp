#include "shm/pool/object_pool.hpp"

#include <chrono>
#include <filesystem>
#include <set>
#include <string>
#include <thread>
#include <utility>

#include <gmock/gmock.h>
#include <sys/stat.h>

#include "shm/files/memory_file.hpp"
#include "tests/support/held_pool_lock.hpp"
#include "tests/unit/pool/create_patiently.hpp"
#include "tests/unit/pool/unique_pool_name.hpp"

namespace plchost {
namespace {

using testing::HasSubstr;

class ObjectPoolTest : public testing::Test {
 protected:
  ObjectPool create(std::uint32_t max_objects = kMinObjects) {
    auto pool = ObjectPool::create(name_.get(), {.max_objects = max_objects});
    EXPECT_TRUE(pool) << pool.error().describe();
    return std::move(pool.value());
  }
  UniquePoolName name_;
};

TEST_F(ObjectPoolTest, AttachSeesWhatTheCreatorMade) {
  auto made = create();
  const auto event = made.create_event("line1/ready");
  ASSERT_TRUE(event);
  event->set_registered(true);
  const auto sut = ObjectPool::attach(name_.get());
  ASSERT_TRUE(sut) << sut.error().describe();
  const auto opened = sut->open_event("line1/ready");
  ASSERT_TRUE(opened);
  EXPECT_TRUE(opened->registered());
  EXPECT_EQ(opened->post(), PostResult::no_task);
  EXPECT_EQ(event->counted().count(), 1U);
}

TEST_F(ObjectPoolTest, CreateOpensAnExistingPool) {
  auto first = create(100);
  ASSERT_TRUE(first.create_event("a"));
  const auto sut = create(200);
  EXPECT_TRUE(sut.open_event("a"));
  EXPECT_EQ(sut.name(), name_.get());
}

TEST_F(ObjectPoolTest, SurvivesItsCreator) {
  {
    auto sut = create();
    ASSERT_TRUE(sut.create_event("a"));
  }
  EXPECT_TRUE(ObjectPool::attach(name_.get())->open_event("a"));
}

TEST_F(ObjectPoolTest, AttachFailsWithoutAPool) {
  EXPECT_EQ(ObjectPool::attach(name_.get()).error().code, ErrorCode::not_found);
}

TEST_F(ObjectPoolTest, CreateRefusesSizesOutOfBounds) {
  for (const std::uint32_t count : {0U, kMinObjects - 1, kMaxObjects + 1, ~0U}) {
    const auto sut = ObjectPool::create(name_.get(), {.max_objects = count});
    ASSERT_FALSE(sut);
    EXPECT_EQ(sut.error().code, ErrorCode::invalid_argument);
    EXPECT_THAT(sut.error().message, HasSubstr("16 to 1000000"));
  }
}

TEST_F(ObjectPoolTest, OpenFailsForAnUnknownEvent) {
  const auto sut = create();
  const auto event = sut.open_event("none");
  EXPECT_EQ(event.error().code, ErrorCode::not_found);
  EXPECT_THAT(event.error().message, HasSubstr("'none'"));
}

TEST_F(ObjectPoolTest, CreateEventTwiceGivesTheSameEvent) {
  auto sut = create();
  const auto first = sut.create_event("a");
  const auto second = sut.create_event("a");
  ASSERT_TRUE(first && second);
  EXPECT_EQ(&first->counted(), &second->counted());
}

TEST_F(ObjectPoolTest, TakesTheLongestNameAndRefusesOthers) {
  auto sut = create();
  const std::string longest(kMaxObjectName, 'x');
  ASSERT_TRUE(sut.create_event(longest));
  EXPECT_TRUE(sut.open_event(longest));
  for (const std::string& name : {std::string(), longest + "x", std::string("a\nb"), std::string("\xc3"),
                                  std::string("a\0b", 3), std::string("\x7f")}) {
    for (const auto& event : {sut.create_event(name), sut.open_event(name)}) {
      ASSERT_FALSE(event);
      EXPECT_EQ(event.error().code, ErrorCode::invalid_argument);
      EXPECT_THAT(event.error().message, HasSubstr("allowed are 1 to 95 bytes of UTF-8"));
    }
  }
}

TEST_F(ObjectPoolTest, ReportsThePostOfAnUnboundEventAsSoft) {
  auto sut = create();
  const auto event = sut.create_event("a").value();
  EXPECT_EQ(event.post(), PostResult::not_registered);
  EXPECT_EQ(event.counted().count(), 0U);
  event.set_registered(true);
  EXPECT_EQ(event.post(), PostResult::no_task);
  event.set_bound_tasks(3);
  EXPECT_EQ(event.bound_tasks(), 3U);
  EXPECT_EQ(event.post(), PostResult::posted);
  EXPECT_EQ(event.counted().count(), 2U);
  event.set_registered(false);
  EXPECT_EQ(event.post(), PostResult::not_registered);
  EXPECT_EQ(event.bound_tasks(), 3U);
}

TEST_F(ObjectPoolTest, WithdrawsTheEventsOfOneOwnerAlsoWhileItIsLocked) {
  auto sut = create();
  const auto taken = [&](const std::string& name) {
    const PoolEvent event = sut.create_event(name).value();
    event.set_registered(true);
    event.set_bound_tasks(1);
    return event;
  };
  const PoolEvent left = taken("line1/ready");
  const PoolEvent another = taken("line10/ready");
  ASSERT_EQ(left.post(), PostResult::posted);
  const HeldPoolLock held(name_.get());
  sut.withdraw_events("line1");
  EXPECT_EQ(left.post(), PostResult::not_registered);
  EXPECT_EQ(left.bound_tasks(), 0U);
  EXPECT_FALSE(left.counted().snapshot().taken());
  EXPECT_EQ(another.post(), PostResult::posted);
}

TEST_F(ObjectPoolTest, AnEmptyHandleIsNotValid) {
  const PoolEvent sut;
  EXPECT_FALSE(sut.valid());
  EXPECT_FALSE(sut.registered());
  EXPECT_EQ(sut.bound_tasks(), 0U);
  EXPECT_EQ(sut.post(), PostResult::not_registered);
  EXPECT_FALSE(sut.set_registered(true));
  EXPECT_FALSE(sut.set_bound_tasks(1));
}

TEST_F(ObjectPoolTest, WhatIsNoPlainFileIsNamedAndLeftAlone) {
  const UniquePoolName fifo;
  const UniquePoolName folder;
  ASSERT_EQ(::mkfifo(("/dev/shm/" + fifo.get()).c_str(), 0600), 0);
  ASSERT_EQ(::mkdir(("/dev/shm/" + folder.get()).c_str(), 0700), 0);
  for (const auto& [name, kind] :
       {std::pair(fifo.get(), "is a FIFO"), std::pair(folder.get(), "is a folder")}) {
    const auto expect_refused = [&what = kind](const Result<ObjectPool>& sut) {
      ASSERT_FALSE(sut);
      EXPECT_EQ(sut.error().code, ErrorCode::wrong_type);
      EXPECT_THAT(sut.error().message, HasSubstr(what));
    };
    expect_refused(ObjectPool::create(name));
    expect_refused(ObjectPool::attach(name));
    expect_refused(ObjectPool::attach(name, MemoryFile::Access::read_only));
    EXPECT_TRUE(std::filesystem::remove("/dev/shm/" + name)) << "it is still there";
  }
}

TEST_F(ObjectPoolTest, ListsWhatIsRegisteredOrBound) {
  auto sut = create();
  ASSERT_TRUE(sut.create_event("unused"));
  sut.create_event("bound")->set_bound_tasks(2);
  const auto registered = sut.create_event("registered").value();
  registered.set_registered(true);
  registered.post();
  std::set<std::string> names;
  for (const auto all = sut.list().value(); const auto& info : all) {
    names.insert(info.name);
    EXPECT_EQ(info.type, ObjectType::event);
    EXPECT_EQ(info.registered, info.name == "registered");
    EXPECT_EQ(info.value, info.name == "registered" ? 1U : 0U);
    EXPECT_EQ(info.bound_tasks, info.name == "bound" ? 2U : 0U);
  }
  EXPECT_EQ(names, (std::set<std::string>{"bound", "registered"}));
}

TEST_F(ObjectPoolTest, SaysFullWhenAllObjectsAreInUse) {
  auto sut = create();
  for (std::uint32_t i = 0; i < kMinObjects; ++i) {
    auto event = sut.create_event("event" + std::to_string(i));
    ASSERT_TRUE(event);
    ASSERT_TRUE(i % 2 == 0 ? event->set_registered(true) : event->set_bound_tasks(1));
  }
  const auto event = sut.create_event("one too many");
  ASSERT_FALSE(event);
  EXPECT_EQ(event.error().code, ErrorCode::full);
  EXPECT_THAT(event.error().message, HasSubstr("holds 16 objects"));
  EXPECT_TRUE(sut.create_event("event0"));
}

TEST_F(ObjectPoolTest, ReclaimsUnusedEventsAndMakesOldHandlesInvalid) {
  auto sut = create();
  std::vector<PoolEvent> events;
  for (std::uint32_t i = 0; i < kMinObjects; ++i) {
    events.push_back(sut.create_event("event" + std::to_string(i)).value());
    events.back().set_registered(i != 5);
    events.back().post();
  }
  const auto fresh = sut.create_event("fresh");
  ASSERT_TRUE(fresh) << fresh.error().describe();
  EXPECT_EQ(&fresh->counted(), &events[5].counted());
  EXPECT_FALSE(events[5].valid());
  EXPECT_FALSE(events[5].set_registered(true));
  EXPECT_FALSE(events[5].set_bound_tasks(1));
  ASSERT_TRUE(fresh->set_registered(true));
  EXPECT_EQ(events[5].post(), PostResult::not_registered);
  EXPECT_EQ(sut.open_event("event5").error().code, ErrorCode::not_found);
  for (std::uint32_t i = 0; i < kMinObjects; ++i) {
    EXPECT_EQ(sut.open_event("event" + std::to_string(i)).has_value(), i != 5);
  }
}

TEST_F(ObjectPoolTest, AnEventInAReclaimedPlaceCountsFromZero) {
  auto sut = create();
  for (std::uint32_t i = 0; i < kMinObjects; ++i) {
    const auto event = sut.create_event("old" + std::to_string(i)).value();
    event.set_registered(true);
    event.post();
    event.set_registered(false);
  }
  const auto fresh = sut.create_event("fresh").value();
  fresh.set_registered(true);
  fresh.post();
  fresh.post();
  ASSERT_EQ(sut.list()->size(), 1U);
  EXPECT_EQ(sut.list()->front().value, 2U);
}

TEST_F(ObjectPoolTest, ReclaimTakesTheOldestFirst) {
  auto sut = create();
  for (int i = 0; i < 1000; ++i) {
    const auto recent = sut.create_event("event" + std::to_string(i)).value();
    for (int later = 1; later < static_cast<int>(kMinObjects); ++later) {
      ASSERT_TRUE(sut.create_event("event" + std::to_string(i) + "." + std::to_string(later)));
    }
    EXPECT_TRUE(recent.valid());
  }
}

TEST_F(ObjectPoolTest, HoldsAHundredThousandObjects) {
  constexpr std::uint32_t kCount = 100'000;
  auto sut = create(kCount);
  for (std::uint32_t i = 0; i < kCount; ++i) {
    const auto event = sut.create_event("instance/event" + std::to_string(i));
    ASSERT_TRUE(event);
    event->set_registered(true);
  }
  EXPECT_EQ(sut.create_event("x").error().code, ErrorCode::full);
  for (std::uint32_t i = 0; i < kCount; ++i) {
    ASSERT_TRUE(sut.open_event("instance/event" + std::to_string(i)));
  }
  EXPECT_EQ(sut.list()->size(), kCount);
}

TEST_F(ObjectPoolTest, WakesATaskThatWaitsInAnotherMapping) {
  auto sut = create();
  const auto event = sut.create_event("a").value();
  event.set_registered(true);
  std::thread task([&] {
    const auto pool = ObjectPool::attach(name_.get()).value();
    const auto bound = pool.open_event("a").value();
    for (auto seen = bound.counted().snapshot(); seen.count() == 0; seen = bound.counted().snapshot()) {
      bound.counted().wait(seen);
    }
  });
  event.post();
  task.join();
}

TEST_F(ObjectPoolTest, ThreadsMayCreateAndListAtOnce) {
  auto sut = create(1000);
  std::vector<std::thread> threads;
  for (int t = 0; t < 4; ++t) {
    threads.emplace_back([&, t] {
      for (int i = 0; i < 200; ++i) {
        auto event = create_patiently(sut, "event" + std::to_string((i * 7 + t) % 250));
        ASSERT_TRUE(event);
        event->set_registered(true);
        event->post();
        if (i % 50 == 0) (void)sut.list();
      }
    });
  }
  for (auto& thread : threads) thread.join();
  EXPECT_EQ(sut.list()->size(), 250U);
}

TEST_F(ObjectPoolTest, MovedHandlesStayValid) {
  auto first = create();
  const auto event = first.create_event("a").value();
  const ObjectPool sut = std::move(first);
  EXPECT_TRUE(event.valid());
  EXPECT_TRUE(sut.open_event("a"));
}

TEST(ObjectTraits, AreOneRowForEachTypeInTheOrderOfTheirNumbers) {
  for (std::uint32_t number = 0; number < kObjectTypes; ++number) {
    const auto type = static_cast<ObjectType>(number);
    ASSERT_NE(traits_of(type), nullptr);
    EXPECT_EQ(traits_of(type)->type, type);
    EXPECT_EQ(to_string(type), traits_of(type)->name);
  }
  EXPECT_EQ(traits_of(ObjectType{kObjectTypes}), nullptr);
}

TEST(ObjectTraits, GiveEachObjectItsInitialValueAndTellIt) {
  const UniquePoolName name;
  auto pool = ObjectPool::create(name.get()).value();
  const auto semaphore = pool.create_object<SharedSemaphore>("semaphore", 7).value();
  const auto memory = pool.create_object<SharedMemory>("memory", 100).value();
  const auto event = pool.create_object<SharedEvent>("event").value();
  const auto mutex = pool.create_object<SharedMutex>("mutex").value();
  EXPECT_EQ(semaphore.object.value(), 7U);
  EXPECT_EQ(pool.look_at("semaphore")->value, 7U);
  EXPECT_EQ(memory.object.bytes().size(), 100U);
  EXPECT_EQ(pool.look_at("memory")->size, 100U);
  EXPECT_EQ(pool.look_at("event")->value, 0U);
  EXPECT_TRUE(pool.look_at("event")->registered);
  EXPECT_EQ(pool.look_at("mutex")->value, 0U);
}

// The next object in a place does not see the words of an object of another type.
TEST(ObjectTraits, BeginAnewInAPlaceThatWasUsed) {
  const UniquePoolName name;
  auto pool = ObjectPool::create(name.get()).value();
  {
    const auto semaphore = pool.create_object<SharedSemaphore>("a", 9).value();
  }
  const auto mutex = pool.create_object<SharedMutex>("b").value();
  EXPECT_EQ(mutex.object.lock(), ObjectStatus::done);
  EXPECT_EQ(mutex.object.unlock(), ObjectStatus::done);
  const auto other = pool.create_object<SharedSemaphore>("c", 0).value();
  EXPECT_EQ(other.object.value(), 0U);
}

TEST(ObjectTraits, RefuseAnInitialValueThatATypeDoesNotHave) {
  const UniquePoolName name;
  auto pool = ObjectPool::create(name.get()).value();
  const auto event = pool.create_object<SharedEvent>("e", 1);
  ASSERT_FALSE(event);
  EXPECT_EQ(event.error().code, ErrorCode::invalid_argument);
  EXPECT_EQ(event.error().message, "event 'e': posts 1; allowed are 0 to 0");
  EXPECT_FALSE(pool.create_object<SharedMemory>("m", 0));
  EXPECT_FALSE(pool.look_at("e"));
}

TEST(ObjectType, HasTheNumbersOfTheSeed) {
  EXPECT_EQ(static_cast<int>(ObjectType::memory), 0);
  EXPECT_EQ(static_cast<int>(ObjectType::semaphore), 1);
  EXPECT_EQ(static_cast<int>(ObjectType::event), 2);
  for (const auto type : {ObjectType::memory, ObjectType::semaphore, ObjectType::event, ObjectType::mutex}) {
    EXPECT_NE(to_string(type), "unknown");
  }
  EXPECT_EQ(to_string(ObjectType{77}), "unknown");
}

}  // namespace
}  // namespace plchost
