#include "manager/store/wish_store.hpp"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <future>
#include <memory>
#include <sstream>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <sys/wait.h>
#include <unistd.h>

#include "manager/store/wish_memory.hpp"

namespace plchost {
namespace {

using testing::HasSubstr;

InstanceWish some_wish() {
  InstanceWish wish;
  wish.commanded = true;
  wish.running = false;
  wish.problem = "exit code 3: \"bind\ncore\"";
  wish.application = "/opt/line.so";
  wish.scheduler = "CmpScheduleTimer";
  wish.configured_application = "/opt/first.so";
  wish.safe_mode = true;
  wish.start_kind = StartKind::cold;
  wish.restarts = 7;
  wish.ends_in_a_row = 2;
  wish.crashes_unix_ns = {1, -5, 1'700'000'000'000'000'000};
  wish.process = InstanceWish::Process::up;
  return wish;
}

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

TEST(InstanceWishText, OfTheLongestTextsHasRoom) {
  InstanceWish wish = some_wish();
  constexpr std::size_t kLong = 5000;
  wish.problem = wish.last_end = std::string(kLong, '\x01');
  wish.application = wish.configured_application = std::string(255, '\x01');
  constexpr std::size_t kMostCrashes = 100;
  wish.crashes_unix_ns.assign(kMostCrashes, INT64_MIN);
  EXPECT_LE(encode(wish).size(), kMaxWishBytes);
  EXPECT_TRUE(decode_wish(encode(wish)));
}

/// A manager with a real helper, in a folder of its own.
class WishStoreTest : public testing::Test {
 protected:
  WishStoreTest() {
    static int count = 0;
    pool_ = fmt::format("plchost-w{}-{}", ::getpid(), ++count);
    folder_ = std::filesystem::temp_directory_path() / pool_;
    std::filesystem::create_directories(folder_ / "run");
    make();
  }
  ~WishStoreTest() override {
    sut_.reset();
    writer_.reset();
    reactor_.reset();
    while (::waitpid(-1, nullptr, 0) > 0) {  // helpers that still write into the folder
    }
    for (const std::string& pool : {pool_, pool_ + "b"}) WishMemory::remove(pool, "line1");
    std::error_code ignored;
    std::filesystem::remove_all(folder_, ignored);
  }
  WishStoreTest(const WishStoreTest&) = delete;
  WishStoreTest& operator=(const WishStoreTest&) = delete;

  /// The next manager.
  void make() { make(pool_); }
  void make(const std::string& pool, const std::string& instance = "line1") {
    sut_.reset();
    writer_.reset();
    auto reactor = Reactor::create();
    ASSERT_TRUE(reactor);
    reactor_ = std::move(*reactor);
    writer_ = std::make_unique<WishWriter>(*reactor_, PLCHOST_MANAGER_PROGRAM);
    sut_ = std::make_unique<WishStore>(*reactor_, *writer_,
                                       WishStore::Settings{.pool = pool,
                                                           .instance = instance,
                                                           .folder = wishes_folder(state(), "cell"),
                                                           .run_directory = (folder_ / "run").string()});
  }
  void cut_power() {
    WishMemory::remove(pool_, "line1");
    std::filesystem::remove_all(folder_ / "run");
    std::filesystem::create_directories(folder_ / "run");
    make();
  }
  std::string keep(const InstanceWish& wish) {
    sut_->keep(wish);
    return wait_for_disk();
  }
  std::string wait_for_disk() {
    std::string told = "nothing was told";
    sut_->when_kept([&](const std::string& problem) {
      told = problem;
      reactor_->stop();
    });
    if (told == "nothing was told") (void)reactor_->run();
    return told;
  }
  [[nodiscard]] std::string state() const { return (folder_ / "state").string(); }
  [[nodiscard]] std::string file() const { return state() + "/wishes.cell/line1.wish"; }

