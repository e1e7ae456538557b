#include "instances/runtime/debug/breakpoint.hpp"

#include <array>
#include <cstdint>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "instances/runtime/debug/debug_answer.hpp"
#include "instances/runtime/debug/debug_value.hpp"
#include "instances/runtime/debug/step_rule.hpp"

namespace plchost {
namespace {

using testing::HasSubstr;

/// The variables of a POU, of which there are two instances, and a global one.
struct MotorData {
  std::int16_t speed = 0;
  std::uint8_t on = 0;
  std::int64_t total = 0;
  char letter = 'a';
  char16_t sign = u'a';
};

class BreakpointConditions : public testing::Test {
 protected:
  Result<ValuePlace> find(std::string_view name) {
    const auto own = [&](VariableType type, std::uint32_t bytes, std::ptrdiff_t offset) {
      return ValuePlace{.type = type, .bytes = bytes, .base = ValuePlace::Base::self, .offset = offset};
    };
    if (name == "speed") return own(VariableType::int_, 2, offsetof(MotorData, speed));
    if (name == "on") return own(VariableType::bool_, 1, offsetof(MotorData, on));
    if (name == "total") return own(VariableType::lint, 8, offsetof(MotorData, total));
    if (name == "limit") {
      return ValuePlace{
          .type = VariableType::lreal, .bytes = 8, .address = reinterpret_cast<const std::byte*>(&limit_)};
    }
    if (name == "sum") {
      return ValuePlace{
          .type = VariableType::dint, .bytes = 4, .base = ValuePlace::Base::local, .local = kSum};
    }
    if (name == "letter") return own(VariableType::char_, 1, offsetof(MotorData, letter));
    if (name == "sign") return own(VariableType::wchar, 2, offsetof(MotorData, sign));
    if (name == "title") return own(VariableType::wstring, 8, 0);
    if (name == "label") return own(VariableType::string, 8, 0);
    return failure(ErrorCode::not_found, "no variable '" + std::string(name) + "'");
  }
  Result<Condition> parse(std::string_view text) {
    return Condition::parse(text, [this](std::string_view name) { return find(name); });
  }
  bool holds(std::string_view text, const MotorData& data) {
    const auto made = parse(text);
    EXPECT_TRUE(made) << text << ": " << made.error().describe();
    return made && made->holds(frame_of(&data));
  }
  /// With two local variables from number kSum - 1 on.
  static Plc_Frame frame_of(const MotorData* data, void* const* locals = nullptr) {
    Plc_Frame frame{};
    frame.pSelf = data;
    frame.ppLocals = locals;
    frame.dwFirstLocal = kSum - 1;
    frame.nLocals = locals == nullptr ? 0 : 2;
    return frame;
  }
  std::string fault(std::string_view text) {
    const auto made = parse(text);
    return made ? "" : made.error().message;
  }

