// How a debugger reads the state from the pages of a host.
#include "api/cli/debug/debug_link.hpp"

#include <algorithm>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "api/dds/debug_page.hpp"

namespace plchost {
namespace {

using ::testing::HasSubstr;
using Pages = std::function<Result<DebugPart>(const DebugQuery&)>;

DebugLink link_to(Pages pages) {
  return {{.call = [](ControlVerb, const std::string&) { return std::string(R"({"session":1})"); },
           .list_variables = [](const VariableQuery&) { return VariableListing{}; },
           .read_state = std::move(pages)},
          "hosta",
          "line1"};
}

std::string long_state(std::size_t size) {
  std::string text = R"({"session":1,"fill":")";
  text.append(size - text.size() - 2, 'x');
  return text + R"("})";
}

DebugPart part_of_state(const std::string& state, std::size_t offset, std::size_t most,
                        std::uint64_t version = 1) {
  return {.version = version, .size = state.size(), .offset = offset, .text = state.substr(offset, most)};
}

ErrorCode refusal_of(const DebugPart& page) {
  DebugLink sut = link_to([&](const DebugQuery&) { return page; });
  const auto state = sut.state();
  return state ? ErrorCode::ok : state.error().code;
}

TEST(DebugLink, ReadsALongStateByOnePage) {
  const std::string state = long_state(60'000);
  std::vector<DebugQuery> asked;
  DebugLink sut = link_to([&](const DebugQuery& query) {
    asked.push_back(query);
    return part_of_state(state, query.offset, kMaxDebugState);
  });
  ASSERT_TRUE(sut.attach(false));
  EXPECT_EQ(sut.state().value().dump().size(), state.size());
  ASSERT_EQ(asked.size(), 1U);
  EXPECT_EQ(asked.front().session, 1U);
}

TEST(DebugLink, PutsTheStateTogetherFromSeveralPages) {
  const std::string state = long_state(1000);
  int asked = 0;
  DebugLink sut = link_to([&](const DebugQuery& query) {
    ++asked;
    return part_of_state(state, query.offset, 400);
  });
  EXPECT_EQ(sut.state().value()["fill"].get<std::string>().size(), state.size() - long_state(23).size());
  EXPECT_EQ(asked, 3);
}

TEST(DebugLink, BeginsAnewWhenTheStateChangesInBetween) {
  const std::string before = long_state(1000);
  const std::string after = long_state(500);
  int asked = 0;
  DebugLink sut = link_to([&](const DebugQuery& query) {
    if (++asked == 1) return part_of_state(before, query.offset, 600, 1);
    return part_of_state(after, std::min<std::size_t>(query.offset, after.size()), 600, 2);
  });
  EXPECT_EQ(sut.state().value().dump().size(), after.size());
  EXPECT_EQ(asked, 3);
  DebugLink restless = link_to([&](const DebugQuery& query) {
    return part_of_state(before, query.offset, 600, static_cast<std::uint64_t>(++asked));
  });
  EXPECT_EQ(restless.state().error().code, ErrorCode::busy);
}

TEST(DebugLink, RefusesPagesThatAreNoPartOfAState) {
  const std::string state = R"({"session":1})";
  const DebugPart good = part_of_state(state, 0, state.size());
  EXPECT_EQ(refusal_of(good), ErrorCode::ok);
  const auto with = [&](const std::function<void(DebugPart&)>& change) {
    DebugPart page = good;
    change(page);
    return refusal_of(page);
  };
  EXPECT_EQ(with([](DebugPart& page) { page.text = "{\"session\":\xff}"; }), ErrorCode::corrupt);
  EXPECT_EQ(with([](DebugPart& page) { page.text[0] = '['; }), ErrorCode::corrupt);
  EXPECT_EQ(with([](DebugPart& page) { page.offset = 3; }), ErrorCode::corrupt) << "not asked for";
  EXPECT_EQ(with([](DebugPart& page) { page.size = 3; }), ErrorCode::corrupt) << "longer than it says";
  EXPECT_EQ(with([](DebugPart& page) { page.text.clear(); }), ErrorCode::corrupt) << "it would never end";
  EXPECT_EQ(refusal_of(DebugPart{}), ErrorCode::corrupt);
  EXPECT_EQ(with([](DebugPart& page) { page.size = 100; }), ErrorCode::corrupt) << "the same page again";
}

TEST(DebugLink, ReadsNoStateWithoutABound) {
  std::uint64_t told = 0;
  DebugLink sut = link_to([&](const DebugQuery& query) {
    DebugPart page{.version = 1, .size = std::uint64_t{1} << 40, .offset = query.offset, .text = {}};
    page.text.assign(65536, ' ');
    told += page.text.size();
    return page;
  });
  EXPECT_EQ(sut.state().error().code, ErrorCode::corrupt);
  EXPECT_LE(told, std::uint64_t{1} << 20);
}

TEST(DebugLink, TellsThatItsSessionIsOverWhenThePageIsGone) {
  DebugLink sut = link_to([](const DebugQuery&) -> Result<DebugPart> {
    return failure(ErrorCode::not_found, "its application is no debug build");
  });
  EXPECT_EQ(sut.state().error().code, ErrorCode::not_found) << "it has none";
  ASSERT_TRUE(sut.attach(false));
  EXPECT_EQ(sut.state().error().code, ErrorCode::wrong_state);
}

TEST(DebugPageSample, TravelsAsItIs) {
  const DebugPart part{.version = 7, .size = 9, .offset = 4, .text = std::string("a\0b\xc3", 4)};
  DebugPageSample sample(part);
  const DebugPart come = listing_of(sample.page());
  EXPECT_EQ(come.version, 7U);
  EXPECT_EQ(come.size, 9U);
  EXPECT_EQ(come.offset, 4U);
  EXPECT_EQ(come.text, part.text);
  const DebugQuery query = debug_query_of(part_of(DebugQuery{.session = 3, .offset = ~std::uint64_t{0}}));
  EXPECT_EQ(query.session, 3U);
  EXPECT_EQ(query.offset, ~std::uint64_t{0});
}

}  // namespace
}  // namespace plchost
