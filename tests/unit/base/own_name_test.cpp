#include "tests/support/own_name.hpp"

#include <fstream>

#include <gtest/gtest.h>
#include <sys/wait.h>

namespace plchost {
namespace {

/// Names that a process makes which is then killed.
class OwnName : public testing::Test {
 protected:
  OwnName() {
    std::filesystem::create_directory(folder_);
    const pid_t child = ::fork();
    if (child == 0) {
      make(own_name("file"));
      std::filesystem::create_directories(folder_ / own_name("folder") / "within");
      ::kill(::getpid(), SIGKILL);
    }
    ::waitpid(child, nullptr, 0);
    of_the_dead_ = fmt::format("{}{}-", own_prefix(), child);
  }
  ~OwnName() override { std::filesystem::remove_all(folder_); }

  void make(const std::string& name) const { std::ofstream(folder_ / name) << "x"; }
  [[nodiscard]] int count() const {
    const std::filesystem::directory_iterator files(folder_);
    return static_cast<int>(std::distance(begin(files), end(files)));
  }

  std::filesystem::path folder_ = own_path("names");
  std::string of_the_dead_;
};

TEST_F(OwnName, OfAKilledProcessIsRemovedByTheNextOne) {
  ASSERT_EQ(count(), 2);
  remove_what_was_left_in(folder_);
  EXPECT_EQ(count(), 0);
}

TEST_F(OwnName, OfOthersStays) {
  remove_what_was_left_in(folder_);
  const std::string number = of_the_dead_.substr(own_prefix().size());
  const std::vector<std::string> others{own_name("of one that runs"), "plct-1-" + number + "other-namespace",
                                        own_prefix() + "x" + number, own_prefix(), "plchost-" + number};
  for (const std::string& name : others) make(name);
  remove_what_was_left_in(folder_);
  EXPECT_EQ(count(), static_cast<int>(others.size()));
  make(of_the_dead_ + "1-x");
  remove_what_was_left_in(folder_);
  EXPECT_EQ(count(), static_cast<int>(others.size()));
}

TEST_F(OwnName, HasRoomForAWordInTheNameOfAPool) {
  constexpr std::size_t kMaxPoolName = 31;
  EXPECT_LE((own_prefix() + "1234567-999-downloads").size(), kMaxPoolName);
}

TEST_F(OwnName, IsAnotherOneEachTime) {
  EXPECT_NE(own_name("a"), own_name("a"));
}

}  // namespace
}  // namespace plchost
