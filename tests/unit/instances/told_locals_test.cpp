#include "instances/runtime/debug/told_locals.hpp"

#include <array>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "instances/plc_variables.h"

namespace plchost {
namespace {

/// A call of a POU whose local variables all have the same value: scalars and arrays by turns.
class ToldLocals : public testing::Test {
 protected:
  static constexpr std::size_t kLocals = 128;
  static constexpr unsigned kElements = 256;

  void declare(unsigned type, unsigned bytes) {
    for (unsigned i = 0; i < kLocals; ++i) {
      const bool is_array = i % 2 == 1;
      names_.push_back("v" + std::to_string(i) + (is_array ? "[]" : ""));
      if (is_array) arrays_.push_back({i, 1, {{0, kElements, bytes}}});
    }
    for (const std::string& name : names_)
      locals_.push_back({name.c_str(), type, type == PLC_TYPE_STRING ? bytes : 0, 0, 0});
    pou_ = {sizeof(Plc_Pou),
            "A",
            "a.st",
            kLines.data(),
            1,
            0,
            locals_.data(),
            kLocals,
            arrays_.data(),
            static_cast<unsigned>(arrays_.size())};
    ASSERT_EQ(pous_.declare(&pou_), ERR_OK);
    memory_.resize(std::size_t{kElements} * bytes);
    addresses_.assign(kLocals, memory_.data());
  }
  nlohmann::json told(std::size_t most_elements, TextBudget& budget) {
    const Plc_Frame frame{&pou_, nullptr, 1, 0, nullptr, addresses_.data(), 0, kLocals};
    return told_locals(frame, pous_.pous().front(), most_elements, budget);
  }
  bool fit(std::size_t most_elements, std::size_t characters) {
    TextBudget budget(characters);
    (void)told(most_elements, budget);
    return !budget.is_spent();
  }

  static constexpr std::array kLines = {1U};
  std::vector<std::string> names_;
  std::vector<Plc_Local> locals_;
  std::vector<Plc_LocalArray> arrays_;
  std::vector<std::byte> memory_;
  std::vector<void*> addresses_;
  Plc_Pou pou_{};
  PouCollection pous_;
};

// The control thread makes the state again and again.
TEST_F(ToldLocals, AreNotMadeAnyMoreWhenTheirTextCannotFit) {
  ASSERT_NO_FATAL_FAILURE(declare(PLC_TYPE_INT, 2));
  TextBudget budget(3'000);
  const std::string text = told(kElements, budget).dump();
  EXPECT_TRUE(budget.is_spent());
  EXPECT_GT(text.size(), 3'000U);
  EXPECT_LT(text.size(), 3'200U) << "all are more than 60,000";
}

TEST_F(ToldLocals, AreMadeIfTheirTextFits) {
  ASSERT_NO_FATAL_FAILURE(declare(PLC_TYPE_INT, 2));
  for (const std::size_t most : {0U, 1U, 16U, 256U}) {
    TextBudget enough(1U << 20U);
    const std::string text = told(most, enough).dump();
    EXPECT_FALSE(enough.is_spent());
    EXPECT_TRUE(fit(most, text.size())) << most;
    EXPECT_FALSE(fit(most, text.size() * 9 / 10)) << most;
  }
}

// Bytes that are no text are written as longer ones.
TEST_F(ToldLocals, AreMadeAlsoIfTheyAreNoText) {
  ASSERT_NO_FATAL_FAILURE(declare(PLC_TYPE_STRING, 4));
  for (const auto& bytes : {std::array{0xF0, 0x9F, 0x98}, {'"', '\\', '\n'}, {0xFF, 'a', 0xC3}, {0, 0, 0}}) {
    for (std::size_t i = 0; i < memory_.size(); ++i)
      memory_[i] = static_cast<std::byte>(i % 4 == 3 ? 0 : bytes.at(i % 4));
    TextBudget enough(1U << 24U);
    const auto whole = told(kElements, enough);
    const std::string text = whole.dump(-1, ' ', true, nlohmann::json::error_handler_t::replace);
    EXPECT_TRUE(fit(kElements, text.size())) << text.substr(0, 80);
  }
}

}  // namespace
}  // namespace plchost
