#include "manager/host_check/host_files.hpp"

#include <gmock/gmock.h>

#include "manager/host_check/cpu_list.hpp"
#include "tests/unit/manager/fake_tree.hpp"

namespace plchost {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

TEST(CpuList, IsReadInTheFormOfTheKernel) {
  EXPECT_THAT(*parse_cpu_list(""), IsEmpty());
  EXPECT_THAT(*parse_cpu_list("0"), ElementsAre(0));
  EXPECT_THAT(*parse_cpu_list("8,1-3,2"), ElementsAre(1, 2, 3, 8));
  EXPECT_EQ(parse_cpu_list("0-8191")->size(), 8192U);
}

TEST(CpuList, IsRefusedInAnyOtherForm) {
  for (const char* wrong :
       {"a", "1,", ",1", "1-", "3-1", "-1", "1 2", "0-8192", "99999999999", "1--2", "0x1"}) {
    EXPECT_FALSE(parse_cpu_list(wrong)) << wrong;
  }
}

TEST(CpuList, IsWrittenAsShortAsPossible) {
  EXPECT_EQ(format_cpu_list({}), "");
  EXPECT_EQ(format_cpu_list({0, 1, 2, 4, 6, 7}), "0-2,4,6-7");
}

TEST(CpuMask, IsReadInWordsTheHighestFirst) {
  EXPECT_THAT(*parse_cpu_mask("0"), IsEmpty());
  EXPECT_THAT(*parse_cpu_mask("5"), ElementsAre(0, 2));
  EXPECT_THAT(*parse_cpu_mask("1,80000000"), ElementsAre(31, 32));
  for (const char* wrong : {"", "g", "1,", "100000000", "-1"}) EXPECT_FALSE(parse_cpu_mask(wrong)) << wrong;
  std::string endless = "0";
  for (int i = 0; i < 400; ++i) endless += ",0";
  EXPECT_FALSE(parse_cpu_mask(endless));
}

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
