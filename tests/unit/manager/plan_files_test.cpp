#include "manager/host_check/plan_files.hpp"

#include <filesystem>
#include <fstream>
#include <sstream>

#include <gmock/gmock.h>
#include <sys/stat.h>
#include <unistd.h>

#include "tests/support/own_name.hpp"

namespace plchost {
namespace {

using testing::HasSubstr;
using State = PlanFiles::State;

class PlanFilesTest : public testing::Test {
 protected:
  PlanFilesTest() { std::filesystem::create_directories(root_); }
  ~PlanFilesTest() override {
    std::error_code ignored;
    std::filesystem::remove_all(root_, ignored);
  }

  [[nodiscard]] std::filesystem::path at(PlanPart part) const { return root_.string() + place_of(part).path; }
  void put(PlanPart part, const std::string& text) const {
    std::filesystem::create_directories(at(part).parent_path());
    std::ofstream(at(part)) << text;
  }
  static std::string read(const std::filesystem::path& path) {
    std::stringstream text;
    text << std::ifstream(path).rdbuf();
    return text.str();
  }
  void expect_refused(PlanPart part, const std::string& why) const {
    const PlannedFile file{part, text_};
    ASSERT_FALSE(sut_.state(file)) << why;
    EXPECT_EQ(sut_.state(file).error().code, ErrorCode::refused);
    EXPECT_THAT(sut_.state(file).error().message, HasSubstr(why));
    ASSERT_FALSE(sut_.remove(part)) << why;
    EXPECT_EQ(sut_.remove(part).error().code, ErrorCode::refused);
  }