  static constexpr std::uint32_t kSum = 3;
  double limit_ = 7.5;
};

TEST_F(BreakpointConditions, CompareVariablesOfTheirFrame) {
  const MotorData slow{.speed = 5, .on = 1, .total = 9'007'199'254'740'993};
  const MotorData fast{.speed = 10, .on = 0, .total = -1};
  EXPECT_TRUE(holds("speed = 5", slow));
  EXPECT_FALSE(holds("speed = 5", fast));
  EXPECT_TRUE(holds("speed <> 5", fast));
  EXPECT_TRUE(holds("speed<limit", slow));
  EXPECT_TRUE(holds("speed >= limit", fast));
  EXPECT_TRUE(holds("speed <= 16#0A AND speed > -3", fast));
  EXPECT_TRUE(holds("on", slow));
  EXPECT_TRUE(holds("NOT on", fast));
  EXPECT_TRUE(holds("on = TRUE", slow));
  EXPECT_TRUE(holds("total = 9007199254740993", slow));
  EXPECT_FALSE(holds("total = 9007199254740992", slow));
  EXPECT_TRUE(holds("on OR speed = 10 AND total = -1", fast));
  EXPECT_TRUE(holds("on or (speed = 10)", slow));
  EXPECT_FALSE(holds("(on OR speed = 10) AND total = -1", slow));
  EXPECT_TRUE(holds("NOT (on AND speed > 5)", slow));
}

TEST_F(BreakpointConditions, CompareCharacters) {
  const MotorData data{.letter = '\xe9', .sign = u'='};
  EXPECT_TRUE(holds("letter = '$E9' AND letter > 'z'", data));
  EXPECT_TRUE(holds("sign = \"=\"", data));
  EXPECT_TRUE(holds("(sign <> \" \")AND NOT (sign = WCHAR#\")\")", data));
  EXPECT_FALSE(holds("letter = CHAR#'$''", data));
  EXPECT_TRUE(holds("letter > sign", data));
  EXPECT_THAT(fault("letter = e"), HasSubstr("no variable 'e'"));
  EXPECT_THAT(fault("letter = '$'"), HasSubstr("allowed is"));
  EXPECT_THAT(fault("letter = 'e"), HasSubstr("allowed is"));
  EXPECT_THAT(fault("title = \"a\""), HasSubstr("'title' is a string"));
}

TEST_F(BreakpointConditions, OfAFunctionHaveNoOwnVariables) {
  const auto made = parse("speed > 0");
  ASSERT_TRUE(made);
  EXPECT_FALSE(made->holds(frame_of(nullptr)));
}

TEST_F(BreakpointConditions, CompareLocalVariablesOfTheirCall) {
  std::int32_t sum = 7;
  std::int16_t other = 8;
  std::array<void*, 2> locals{&other, &sum};
  const MotorData data{.speed = 7};
  const auto made = parse("sum = speed AND sum > 6");
  ASSERT_TRUE(made) << made.error().describe();
  EXPECT_TRUE(made->holds(frame_of(&data, locals.data())));
  sum = 8;
  EXPECT_FALSE(made->holds(frame_of(&data, locals.data())));
  EXPECT_FALSE(made->holds(frame_of(&data))) << "a call without local variables";
  locals[1] = nullptr;
  EXPECT_FALSE(made->holds(frame_of(&data, locals.data()))) << "one that cannot be seen";
}

TEST_F(BreakpointConditions, ReadNoLocalVariableBeyondThoseOfTheCall) {
  std::int32_t sum = 7;
  const std::array<void*, 2> locals{&sum, &sum};
  Plc_Frame frame = frame_of(nullptr, locals.data());
  EXPECT_NE(local_address(frame, kSum), nullptr);
  EXPECT_EQ(local_address(frame, 0), nullptr);
  EXPECT_EQ(local_address(frame, kSum + 1), nullptr);
  EXPECT_EQ(local_address(frame, 4'294'967'295U), nullptr);
  frame.dwFirstLocal = 4'294'967'295U;
  EXPECT_EQ(local_address(frame, 0), nullptr);
}

TEST_F(BreakpointConditions, AreRefused) {
  EXPECT_THAT(fault(""), HasSubstr("ends too early"));
  EXPECT_THAT(fault("speed"), HasSubstr("no BOOL"));
  EXPECT_THAT(fault("speed ="), HasSubstr("ends too early"));
  EXPECT_THAT(fault("speed = 40000"), HasSubstr("32767"));
  EXPECT_THAT(fault("speed = other"), HasSubstr("no variable 'other'"));
  EXPECT_THAT(fault("other = 5"), HasSubstr("no variable 'other'"));
  EXPECT_THAT(fault("5 = speed"), HasSubstr("no variable"));
  EXPECT_THAT(fault("label = 'x'"), HasSubstr("string"));
  EXPECT_THAT(fault("speed == 5"), HasSubstr("no BOOL"));
  EXPECT_THAT(fault("(on"), HasSubstr("')' is missing"));
  EXPECT_THAT(fault("on on"), HasSubstr("'on' is not expected"));
  EXPECT_THAT(fault("on OR"), HasSubstr("ends too early"));
  EXPECT_THAT(fault(std::string(16, '(') + "on" + std::string(16, ')')), HasSubstr("deeper than 16"));
  EXPECT_EQ(fault(std::string(15, '(') + "on" + std::string(15, ')')), "");
  EXPECT_THAT(fault(std::string(201, ' ')), HasSubstr("at most 200"));
}

TEST(HitRules, CountOnlySomeHits) {
  const auto rule = [](std::string_view text) { return HitRule::parse(text).value(); };
  EXPECT_TRUE(HitRule{}.holds(1));
  EXPECT_FALSE(rule("=3").holds(2));
  EXPECT_TRUE(rule("=3").holds(3));
  EXPECT_FALSE(rule("=3").holds(4));
  EXPECT_TRUE(rule("%3").holds(6));
  EXPECT_FALSE(rule("% 3").holds(7));
  EXPECT_FALSE(rule(">=3").holds(2));
  EXPECT_TRUE(rule(">=3").holds(4));
  EXPECT_TRUE(rule("3").holds(4));
  for (const char* const wrong : {"", "=", "0", "%0", "-1", "x", "3x", "==3", "99999999999999999999"})
    EXPECT_FALSE(HitRule::parse(wrong)) << wrong;
}

TEST(BreakpointOrders, HaveTheirPartsInOrder) {
  const auto order = BreakpointOrder::parse(" Main:5 hits %2 if a = 1 AND b log now {a} if so ").value();
  EXPECT_EQ(order.place, "Main:5");
  EXPECT_EQ(order.hits, "%2");
  EXPECT_EQ(order.condition, "a = 1 AND b");
  EXPECT_EQ(order.log, "now {a} if so");
  const auto logged = BreakpointOrder::parse("main.st:7 log speed {speed}").value();
  EXPECT_EQ(logged.log, "speed {speed}");
  EXPECT_EQ(logged.condition, "");
  EXPECT_EQ(BreakpointOrder::parse("Main").value().place, "Main");
  for (const char* const wrong : {"", "  ", "Main 5", "if a", "Main hits"})
    EXPECT_FALSE(BreakpointOrder::parse(wrong)) << wrong;
}

TEST(BreakpointOrders, HaveFilesWithBlanksInQuotationMarks) {
  const auto order = BreakpointOrder::parse(R"("my log line.st":7 hits %2 log at {a})").value();
  EXPECT_EQ(order.place, "my log line.st:7");
  EXPECT_EQ(order.hits, "%2");
  EXPECT_EQ(order.log, "at {a}");
  EXPECT_EQ(BreakpointOrder::parse(R"("/a b/c if d.st":7)").value().place, "/a b/c if d.st:7");
  EXPECT_EQ(BreakpointOrder::parse(R"("a b.st:7" if c)").value().place, "a b.st:7");
  for (const char* const wrong :
       {"\"a b.st:7", "\"", "\"\"", "\"a b.st\":7 8", "\"a b.st\" :7", "x \"a b.st\":7"})
    EXPECT_FALSE(BreakpointOrder::parse(wrong)) << wrong;
  EXPECT_THAT(BreakpointOrder::parse("a b.st:7").error().message, HasSubstr("stands in quotation marks"));
}

TEST_F(BreakpointConditions, AreNoLogTemplates) {
  const FindValue find = [this](std::string_view name) { return this->find(name); };
  const auto made = LogTemplate::parse("speed {speed} of { limit }!", find).value();
  EXPECT_THAT(made.texts, testing::ElementsAre("speed ", " of ", "!"));
  EXPECT_EQ(made.values.size(), 2U);
  EXPECT_EQ(LogTemplate::parse("plain", find).value().values.size(), 0U);
  EXPECT_THAT(LogTemplate::parse("{speed", find).error().message, HasSubstr("'}' is missing"));
  EXPECT_THAT(LogTemplate::parse("{label}", find).error().message, HasSubstr("string"));
  EXPECT_THAT(LogTemplate::parse("{other}", find).error().message, HasSubstr("no variable"));
  EXPECT_THAT(LogTemplate::parse(std::string(201, 'x'), find).error().message, HasSubstr("200"));
  std::string many;
  for (std::size_t i = 0; i < LogTemplate::kMaxValues; ++i) many += "{speed}";
  EXPECT_TRUE(LogTemplate::parse(many, find));
  EXPECT_THAT(LogTemplate::parse(many + "{speed}", find).error().message, HasSubstr("at most 8 values"));
}

TEST(BreakpointTables, FindTheBreakpointsOfAStatement) {
  const auto at = [](std::uint32_t id, std::uint32_t pou, std::uint32_t line) {
    return std::make_shared<const Breakpoint>(Breakpoint{.id = id,
                                                         .place = {.pou = pou, .line = line},
                                                         .order = {},
                                                         .hit_rule = {},
                                                         .condition = {},
                                                         .log = {},
                                                         .hits = nullptr});
  };
  const BreakpointTable sut({at(1, 2, 7), at(2, 0, 3), at(3, 2, 5), at(4, 2, 7)}, 4);
  const auto ids = [&](std::uint32_t pou, std::uint32_t line) {
    std::vector<std::uint32_t> found;
    for (const auto& breakpoint : sut.at(pou, line)) found.push_back(breakpoint->id);
    return found;
  };
  EXPECT_THAT(ids(2, 7), testing::ElementsAre(1, 4));
  EXPECT_THAT(ids(2, 5), testing::ElementsAre(3));
  EXPECT_THAT(ids(0, 3), testing::ElementsAre(2));
  EXPECT_TRUE(ids(0, 4).empty());
  EXPECT_TRUE(ids(1, 3).empty());
  EXPECT_TRUE(ids(3, 3).empty());
  EXPECT_TRUE(ids(4, 3).empty());
  EXPECT_TRUE(ids(4'000'000'000, 3).empty());
}

class StepRules : public testing::Test {
 protected:
  StepRules() {
    inner_.pCaller = &begin_;
    begin_.pCaller = &outer_;
  }
  bool halts(StepRule rule, Plc_Frame& frame, unsigned line, std::uint64_t cycle = 5) {
    return halts_at(rule, frame, line, &another_marker_, cycle);
  }
  static bool halts_at(StepRule rule, Plc_Frame& frame, unsigned line, const char* marker,
                       std::uint64_t cycle = 5) {
    frame.dwLine = line;
    return rule.halts_at(frame, marker, cycle);
  }
  StepRule rule(StepRule::Kind kind) {
    begin_.dwLine = 10;
    StepRule made = StepRule::over(begin_, &marker_, 5);
    made.kind = kind;
    return made;
  }
  char marker_ = 0;
  char another_marker_ = 0;
  Plc_Pou pou_{sizeof(Plc_Pou), "Main", "main.st", nullptr, 0, 0, nullptr, 0, nullptr, 0};
  Plc_Frame outer_{&pou_, nullptr, 0, 0, nullptr, nullptr, 0, 0};
  Plc_Frame begin_{&pou_, nullptr, 0, 1, nullptr, nullptr, 0, 0};
  Plc_Frame inner_{&pou_, nullptr, 0, 2, nullptr, nullptr, 0, 0};
};

TEST_F(StepRules, HaltWhereTheySay) {
  using Kind = StepRule::Kind;
  EXPECT_FALSE(halts(rule(Kind::none), begin_, 11));
  EXPECT_TRUE(halts(rule(Kind::into), begin_, 11));
  EXPECT_TRUE(halts(rule(Kind::into), inner_, 10));
  EXPECT_FALSE(halts(rule(Kind::into), begin_, 10)) << "another statement of the same line";
  EXPECT_TRUE(halts(rule(Kind::into), begin_, 10, 6));
  EXPECT_TRUE(halts(rule(Kind::over), begin_, 11));
  EXPECT_FALSE(halts(rule(Kind::over), inner_, 11));
  EXPECT_TRUE(halts(rule(Kind::over), inner_, 11, 6)) << "all calls of the cycle have returned";
  EXPECT_TRUE(halts(rule(Kind::until), inner_, 10));
  EXPECT_FALSE(halts(rule(Kind::until), begin_, 11));
}

TEST_F(StepRules, HaltAtTheNextRunOfTheirStatement) {
  using Kind = StepRule::Kind;
  for (const Kind kind : {Kind::over, Kind::into}) {
    EXPECT_TRUE(halts_at(rule(kind), begin_, 10, &marker_)) << "the next run of a loop";
    EXPECT_FALSE(halts_at(rule(kind), begin_, 10, &another_marker_));
  }
  EXPECT_FALSE(halts_at(rule(Kind::over), inner_, 10, &marker_)) << "a call of itself";
}

TEST_F(StepRules, MeanTheCallerWhenTheirCallHasReturned) {
  StepRule over = rule(StepRule::Kind::over);
  over.leaves(inner_);
  EXPECT_TRUE(halts(over, begin_, 11)) << "that was another call";
  over.leaves(begin_);
  EXPECT_FALSE(halts(over, begin_, 11)) << "another call at the same address";
  EXPECT_TRUE(halts(over, outer_, 10)) << "in the same line, too";
  over.leaves(outer_);
  EXPECT_FALSE(halts(over, outer_, 3));
  EXPECT_TRUE(halts(over, outer_, 3, 6));

  StepRule into = rule(StepRule::Kind::into);
  into.leaves(begin_);
  EXPECT_TRUE(halts(into, begin_, 10)) << "another call of the same function in the same line";
}

TEST(DebugNumbers, OfDatesAreNanosecondsInEachForm) {
  const std::int64_t days = 3;
  const std::int64_t nanoseconds = days * 86'400'000'000'000;
  const std::array<std::int64_t, 2> timespec{days * 86'400, 0};
  const DebugNumber date = number_of(VariableType::date, std::as_bytes(std::span(&nanoseconds, 1)));
  EXPECT_EQ(number_of(VariableType::days_date, std::as_bytes(std::span(&days, 1))), date);
  EXPECT_EQ(number_of(VariableType::timespec_date, std::as_bytes(std::span(timespec))), date);
}

TEST(DebugAnswer, IsNoLongerThanAReply) {
  const auto answer = [](std::size_t file, std::size_t remark) {
    return nlohmann::json{{"id", 4'294'967'295U},
                          {"pou", std::string(63, 'p')},
                          {"file", std::string(file, '"')},
                          {"line", 4'294'967'295U},
                          {"remark", std::string(remark, 'r')}};
  };
  EXPECT_EQ(nlohmann::json::parse(debug_answer(answer(20, 100))), answer(20, 100));
  EXPECT_FALSE(nlohmann::json::parse(debug_answer(answer(255, 100))).contains("file"));
  EXPECT_LE(debug_answer(answer(255, 600)).size(), kMaxDebugAnswer);
  EXPECT_THAT(debug_answer(answer(255, 600)), HasSubstr("ignored"));
}

}  // namespace
}  // namespace plchost
