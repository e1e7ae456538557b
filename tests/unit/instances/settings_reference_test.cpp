// [CmpSettings] FileReference.N
#include <filesystem>
#include <fstream>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "instances/runtime/application/declare_application.hpp"
#include "instances/runtime/settings/read_settings.hpp"

namespace plchost {
namespace {

using namespace std::chrono_literals;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

class SettingsReference : public ::testing::Test {
 protected:
  SettingsReference() { std::filesystem::create_directories(folder_ / "more"); }
  ~SettingsReference() override { std::filesystem::remove_all(folder_); }

  [[nodiscard]] std::string path(const std::string& name) const { return folder_ / name; }
  std::string write(const std::string& name, const std::string& text) const {
    std::ofstream(folder_ / name) << text;
    return path(name);
  }

 private:
  std::filesystem::path folder_ = std::filesystem::path(::testing::TempDir()) /
                                  ::testing::UnitTest::GetInstance()->current_test_info()->name();
};

TEST_F(SettingsReference, IsReadAfterTheFileThatNamesItAndCounts) {
  write("more/user.cfg",
        "[CmpSchedule]\nSchedulerInterval=2000\n[ComponentManager]\nComponent.1=a.so\n[CmpLog]\n");
  const std::string first =
      write("first.cfg",
            "[CmpSettings]\nFileReference.1=more/user.cfg, User ; theirs\nOther=1\n"
            "[CmpSchedule]\nSchedulerInterval=1000\n[ComponentManager]\nComponent.2=b.so\n");
  const auto sut = read_settings(first);
  ASSERT_TRUE(sut) << sut.error().message;
  EXPECT_EQ(sut->scheduler.scheduler_interval, 2ms);
  EXPECT_THAT(sut->components, ElementsAre(path("more/a.so"), path("b.so")));
  EXPECT_THAT(sut->foreign_sections, ElementsAre("CmpSettings", "CmpLog"));
  EXPECT_THAT(sut->remarks,
              ElementsAre(fmt::format("{}:2: [CmpSchedule] SchedulerInterval takes the place of "
                                      "the one in {}:5",
                                      path("more/user.cfg"), first)));
}

TEST_F(SettingsReference, AreReadInTheOrderOfTheirNumbers) {
  write("a.cfg", "[CmpSchedule]\nSchedulerInterval=2000\n");
  write("b.cfg", "[CmpSchedule]\nSchedulerInterval=3000\n");
  const auto sut =
      read_settings(write("first.cfg", "[CmpSettings]\nFileReference.1=a.cfg\nFileReference.0=\"b.cfg\"\n"));
  ASSERT_TRUE(sut) << sut.error().message;
  EXPECT_EQ(sut->scheduler.scheduler_interval, 2ms);
}

TEST_F(SettingsReference, ToAFileThatIsNotThereIsARemark) {
  const std::string first = write("first.cfg", "[CmpSettings]\nFileReference.0=none.cfg, none\n");
  const auto sut = read_settings(first);
  ASSERT_TRUE(sut) << sut.error().message;
  EXPECT_THAT(sut->remarks, ElementsAre(AllOf(HasSubstr(first + ":2: "), HasSubstr(path("none.cfg")))));
}

TEST_F(SettingsReference, BackToAFileThatIsBeingReadIsAnError) {
  write("more/user.cfg", "[CmpSettings]\nFileReference.0=../first.cfg\n");
  const auto sut = read_settings(write("first.cfg", "[CmpSettings]\nFileReference.0=more/user.cfg\n"));
  ASSERT_FALSE(sut);
  EXPECT_THAT(sut.error().message, HasSubstr(path("more/user.cfg") + ":2: "));
  EXPECT_THAT(sut.error().message, HasSubstr("it refers back"));
}

TEST_F(SettingsReference, FromTwoFilesIsReadOnce) {
  write("a.cfg", "[CmpSettings]\nFileReference.0=c.cfg\n");
  write("b.cfg", "[CmpSettings]\nFileReference.0=c.cfg\n");
  write("c.cfg", "[CmpSchedule]\nSchedulerInterval=2000\n");
  const auto sut =
      read_settings(write("first.cfg", "[CmpSettings]\nFileReference.0=a.cfg\nFileReference.1=b.cfg\n"));
  ASSERT_TRUE(sut) << sut.error().message;
  EXPECT_EQ(sut->scheduler.scheduler_interval, 2ms);
  EXPECT_THAT(sut->remarks, IsEmpty());
}

TEST_F(SettingsReference, HasALimitOfDepth) {
  for (std::size_t i = 0; i <= kMaxReferenceDepth; ++i) {
    write(fmt::format("{}.cfg", i), fmt::format("[CmpSettings]\nFileReference.0={}.cfg\n", i + 1));
  }
  write(fmt::format("{}.cfg", kMaxReferenceDepth + 1), "");
  EXPECT_FALSE(read_settings(path("0.cfg")));
  EXPECT_TRUE(read_settings(path("1.cfg")));
}

TEST_F(SettingsReference, ErrorsNameTheFileThatTheyAreIn) {
  write("user.cfg", "[CmpSchedule]\nSchedulerInterval=1\n");
  const auto sut = read_settings(write("first.cfg", "[CmpSettings]\nFileReference.0=user.cfg\n"));
  ASSERT_FALSE(sut);
  EXPECT_THAT(sut.error().message, HasSubstr(path("user.cfg") + ":2: [CmpSchedule] SchedulerInterval: '1'"));
}

TEST_F(SettingsReference, IsReadFromTextsThatWereKept) {
  write("a.cfg", "[CmpSchedule]\nSchedulerInterval=2000\n");
  const std::string first =
      write("first.cfg", "[CmpSettings]\nFileReference.0=a.cfg\nFileReference.1=gone.cfg\n");
  SettingsFiles files;
  const auto before = read_settings(first, files);
  ASSERT_TRUE(before);
  ASSERT_TRUE(keep_settings(path("kept"), first, files.texts()));
  write("a.cfg", "[CmpSchedule]\nSchedulerInterval=5000\n");
  write("gone.cfg", "[CmpSchedule]\nSchedulerInterval=5000\n");
  std::filesystem::remove(first);
  auto kept = read_kept_settings(path("kept"));
  ASSERT_TRUE(kept);
  EXPECT_EQ(kept->file(), first);
  const auto sut = read_settings(first, *kept);
  ASSERT_TRUE(sut) << sut.error().describe();
  EXPECT_EQ(sut->scheduler, before->scheduler);
  EXPECT_EQ(sut->remarks.size(), 1U);
}

// After a power cut the run directory is empty, and the application of before is to come up all the same.
TEST_F(SettingsReference, IsReadFromTheFilesWhereNoTextsWereKept) {
  LaunchOptions launch;
  launch.name = "line1";
  launch.run_directory = path("run");
  launch.settings = write("first.cfg", "[CmpSchedule]\nSchedulerInterval=5000\n");
  launch.kept_settings = true;
  const auto sut = read_start_settings(launch);
  ASSERT_TRUE(sut) << sut.error().describe();
  EXPECT_EQ(sut->settings, *read_settings(launch.settings));
  EXPECT_EQ(sut->texts.size(), 1U);
}

TEST_F(SettingsReference, OfKeptTextsThatAreNoneIsRefused) {
  EXPECT_EQ(read_kept_settings(path("none")).error().code, ErrorCode::not_found);
  for (const char* text : {"", "[CmpSchedule]", "\xa1\x61\x61\x01"}) {
    EXPECT_EQ(read_kept_settings(write("kept", text)).error().code, ErrorCode::corrupt);
  }
}

}  // namespace
}  // namespace plchost
