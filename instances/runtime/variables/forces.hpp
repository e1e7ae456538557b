#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "instances/runtime/variables/force_list.hpp"
#include "instances/runtime/variables/variable_access.hpp"
#include "shm/base/result.hpp"
#include "shm/variables/variable_symbol.hpp"

namespace plchost {

/// The forced elements of the variables of one version, with their values. Control thread.
class Forces {
 public:
  using Value = std::vector<std::byte>;
  /// As many, and with as many bytes in all, as a ValueReply has room for.
  static constexpr std::size_t kMost = 1024;

  [[nodiscard]] std::size_t size() const noexcept { return values_.size(); }
  /// Null: the element is not forced.
  [[nodiscard]] const Value* find(VariableElement element) const noexcept;
  /// Forces it, or forces it to another value. full: there are too many.
  [[nodiscard]] Result<void> set(VariableElement element, Value value);
  /// False: it was not forced.
  bool erase(VariableElement element);
  void clear() { values_.clear(); }

  /// Calls `with(element, value)` in the order of the table.
  template <class With>
  void for_each(With with) const {
    for (const auto& [key, value] : values_) with(VariableElement{key.first, key.second}, value);
  }

  /// The list of each task: its own variables, and those of no task.
  [[nodiscard]] std::vector<ForceList> lists(const VariableAccess& access,
                                             std::span<const std::string> tasks) const;

  /// Those that go on under another version: their variables are there with the same type and can be written.
  /// The names of the others go to `ended`.
  [[nodiscard]] Forces carried(const VariableAccess& from, const VariableAccess& to,
                               std::vector<std::string>& ended) const;

 private:
  std::map<std::pair<std::uint32_t, std::uint32_t>, Value> values_;
};

}  // namespace plchost
