#pragma once

#include <cstddef>
#include <cstdint>
#include <string_view>
#include <vector>

#include "instances/runtime/debug/debug_value.hpp"
#include "shm/base/result.hpp"

namespace plchost {

/// A condition over variables: comparisons (=, <>, <, <=, >, >=) of a variable with a value or with another
/// variable, variables of the type BOOL, NOT, AND, OR and parentheses. Made by the control thread, and never
/// changed.
class Condition {
 public:
  static constexpr std::size_t kMaxText = 200;
  static constexpr std::size_t kMaxDepth = 16;  ///< of parentheses and NOT

  /// invalid_argument, not_found: the text says what is wrong, and what is allowed.
  [[nodiscard]] static Result<Condition> parse(std::string_view text, const FindValue& find);

  /// In this frame. Real-time.
  [[nodiscard]] bool holds(const Plc_Frame& frame) const noexcept;

 private:
  friend class ConditionParser;
  enum class Kind : std::uint8_t { truth, compare, invert, both, either };
  enum class Relation : std::uint8_t { equal, unequal, less, at_most, greater, at_least };
  /// Takes its operands off a stack and puts its result there.
  struct Step {
    Kind kind{};
    Relation relation{};
    bool with_variable = false;
    ValuePlace left = {};
    ValuePlace right = {};
    DebugNumber value = 0;
  };
  [[nodiscard]] static bool compare(const Step& step, const Plc_Frame& frame) noexcept;

  std::vector<Step> steps_;
};

}  // namespace plchost
