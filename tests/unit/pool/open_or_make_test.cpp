#include "shm/files/open_or_make.hpp"

#include <string>
#include <vector>

#include <gmock/gmock.h>

#include "shm/files/fixed_page.hpp"
#include "tests/unit/pool/unique_pool_name.hpp"

namespace plchost {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

/// The answers of open() and make(), one after the other; the last answer stays.
class OpenOrMake : public testing::Test {
 protected:
  Result<int> call(std::vector<Result<int>> opened, std::vector<Result<int>> made, Replaces replaces) {
    const auto next = [](std::vector<Result<int>>& answers) {
      Result<int> answer = answers.front();
      if (answers.size() > 1) answers.erase(answers.begin());
      return answer;
    };
    return open_or_make(
        [&] {
          calls_.emplace_back("open");
          return next(opened);
        },
        [&](bool replace) {
          calls_.emplace_back(replace ? "replace" : "create");
          return next(made);
        },
        replaces);
  }
  static Result<int> fails(ErrorCode code) { return failure(code, "test"); }

  std::vector<std::string> calls_;
};

TEST_F(OpenOrMake, OpensWhatIsThere) {
  EXPECT_EQ(call({1}, {2}, Replaces::anything), 1);
  EXPECT_THAT(calls_, ElementsAre("open"));
}

TEST_F(OpenOrMake, MakesWhatIsNotThere) {
  EXPECT_EQ(call({fails(ErrorCode::not_found)}, {2}, Replaces::nothing), 2);
  EXPECT_THAT(calls_, ElementsAre("open", "create"));
}

TEST_F(OpenOrMake, OpensWhatAnotherProcessWasFasterWith) {
  EXPECT_EQ(call({fails(ErrorCode::not_found), 1}, {fails(ErrorCode::already_exists)}, Replaces::nothing), 1);
  EXPECT_THAT(calls_, ElementsAre("open", "create", "open"));
}

TEST_F(OpenOrMake, EndsWhereOthersMakeAndRemoveItAllTheTime) {
  const auto found =
      call({fails(ErrorCode::not_found)}, {fails(ErrorCode::already_exists)}, Replaces::anything);
  EXPECT_EQ(found.error().code, ErrorCode::already_exists);
  EXPECT_EQ(calls_.size(), 20U);
}

TEST_F(OpenOrMake, SaysWhyItCannotBeMade) {
  const auto found = call({fails(ErrorCode::not_found)}, {fails(ErrorCode::full)}, Replaces::anything);
  EXPECT_EQ(found.error().code, ErrorCode::full);
  EXPECT_THAT(calls_, ElementsAre("open", "create"));
}

TEST_F(OpenOrMake, ReplacesOnlyWhatItMay) {
  struct Case {
    ErrorCode why;
    Replaces replaces;
    bool replaced;
  };
  for (const Case& one :
       {Case{ErrorCode::refused, Replaces::nothing, false}, Case{ErrorCode::refused, Replaces::foreign, true},
        Case{ErrorCode::wrong_type, Replaces::foreign, true},
        Case{ErrorCode::corrupt, Replaces::foreign, false},
        Case{ErrorCode::corrupt, Replaces::nothing, false},
        Case{ErrorCode::corrupt, Replaces::anything, true},
        Case{ErrorCode::refused, Replaces::anything, true}}) {
    calls_.clear();
    const auto found = call({fails(one.why)}, {2}, one.replaces);
    EXPECT_EQ(found.has_value(), one.replaced);
    EXPECT_THAT(calls_.back(), one.replaced ? "replace" : "open");
    if (!one.replaced) {
      EXPECT_EQ(found.error().code, one.why);
    }
  }
}

struct SmallPage {
  std::uint64_t magic = 0;
  std::uint32_t version = 0;
  std::uint32_t size = 0;
  std::uint64_t value = 0;
};
constexpr PageKind kSmall{.what = "small page", .magic = 0x12345678, .version = 2};

TEST(FixedPage, GoesOnWithThePageThatIsThereAndRefusesWhatIsNone) {
  const UniquePoolName name;
  const auto open = [&](Replaces replaces) {
    return open_or_make_page<SmallPage>(name.get(), kSmall, replaces);
  };
  auto made = open_or_make_page<SmallPage>(name.get(), kSmall, Replaces::nothing,
                                           [](SmallPage& page) { page.value = 7; });
  ASSERT_TRUE(made) << made.error().describe();
  auto& page = *reinterpret_cast<SmallPage*>(made->bytes().data());
  EXPECT_EQ(page.value, 7U);
  EXPECT_TRUE(is_described(page, kSmall));
  EXPECT_FALSE(is_described(page, kSmall, sizeof(SmallPage) + 8));
  page.value = 8;
  EXPECT_EQ(reinterpret_cast<SmallPage*>(open(Replaces::anything)->bytes().data())->value, 8U);
  page.version = 3;
  EXPECT_THAT(open(Replaces::foreign).error().message,
              HasSubstr("has version 3 and 24 bytes; 2 and 24 are needed"));
  page.version = 2;
  page.magic = 1;
  EXPECT_THAT(open(Replaces::foreign).error().message, HasSubstr("is not a small page"));
  EXPECT_EQ(reinterpret_cast<SmallPage*>(open(Replaces::anything)->bytes().data())->value, 0U);
  MemoryFile::remove(name.get());
}

}  // namespace
}  // namespace plchost
