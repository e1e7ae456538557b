#include "manager/host_check/host_files.hpp"

#include <gmock/gmock.h>

#include "tests/unit/manager/fake_tree.hpp"

namespace plchost {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;

TEST(HostFilesTest, SayWhatIsWrongWithAFile) {
  const FakeTree tree;
  const HostFiles& sut = tree.host.files;
  EXPECT_EQ(sut.text("/none").error().code, ErrorCode::not_found);
  EXPECT_EQ(sut.text("/none").error().describe(), "/none: No such file or directory (ENOENT)");
  tree.make_unreadable("/folder");
  EXPECT_EQ(sut.text("/folder").error().code, ErrorCode::refused);
  tree.write("/binary", std::string("a\0b", 3));
  EXPECT_EQ(sut.text("/binary").error().code, ErrorCode::corrupt);
  tree.write("/words", "seven\n");
  EXPECT_THAT(sut.number("/words").error().message, HasSubstr("/words holds 'seven'"));
  EXPECT_EQ(sut.cores("/words").error().code, ErrorCode::corrupt);
  EXPECT_EQ(sut.core_mask("/words").error().code, ErrorCode::corrupt);
}

TEST(HostFilesTest, ReadOnlyTheBeginningOfAnEndlessFile) {
  const HostFiles sut;
  const auto zeros = sut.text("/dev/zero");
  ASSERT_FALSE(zeros);
  EXPECT_EQ(zeros.error().code, ErrorCode::corrupt);
}

TEST(HostFilesTest, TellWhatTheKernelLacksFromWhatCannotBeSeen) {
  const FakeTree tree;
  tree.write("/proc/sys/kernel/ostype", "Linux\n");
  EXPECT_TRUE(tree.host.files.kernel_lacks("/proc/sys/kernel/watchdog"));
  EXPECT_FALSE(tree.host.files.kernel_lacks("/proc/sys/kernel/ostype"));
  EXPECT_FALSE(tree.host.files.kernel_lacks("/proc/sys/vm/swappiness"));
}

TEST(HostFilesTest, TakeTheKernelsNullForAnEmptySet) {
  const FakeTree tree;
  tree.write("/set", "(null)\n");
  EXPECT_THAT(*tree.host.files.cores("/set"), IsEmpty());
}

}  // namespace
}  // namespace plchost
