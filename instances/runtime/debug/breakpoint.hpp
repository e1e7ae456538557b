#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "instances/runtime/debug/condition.hpp"
#include "instances/runtime/debug/debug_value.hpp"
#include "instances/runtime/debug/declared_pou.hpp"
#include "shm/base/result.hpp"

namespace plchost {

/// Which hits of a breakpoint count: all, one, each n-th, or all from one on.
struct HitRule {
  enum class Kind : std::uint8_t { all, equal, multiple, at_least };
  Kind kind = Kind::all;
  std::uint64_t count = 0;

  /// "=3", "%3", ">=3", or "3", which is ">=3". invalid_argument: says what is allowed.
  [[nodiscard]] static Result<HitRule> parse(std::string_view text);
  /// Real-time.
  [[nodiscard]] bool holds(std::uint64_t hit) const noexcept;
};

/// A breakpoint as a client asks for it:
/// "PLACE [hits RULE] [if CONDITION] [log TEXT]", the parts in this order. A file with blanks in its name
/// stands in quotation marks: "a file.st":7.
struct BreakpointOrder {
  std::string place;  ///< without the marks
  std::string hits = {};
  std::string condition = {};
  std::string log = {};  ///< with "{NAME}" for values; empty: it halts

  [[nodiscard]] static Result<BreakpointOrder> parse(std::string_view text);
};

/// A text with values in it, for the log.
struct LogTemplate {
  static constexpr std::size_t kMaxValues = 8;
  static constexpr std::size_t kMaxValueBytes = 16;

  std::vector<std::string> texts;  ///< one more than values
  std::vector<ValuePlace> values;

  /// invalid_argument, not_found: the text says what is wrong.
  [[nodiscard]] static Result<LogTemplate> parse(std::string_view text, const FindValue& find);
};

/// A hit of a log point, until the control thread writes it down.
struct LogHit {
  std::uint32_t breakpoint = 0;
  std::array<std::array<std::byte, LogTemplate::kMaxValueBytes>, LogTemplate::kMaxValues> values{};
};

/// Never changed once tasks may see it, but for its count.
struct Breakpoint {
  std::uint32_t id = 0;
  PouLine place;
  BreakpointOrder order;
  HitRule hit_rule;
  std::optional<Condition> condition;
  std::optional<LogTemplate> log;
  std::vector<std::string> elsewhere = {};           ///< names in it that are no variables of its POU
  std::shared_ptr<std::atomic<std::uint64_t>> hits;  ///< those whose condition held
};

/// The breakpoints of one moment, for the threads of all tasks. Never changed.
class BreakpointTable {
 public:
  static constexpr std::size_t kMost = 128;

  /// `pous`: how many there are.
  BreakpointTable(std::vector<std::shared_ptr<const Breakpoint>> breakpoints, std::size_t pous);

  /// Those at this statement. Real-time.
  [[nodiscard]] std::span<const std::shared_ptr<const Breakpoint>> at(std::uint32_t pou,
                                                                      std::uint32_t line) const noexcept;

 private:
  std::vector<std::shared_ptr<const Breakpoint>> breakpoints_;  // by POU, then line
  std::vector<std::uint32_t> first_;                            // of each POU; one more at the end
};

}  // namespace plchost
