#pragma once

#include <atomic>
#include <chrono>
#include <filesystem>
#include <future>
#include <memory>
#include <string>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <sys/wait.h>
#include <unistd.h>

#include "manager/store/wish_memory.hpp"
#include "manager/store/wish_store.hpp"
#include "tests/support/own_name.hpp"

namespace plchost {

inline InstanceWish some_wish() {
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

/// A disk that does not answer as long as this lives.
class FrozenDisk {
 public:
  explicit FrozenDisk(DiskThread& disk) {
    const auto hangs = std::make_shared<std::atomic<bool>>(false);
    while (!*hangs) {  // a thread that has not begun within the limit does not hang yet
      EXPECT_FALSE(disk.within(std::chrono::milliseconds(20), "disk", [hangs, answer = answer_] {
        *hangs = true;
        answer.wait();
      }));
    }
  }
  ~FrozenDisk() { thaw_.set_value(); }
  FrozenDisk(const FrozenDisk&) = delete;
  FrozenDisk& operator=(const FrozenDisk&) = delete;

 private:
  std::promise<void> thaw_;
  std::shared_future<void> answer_ = thaw_.get_future().share();
};

/// A manager with a real helper, in a folder of its own.
class WishStoreTest : public testing::Test {
 protected:
  WishStoreTest() {
    pool_ = own_name("wish");
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
    disk_ = std::make_unique<DiskThread>();
    writer_ = std::make_unique<WishWriter>(*reactor_, PLCHOST_MANAGER_PROGRAM);
    sut_ = std::make_unique<WishStore>(*reactor_, *writer_, *disk_,
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
  /// A disk, or a helper that begins, may take longer than the manager waits: then it is asked again.
  std::string wait_for_disk() {
    for (;;) {
      std::string told = "nothing was told";
      sut_->when_kept([&](const std::string& problem) {
        told = problem;
        reactor_->stop();
      });
      if (told == "nothing was told") (void)reactor_->run();
      if (!told.contains("has not taken it within")) return told;
    }
  }
  [[nodiscard]] std::string state() const { return (folder_ / "state").string(); }
  [[nodiscard]] std::string file() const { return state() + "/wishes.cell/line1.wish"; }

  std::string pool_;
  std::filesystem::path folder_;
  std::unique_ptr<Reactor> reactor_;
  std::unique_ptr<WishWriter> writer_;
  std::unique_ptr<DiskThread> disk_;
  std::unique_ptr<WishStore> sut_;
};

}  // namespace plchost
