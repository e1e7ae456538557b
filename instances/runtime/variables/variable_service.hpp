#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "instances/runtime/variables/declared_variable.hpp"
#include "instances/runtime/variables/force_list.hpp"
#include "instances/runtime/variables/forces.hpp"
#include "instances/runtime/variables/variable_access.hpp"
#include "shm/base/result.hpp"
#include "shm/variables/symbol_page.hpp"
#include "shm/variables/value_message.hpp"

namespace plchost {

/// Which values a request asks for, and where they lie. Valid as long as the version of the application.
struct SamplePlan {
  std::vector<std::span<const std::byte>> sources;
  std::size_t bytes = 0;  ///< of all of them
};

/// A change of values or forces that waits for a moment between all cycles. Valid as long as the version of
/// the application, and as no other one was made.
struct VariableOrder {
  enum class Kind : std::uint8_t { write, force, unforce };
  Kind kind = Kind::write;
  std::vector<VariableElement> elements;  ///< one; unforce: any number
  Forces::Value value;                    ///< empty: unforce
  Forces::Value before;                   ///< of a write and a force: the value as make() found it
  Forces forces;                          ///< as they are afterwards
  std::vector<ForceList> lists;           ///< the same, for each task
};

/// The variables of the application that runs: their table, their values, their forces. Control thread; the
/// tasks use the slots only. "Between all cycles" is a moment in which no task is within a cycle.
class VariableService {
 public:
  /// At the first load: the slots are there for as long as this object.
  void place(std::vector<DeclaredVariable> variables, std::vector<std::string> tasks);
  /// One for each task; empty before place().
  [[nodiscard]] std::span<const ForceSlot> slots() const noexcept { return slots_; }

  /// Another version, ready to take over.
  struct Next {
    VariableAccess access{{}};
    Forces forces;
    std::vector<ForceList> lists;
    std::vector<std::string> ended;  ///< names of the forces that do not go on
  };
  [[nodiscard]] Next prepare(std::vector<DeclaredVariable> variables) const;
  /// Between all cycles. `next` has the version before afterwards.
  void take_over(Next& next) noexcept;

  /// Shows the table of the version that runs to other processes, or none if it has no variables. After an
  /// error there is none. Set-up.
  [[nodiscard]] Result<void> publish(const std::string& pool, const std::string& instance);
  /// 0: there is no table.
  [[nodiscard]] std::uint64_t stream() const noexcept { return page_ ? page_->stream() : 0; }
  [[nodiscard]] std::size_t count() const noexcept { return access_.symbols().size(); }
  [[nodiscard]] const Forces& forces() const noexcept { return forces_; }
  [[nodiscard]] const VariableAccess& access() const noexcept { return access_; }
  /// "Main.speed, Line.count and 7 more"
  [[nodiscard]] std::string forced_names() const;

  /// The places of the values that a request names. wrong_state, not_found, full: as ValueReply.
  [[nodiscard]] Result<SamplePlan> plan(const ValueRequest& request) const;
  /// Copies the values, one behind the other.
  static void copy(const SamplePlan& plan, std::span<std::byte> values) noexcept;
  /// Of a request of the kind `forced`: the whole reply but its number.
  [[nodiscard]] ValueReply forced_values() const;
  /// For each element 1 if it is forced.
  [[nodiscard]] std::vector<std::uint8_t> marks(std::span<const VariableElement> elements) const;

  /// "NAME=VALUE"; of unforce "NAME", or "*" for all. The error names the variable, and what is allowed.
  [[nodiscard]] Result<VariableOrder> order(VariableOrder::Kind kind, std::string_view argument) const;
  /// Between all cycles.
  void make(VariableOrder& order) noexcept;
  /// For the log and the client: "'Main.speed' is written: 5 -> 7".
  [[nodiscard]] std::string describe(const VariableOrder& order) const;

 private:
  [[nodiscard]] Result<VariableElement> writable(std::string_view name) const;
  void use(std::vector<ForceList>& lists) noexcept;

  VariableAccess access_{{}};
  std::vector<std::string> tasks_;
  Forces forces_;
  std::vector<ForceList> lists_;
  std::vector<ForceSlot> slots_;
  std::optional<SymbolPage> page_;
};

}  // namespace plchost
