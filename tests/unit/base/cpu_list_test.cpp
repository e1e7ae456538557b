#include "shm/base/cpu_list.hpp"

#include <gmock/gmock.h>

namespace plchost {
namespace {

using testing::ElementsAre;
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

TEST(CpuMask, IsWrittenInWordsTheHighestFirst) {
  EXPECT_EQ(format_cpu_mask({}), "0");
  EXPECT_EQ(format_cpu_mask({0, 2}), "5");
  EXPECT_EQ(format_cpu_mask({31, 32}), "1,80000000");
  EXPECT_EQ(format_cpu_mask({64}), "1,00000000,00000000");
}

}  // namespace
}  // namespace plchost
