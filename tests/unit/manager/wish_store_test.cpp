#include "manager/store/wish_store.hpp"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <span>
#include <sstream>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <nlohmann/json.hpp>
#include <sys/stat.h>

#include "manager/store/wish_memory.hpp"
#include "shm/base/crc32c.hpp"
#include "tests/unit/manager/wish_store_fixture.hpp"

namespace plchost {
namespace {

using testing::HasSubstr;

TEST(InstanceWishText, IsReadAsItWasWritten) {
  const auto read = decode_wish(encode(some_wish()));
  ASSERT_TRUE(read) << read.error().describe();
  EXPECT_EQ(*read, some_wish());
}

TEST(InstanceWishText, IsRefusedWhereAnyByteIsAnotherOne) {
  const std::string text = encode(some_wish());
  for (std::size_t i = 0; i < text.size(); ++i) {
    std::string changed = text;
    changed[i] = static_cast<char>(changed[i] ^ 1);
    EXPECT_FALSE(decode_wish(changed)) << i;
    EXPECT_FALSE(decode_wish(text.substr(0, i))) << i;
  }
}

// As plchostd wrote it before it kept what ran before, with the checksum of then.
TEST(InstanceWishText, OfAnOlderManagerIsRead) {
  nlohmann::json old = nlohmann::json::parse(encode(some_wish()).substr(9));
  old.erase("application_before");
  old.erase("taken_back");
  old["version"] = 2;
  const std::string text = old.dump();
  const auto read = decode_wish(fmt::format("{:08x} {}\n", crc32c(std::as_bytes(std::span(text))), text));
  ASSERT_TRUE(read) << read.error().describe();
  EXPECT_EQ(read->application, some_wish().application);
  EXPECT_EQ(read->application_before, "");
}

TEST(InstanceWishText, OfTheLongestTextsHasRoom) {
  InstanceWish wish = some_wish();
  constexpr std::size_t kLong = 5000;
  wish.problem = wish.last_end = wish.taken_back = std::string(kLong, '\x01');
  wish.application = wish.application_before = wish.configured_application = std::string(255, '\x01');
  constexpr std::size_t kMostCrashes = 100;
  wish.crashes_unix_ns.assign(kMostCrashes, INT64_MIN);
  EXPECT_LE(encode(wish).size(), kMaxWishBytes);
  EXPECT_TRUE(decode_wish(encode(wish)));
}

TEST_F(WishStoreTest, KnowsNothingOfANewInstance) {
  const auto found = sut_->find();
  ASSERT_TRUE(found);
  EXPECT_FALSE(*found);
}

TEST_F(WishStoreTest, KeepsForTheNextManagerAtOnce) {
  ASSERT_TRUE(sut_->find());
  sut_->keep(some_wish());
  make();
  EXPECT_EQ(sut_->find().value(), some_wish());
}

TEST_F(WishStoreTest, KeepsForAPowerCutWhenItHasSaidSo) {
  ASSERT_TRUE(sut_->find());
  EXPECT_EQ(keep(some_wish()), "");
  cut_power();
  EXPECT_EQ(sut_->find().value(), some_wish().after_power_cut());
}

TEST_F(WishStoreTest, TakesTheNewerOneOfTheDiskWhereTheMemorysNewestIsDamaged) {
  ASSERT_TRUE(sut_->find());
  InstanceWish wish = some_wish();
  wish.running = true;
  ASSERT_EQ(keep(wish), "");
  wish.running = false;
  ASSERT_EQ(keep(wish), "");
  auto memory = MemoryFile::open(pool_ + ".wish.line1", 1, MemoryFile::Access::read_write);
  ASSERT_TRUE(memory);
  constexpr std::size_t kInTheText = 100;  // of the first place, which the second write went to
  memory->bytes()[kInTheText] = std::byte{0xff};
  make();
  EXPECT_EQ(sut_->find().value(), wish);
}

TEST_F(WishStoreTest, TakesTheNewerOneOfTheDiskWhereTheHostHadAnotherPoolMeanwhile) {
  ASSERT_TRUE(sut_->find());
  InstanceWish wish = some_wish();
  wish.running = true;
  ASSERT_EQ(keep(wish), "");
  make(pool_ + "b");
  ASSERT_TRUE(sut_->find().value()->running);
  wish.running = false;
  ASSERT_EQ(keep(wish), "");
  make();
  EXPECT_EQ(sut_->find().value(), wish);
}

TEST_F(WishStoreTest, WritesNothingThatIsOnTheDiskAlready) {
  ASSERT_TRUE(sut_->find());
  ASSERT_EQ(keep(some_wish()), "");
  make();
  ASSERT_TRUE(sut_->find());
  std::filesystem::remove(file());
  InstanceWish wish = some_wish();
  wish.process = InstanceWish::Process::none;  // a power cut leaves none anyway
  EXPECT_EQ(keep(wish), "");
  EXPECT_FALSE(std::filesystem::exists(file()));
}

TEST_F(WishStoreTest, KeepsInstancesApartWhateverTheyAreCalled) {
  const std::vector<std::string> names = {"line1", "line1.new", "line1.events", "line1.wish",
                                          "line1.wish.new"};
  InstanceWish wish = some_wish();
  for (int round = 0; round < 2; ++round) {
    for (const std::string& name : names) {
      make(pool_, name);
      ASSERT_TRUE(sut_->find());
      wish.application = fmt::format("/opt/{}{}.so", name, round);
      std::ofstream(folder_ / "run" / (name + ".events")) << name << '\n';
      sut_->keep_events();
      ASSERT_EQ(keep(wish), "");
    }
  }
  for (const std::string& name : names) WishMemory::remove(pool_, name);
  for (const std::string& name : names) {
    make(pool_, name);
    const auto found = sut_->find();
    ASSERT_TRUE(found) << found.error().describe();
    ASSERT_TRUE(*found) << name;
    EXPECT_EQ((*found)->application, "/opt/" + name + "1.so");
    WishMemory::remove(pool_, name);
  }
}

TEST_F(WishStoreTest, RefusesADamagedMemoryWhereTheDiskHasNothing) {
  ASSERT_TRUE(sut_->find());
  ASSERT_EQ(keep(some_wish()), "");
  auto memory = MemoryFile::open(pool_ + ".wish.line1", 1, MemoryFile::Access::read_write);
  ASSERT_TRUE(memory);
  constexpr std::size_t kHeader = 32;
  std::ranges::fill(memory->bytes().subspan(kHeader), std::byte{0xff});
  make();
  EXPECT_TRUE(sut_->find().value());  // the disk has it
  std::filesystem::remove(file());
  make();
  EXPECT_FALSE(sut_->find());
}

TEST_F(WishStoreTest, RefusesADamagedFile) {
  ASSERT_TRUE(sut_->find());
  ASSERT_EQ(keep(some_wish()), "");
  std::ofstream(file(), std::ios::app) << "x";
  cut_power();
  const auto found = sut_->find();
  ASSERT_FALSE(found);
  EXPECT_THAT(found.error().message, HasSubstr(file()));
}

TEST_F(WishStoreTest, RefusesWhatIsNoPlainFile) {
  std::filesystem::create_directories(file());
  const auto folder = sut_->find();
  ASSERT_FALSE(folder);
  EXPECT_THAT(folder.error().message, HasSubstr(file() + " is no plain file"));
  std::filesystem::remove(file());
  ASSERT_EQ(::mkfifo(file().c_str(), S_IRUSR | S_IWUSR), 0);
  make();
  const auto fifo = sut_->find();
  ASSERT_FALSE(fifo);
  EXPECT_THAT(fifo.error().message, HasSubstr(file() + " is no plain file"));
}

TEST_F(WishStoreTest, TellsWhatCannotBeWrittenAndWritesItWhenItCan) {
  std::ofstream(state()) << "in the way";
  ASSERT_TRUE(sut_->find());
  EXPECT_THAT(keep(some_wish()), HasSubstr(state()));
  std::filesystem::remove(state());
  EXPECT_EQ(wait_for_disk(), "");
  cut_power();
  EXPECT_TRUE(sut_->find().value());
}

TEST_F(WishStoreTest, KeepsInMemoryWhatIsNotOnTheDisk) {
  std::ofstream(state()) << "in the way";
  ASSERT_TRUE(sut_->find());
  EXPECT_NE(keep(some_wish()), "");
  sut_->end();
  std::filesystem::remove(state());
  make();
  EXPECT_EQ(sut_->find().value(), some_wish());
  ASSERT_EQ(keep(some_wish()), "");
  sut_->end();
  EXPECT_FALSE(std::filesystem::exists(MemoryFile::path(pool_ + ".wish.line1")));
}

TEST_F(WishStoreTest, RestoresTheEventsThatOperatorsRegistered) {
  const auto registered = folder_ / "run" / "line1.events";
  ASSERT_TRUE(sut_->find());
  ASSERT_EQ(keep(some_wish()), "");
  std::ofstream(registered) << "ready\ndoor\n";
  sut_->keep_events();
  ASSERT_EQ(wait_for_disk(), "");
  cut_power();
  ASSERT_TRUE(sut_->find());
  std::ostringstream text;
  text << std::ifstream(registered).rdbuf();
  EXPECT_EQ(text.str(), "ready\ndoor\n");

  std::filesystem::remove(registered);  // the last one is unregistered
  sut_->keep_events();
  ASSERT_EQ(wait_for_disk(), "");
  cut_power();
  ASSERT_TRUE(sut_->find());
  EXPECT_FALSE(std::filesystem::exists(registered));
}

TEST_F(WishStoreTest, TakesTheMemorysWhereTheDiskDoesNotAnswer) {
  ASSERT_TRUE(sut_->find());
  ASSERT_EQ(keep(some_wish()), "");
  make();
  {
    const FrozenDisk frozen(*disk_);
    EXPECT_EQ(sut_->find().value(), some_wish());
  }
  InstanceWish wish = some_wish();
  wish.running = true;
  EXPECT_EQ(keep(wish), "") << "and goes on with it";
  make();
  EXPECT_EQ(sut_->find().value(), wish);
}

TEST_F(WishStoreTest, KnowsNothingWhereTheDiskThatMayHaveItDoesNotAnswer) {
  ASSERT_TRUE(sut_->find());
  ASSERT_EQ(keep(some_wish()), "");
  cut_power();
  {
    const FrozenDisk frozen(*disk_);
    const auto found = sut_->find();
    ASSERT_FALSE(found);
    EXPECT_EQ(found.error().code, ErrorCode::timed_out);
    EXPECT_THAT(found.error().message, HasSubstr("line1.wish: the disk has not answered within"));
  }
  make();
  EXPECT_EQ(sut_->find().value(), some_wish().after_power_cut());
}

TEST_F(WishStoreTest, TakesAsNewerWhatIsAskedForWhileTheDiskDoesNotAnswer) {
  ASSERT_TRUE(sut_->find());
  InstanceWish wish = some_wish();
  wish.running = true;
  for (wish.restarts = 0; wish.restarts < 5; ++wish.restarts) ASSERT_EQ(keep(wish), "");
  const std::filesystem::path aside = folder_ / "aside";
  std::filesystem::copy(file(), aside);
  cut_power();
  {
    const FrozenDisk frozen(*disk_);
    ASSERT_FALSE(sut_->find());
  }
  wish.running = false;
  ASSERT_EQ(keep(wish), "");
  std::filesystem::copy(aside, file(), std::filesystem::copy_options::overwrite_existing);  // not written yet
  make();
  EXPECT_FALSE(sut_->find().value()->running);
}

TEST_F(WishStoreTest, StartsAnotherHelperForOneThatEnded) {
  const std::string helper = folder_ / "helper";  // takes one order and ends
  std::ofstream(helper) << "#!/bin/sh\ndd bs=20000 count=1 <&3 >/dev/null 2>&1\nexit 1\n";
  std::filesystem::permissions(helper, std::filesystem::perms::owner_all);
  WishWriter broken(*reactor_, helper);
  for (int i = 0; i < 2; ++i) {
    std::string told;
    const auto begun =
        broken.write({.path = file(), .text = "x", .from = {}}, [&](const Result<void>& result) {
          told = result ? "written" : result.error().describe();
          reactor_->stop();
        });
    ASSERT_TRUE(begun) << begun.error().describe();
    ASSERT_TRUE(reactor_->run());
    EXPECT_THAT(told, HasSubstr("exit code 1"));
  }
}

}  // namespace
}  // namespace plchost