  std::string pool_;
  std::filesystem::path folder_;
  std::unique_ptr<Reactor> reactor_;
  std::unique_ptr<WishWriter> writer_;
  std::unique_ptr<WishStore> sut_;
};

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

TEST_F(WishStoreTest, LeavesTheOneBeforeWholeWhenItIsKilledInAWrite) {
  ASSERT_TRUE(sut_->find());
  InstanceWish wish = some_wish();
  sut_->keep(wish);
  wish.restarts = 8;
  sut_->keep(wish);
  auto memory = MemoryFile::open(pool_ + ".wish.line1", 1, MemoryFile::Access::read_write);
  ASSERT_TRUE(memory);
  // The first write went to the second place, the second one to the first.
  const std::span<std::byte> bytes = memory->bytes();
  constexpr std::size_t kInTheText = 100;
  bytes[kInTheText] = std::byte{0xff};
  make();
  EXPECT_EQ(sut_->find().value()->restarts, 7U);
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
  EXPECT_FALSE(sut_->find());
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

/// In a folder of its own.
class WishFolderTest : public testing::Test {
 protected:
  WishFolderTest() {
    static int count = 0;
    top_ = std::filesystem::temp_directory_path() / fmt::format("plchost-wf{}-{}", ::getpid(), ++count);
    std::filesystem::create_directories(top_);
  }
  ~WishFolderTest() override {
    std::error_code ignored;
    std::filesystem::remove_all(top_, ignored);
  }
  WishFolderTest(const WishFolderTest&) = delete;
  WishFolderTest& operator=(const WishFolderTest&) = delete;

  [[nodiscard]] std::string folder() const { return wishes_folder(top_.string() + "/state", "cell"); }

  std::filesystem::path top_;
  WishFolderLock sut_;
};

TEST_F(WishFolderTest, IsMadeAndHeld) {
  const auto taken = sut_.take(folder());
  ASSERT_TRUE(taken) << taken.error().describe();
  EXPECT_EQ(std::filesystem::status(folder()).permissions(), std::filesystem::perms::owner_all);
  const auto child = ::fork();
  if (child == 0) {  // another process
    WishFolderLock other;
    const auto refused = other.take(folder());
    const bool good =
        !refused && refused.error().code == ErrorCode::already_exists &&
        refused.error().message.find(folder()) != std::string::npos &&
        refused.error().message.find(fmt::format("process {} ", ::getppid())) != std::string::npos;
    ::_exit(good ? 0 : 1);
  }
  int status = -1;
  ASSERT_EQ(::waitpid(child, &status, 0), child);
  EXPECT_EQ(status, 0);
}

TEST_F(WishFolderTest, ThatCannotBeMadeIsNoOtherManager) {
  std::ofstream(top_ / "state") << "in the way";
  const auto taken = sut_.take(folder());
  ASSERT_FALSE(taken);
  EXPECT_EQ(taken.error().code, ErrorCode::system);
}

TEST_F(WishFolderTest, WithAnotherUsersLockFileIsNoOtherManager) {
  std::filesystem::create_directories(folder());
  std::filesystem::create_symlink("/etc/passwd", folder() + "/manager.lock");
  const auto taken = sut_.take(folder());
  ASSERT_FALSE(taken);
  EXPECT_EQ(taken.error().code, ErrorCode::refused);
}

TEST_F(WishFolderTest, OnADiskThatHangsIsWaitedForNoLongerThanTheLimit) {
  const auto disk = std::make_shared<std::promise<void>>();
  const auto answer = disk->get_future().share();
  const auto taken =
      sut_.take(folder(), std::chrono::milliseconds(50), [disk, answer](const std::string& path) {
        answer.wait();
        return LockFile::take(path);
      });
  ASSERT_FALSE(taken);
  EXPECT_EQ(taken.error().code, ErrorCode::timed_out);
  disk->set_value();
}

}  // namespace
}  // namespace plchost
