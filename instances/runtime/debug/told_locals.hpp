#pragma once

#include <algorithm>
#include <cstddef>

#include <nlohmann/json.hpp>

#include "instances/plc_debug.h"
#include "instances/runtime/debug/declared_pou.hpp"

namespace plchost {

/// The characters that a text of JSON may still have. Callers spend at most the characters of their part of
/// it.
class TextBudget {
 public:
  explicit TextBudget(std::size_t most) noexcept : left_(most) {}
  void spend(std::size_t characters) noexcept {
    is_spent_ = is_spent_ || characters > left_;
    left_ -= std::min(characters, left_);
  }
  /// The text is too long already.
  [[nodiscard]] bool is_spent() const noexcept { return is_spent_; }

 private:
  std::size_t left_;
  bool is_spent_ = false;
};

/// The local variables that a call has at its statement, with their values; of each array at most so many
/// elements. It stops as soon as the budget is spent.
[[nodiscard]] nlohmann::json told_locals(const Plc_Frame& frame, const DeclaredPou& pou,
                                         std::size_t most_elements, TextBudget& budget);

}  // namespace plchost
