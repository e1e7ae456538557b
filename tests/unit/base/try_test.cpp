#include <array>
#include <memory>

#include <gmock/gmock.h>

#include "shm/base/result.hpp"

namespace plchost {
namespace {

template <class T>
Result<T> fail() {
  return failure(ErrorCode::busy, "three are there", 11);
}

// Of another type than the calls in it, as most functions are.
template <class Body>
Result<std::string> run(Body body) {
  return body();
}

void expect_unchanged(const Result<std::string>& sut) {
  ASSERT_FALSE(sut);
  EXPECT_EQ(sut.error().code, ErrorCode::busy);
  EXPECT_EQ(sut.error().message, "three are there");
  EXPECT_EQ(sut.error().system_errno, 11);
}

TEST(Try, ReturnsTheErrorUnchanged) {
  expect_unchanged(run([]() -> Result<std::string> {
    PLCHOST_TRY(fail<void>());
    return "it went on";
  }));
  expect_unchanged(run([]() -> Result<std::string> {
    PLCHOST_TRY_ASSIGN(const auto number, fail<int>());
    return std::to_string(number);
  }));
}

TEST(Try, GoesOnBehindASuccess) {
  const auto sut = run([]() -> Result<std::string> {
    PLCHOST_TRY(Result<void>());
    PLCHOST_TRY(Result<std::array<int, 2>>({1, 2}));
    PLCHOST_TRY_ASSIGN(const auto number, Result<int>(3));
    PLCHOST_TRY_ASSIGN(auto other, Result<int>(4));
    other += number;
    return std::to_string(other);
  });
  EXPECT_EQ(sut, "7");
}

TEST(Try, EvaluatesTheCallOnce) {
  int calls = 0;
  const auto sut = run([&]() -> Result<std::string> {
    PLCHOST_TRY(Result<int>(++calls));
    PLCHOST_TRY_ASSIGN(const int number, Result<int>(++calls));
    return std::to_string(number);
  });
  EXPECT_EQ(sut, "2");
  EXPECT_EQ(calls, 2);
}

TEST(Try, MovesTheValue) {
  std::unique_ptr<int> given;
  const auto sut = run([&]() -> Result<std::string> {
    PLCHOST_TRY_ASSIGN(given, Result<std::unique_ptr<int>>(std::make_unique<int>(8)));
    PLCHOST_TRY_ASSIGN(const auto other, Result<std::unique_ptr<int>>(std::make_unique<int>(9)));
    return std::to_string(*given) + std::to_string(*other);
  });
  EXPECT_EQ(sut, "89");
}

TEST(Try, MovesTheErrorOfACall) {
  struct Moved {
    std::unique_ptr<int> only;
  };
  const auto failing = [] { return std::expected<void, Moved>(std::unexpect, std::make_unique<int>(5)); };
  const auto pass_on = [&]() -> std::expected<std::string, Moved> {
    PLCHOST_TRY(failing());
    return "it went on";
  };
  const auto sut = pass_on();
  ASSERT_FALSE(sut);
  EXPECT_EQ(*sut.error().only, 5);
}

TEST(Try, LeavesAVariablesErrorInIt) {
  const auto kept = fail<int>();
  auto changeable = fail<int>();
  expect_unchanged(run([&]() -> Result<std::string> {
    PLCHOST_TRY(kept);
    return "it went on";
  }));
  expect_unchanged(run([&]() -> Result<std::string> {
    PLCHOST_TRY_ASSIGN(const auto number, changeable);
    return std::to_string(number);
  }));
  EXPECT_EQ(kept.error().message, "three are there");
  EXPECT_EQ(changeable.error().message, "three are there");
}

TEST(Try, PutsTheStepBeforeTheError) {
  const auto sut = run([]() -> Result<std::string> {
    PLCHOST_TRY_ASSIGN(const auto number, in_step("counting", Result<int>(3)));
    PLCHOST_TRY(in_step(std::to_string(number) + " of them", fail<void>()));
    return "it went on";
  });
  ASSERT_FALSE(sut);
  EXPECT_EQ(sut.error().code, ErrorCode::busy);
  EXPECT_EQ(sut.error().message, "3 of them: three are there");
  EXPECT_EQ(sut.error().system_errno, 11);
}

TEST(AndThen, IsTheResultOfTheNextCallOrTheFailure) {
  int calls = 0;
  const auto text_of = [&](int number) -> Result<std::string> {
    ++calls;
    return std::to_string(number);
  };
  EXPECT_EQ(and_then(Result<int>(3), text_of), "3");
  expect_unchanged(and_then(fail<int>(), text_of));
  expect_unchanged(and_then(fail<void>(), [&] { return text_of(4); }));
  EXPECT_EQ(and_then(Result<void>(), [&] { return text_of(5); }), "5");
  EXPECT_EQ(calls, 2);
  const Result<std::unique_ptr<int>> kept(std::make_unique<int>(6));
  EXPECT_EQ(and_then(kept, [&](const auto& of) { return text_of(*of); }), "6") << "not copied";
}

TEST(Try, GoesOnWithoutWhatNeedNotBeThere) {
  const auto missing = [] { return failure(ErrorCode::not_found, "no such file"); };
  const auto sut = run([&]() -> Result<std::string> {
    PLCHOST_TRY_ASSIGN(const auto none, if_found(Result<int>(missing())));
    PLCHOST_TRY_ASSIGN(const auto number, if_found(Result<int>(3)));
    PLCHOST_TRY_ASSIGN(const bool gone, if_found(Result<void>(missing())));
    PLCHOST_TRY_ASSIGN(const bool there, if_found(Result<void>()));
    EXPECT_FALSE(none);
    EXPECT_FALSE(gone);
    EXPECT_TRUE(there);
    return std::to_string(number.value());
  });
  EXPECT_EQ(sut, "3");
  expect_unchanged(run([]() -> Result<std::string> {
    PLCHOST_TRY_ASSIGN(const auto none, if_found(fail<int>()));
    return none ? "it was there" : "it was not there";
  }));
  expect_unchanged(run([]() -> Result<std::string> {
    PLCHOST_TRY(if_found(fail<void>()));
    return "it went on";
  }));
}

// Without braces it is one statement: the `else` is that of the `if` in the text.
TEST(Try, IsOneStatement) {
  const auto sut = [](bool first) -> Result<std::string> {
    if (first)
      PLCHOST_TRY(Result<void>());
    else
      PLCHOST_TRY(fail<void>());
    return "it went on";
  };
  EXPECT_EQ(sut(true), "it went on");
  expect_unchanged(sut(false));
}

TEST(Try, ContainsAnother) {
  const auto each = [](auto body) { return body(); };
  expect_unchanged(run([&]() -> Result<std::string> {
    PLCHOST_TRY(each([]() -> Result<void> {
      PLCHOST_TRY(fail<int>());
      return {};
    }));
    return "it went on";
  }));
  expect_unchanged(run([&]() -> Result<std::string> {
    PLCHOST_TRY_ASSIGN(const auto number, each([]() -> Result<int> {
                         PLCHOST_TRY_ASSIGN(const auto inner, fail<int>());
                         return inner;
                       }));
    return std::to_string(number);
  }));
}

}  // namespace
}  // namespace plchost