  const std::filesystem::path root_ = own_path("plan");
  const std::string text_ = std::string(kPlanMark) + "a\n";
  const PlannedFile file_{PlanPart::sysctl, text_};
  const PlanFiles sut_{root_.string()};
};

TEST_F(PlanFilesTest, AreWrittenAndRemoved) {
  EXPECT_EQ(sut_.state(file_), State::missing);
  const mode_t before = ::umask(0077);
  EXPECT_TRUE(sut_.write(file_));
  ::umask(before);
  EXPECT_EQ(sut_.state(file_), State::same);
  EXPECT_EQ(read(at(PlanPart::sysctl)), text_);
  struct stat found{};
  ASSERT_EQ(::stat(at(PlanPart::sysctl).c_str(), &found), 0);
  EXPECT_EQ(found.st_mode & 07777U, 0644U) << "with any umask";
  EXPECT_EQ(sut_.state({PlanPart::sysctl, text_ + "b\n"}), State::other);
  EXPECT_TRUE(sut_.write({PlanPart::sysctl, text_ + "b\n"}));
  EXPECT_EQ(read(at(PlanPart::sysctl)), text_ + "b\n");
  EXPECT_EQ(sut_.remove(PlanPart::sysctl), true);
  EXPECT_FALSE(std::filesystem::exists(at(PlanPart::sysctl)));
  EXPECT_EQ(sut_.remove(PlanPart::sysctl), false);
}

TEST_F(PlanFilesTest, HaveALinkThatTurnsTheUnitOn) {
  const PlannedFile link{PlanPart::unit_link, {}};
  EXPECT_TRUE(sut_.write(link));
  EXPECT_EQ(std::filesystem::read_symlink(at(PlanPart::unit_link)), "../plchost-tuning.service");
  EXPECT_EQ(sut_.state(link), State::same);
  EXPECT_EQ(sut_.remove(PlanPart::unit_link), true);
  EXPECT_EQ(sut_.state(link), State::missing);
  std::filesystem::create_symlink(place_of(PlanPart::unit).path, at(PlanPart::unit_link));
  EXPECT_EQ(sut_.state(link), State::other) << "as systemctl makes it";
  EXPECT_EQ(sut_.remove(PlanPart::unit_link), true);
  EXPECT_EQ(sut_.state(link), State::missing);
}

TEST_F(PlanFilesTest, AreWrittenAnewIfAnotherCouldChangeThem) {
  EXPECT_TRUE(sut_.write(file_));
  std::filesystem::create_hard_link(at(PlanPart::sysctl), root_ / "second_name");
  EXPECT_EQ(sut_.state(file_), State::other);
  EXPECT_TRUE(sut_.write(file_));
  EXPECT_EQ(sut_.state(file_), State::same);
  // Only root can give a file away.
  if (::geteuid() != 0) return;
  ASSERT_EQ(::chown(at(PlanPart::sysctl).c_str(), 65534, 65534), 0);
  EXPECT_EQ(sut_.state(file_), State::other);
  EXPECT_TRUE(sut_.write(file_));
  EXPECT_EQ(sut_.state(file_), State::same);
}

TEST_F(PlanFilesTest, OfAnotherAreLeftAlone) {
  for (const char* text : {"kernel.x = 1\n", "", "# Made by plc"}) {
    put(PlanPart::sysctl, text);
    expect_refused(PlanPart::sysctl, "plchost has not made it");
    EXPECT_EQ(read(at(PlanPart::sysctl)), text);
  }
  std::filesystem::create_directories(at(PlanPart::udev));
  expect_refused(PlanPart::udev, "no plain file");
  put(PlanPart::unit_link, text_);
  expect_refused(PlanPart::unit_link, "no link of plchost");
}

TEST_F(PlanFilesTest, FollowNoLinkThatSomebodyHasPlanted) {
  const std::filesystem::path elsewhere = root_ / "elsewhere";
  std::ofstream(elsewhere) << text_;
  std::filesystem::create_directories(at(PlanPart::sysctl).parent_path());
  std::filesystem::create_symlink(elsewhere, at(PlanPart::sysctl));
  expect_refused(PlanPart::sysctl, "no plain file");
  EXPECT_EQ(read(elsewhere), text_);
  std::filesystem::create_directories(root_ / "outside");
  std::filesystem::create_directories(at(PlanPart::udev).parent_path().parent_path());
  std::filesystem::create_symlink(root_ / "outside", at(PlanPart::udev).parent_path());
  expect_refused(PlanPart::udev, "where a folder has to be");
  EXPECT_FALSE(sut_.write({PlanPart::udev, text_}));
  EXPECT_TRUE(std::filesystem::is_empty(root_ / "outside"));
  std::filesystem::create_directories(at(PlanPart::unit_link).parent_path());
  std::filesystem::create_symlink("/dev/null", at(PlanPart::unit_link));
  expect_refused(PlanPart::unit_link, "a link to somewhere else");
}

TEST_F(PlanFilesTest, AreWholeOrAsBefore) {
  put(PlanPart::sysctl, text_);
  const std::string fresh = at(PlanPart::sysctl).string() + ".plchost-new";
  std::ofstream(fresh) << "half a";
  EXPECT_TRUE(sut_.write({PlanPart::sysctl, text_ + "b\n"}));
  EXPECT_FALSE(std::filesystem::exists(fresh)) << "the left-over of a write that was cut";
  std::filesystem::create_symlink(root_ / "elsewhere", fresh);
  EXPECT_TRUE(sut_.write(file_));
  EXPECT_FALSE(std::filesystem::exists(root_ / "elsewhere")) << "written through a planted link";
  std::filesystem::create_directories(fresh);
  EXPECT_FALSE(sut_.write({PlanPart::sysctl, text_ + "c\n"}));
  EXPECT_EQ(read(at(PlanPart::sysctl)), text_);
  std::filesystem::remove(fresh);
  std::ofstream(fresh) << "half a";
  EXPECT_EQ(sut_.remove(PlanPart::sysctl), true);
  EXPECT_FALSE(std::filesystem::exists(fresh));
}

TEST_F(PlanFilesTest, LeaveNoFolderThatWasForThemAlone) {
  EXPECT_TRUE(sut_.write({PlanPart::irqbalance, text_}));
  EXPECT_EQ(sut_.remove(PlanPart::irqbalance), true);
  EXPECT_FALSE(std::filesystem::exists(at(PlanPart::irqbalance).parent_path()));
  EXPECT_TRUE(sut_.write({PlanPart::irqbalance, text_}));
  std::ofstream(at(PlanPart::irqbalance).parent_path() / "mine.conf") << "x";
  EXPECT_EQ(sut_.remove(PlanPart::irqbalance), true);
  EXPECT_TRUE(std::filesystem::exists(at(PlanPart::irqbalance).parent_path() / "mine.conf"));
}

TEST(PlanFiles, NeedTheirRoot) {
  const PlanFiles sut("/no/such/folder");
  const PlannedFile file{PlanPart::sysctl, std::string(kPlanMark)};
  EXPECT_EQ(sut.state(file).error().code, ErrorCode::system);
  EXPECT_FALSE(sut.write(file));
}

}  // namespace
}  // namespace plchost
