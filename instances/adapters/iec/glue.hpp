#pragma once

#include <cstddef>
#include <functional>
#include <iterator>
#include <map>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "instances/adapters/iec/compiler.hpp"
#include "instances/adapters/iec/copies.hpp"
#include "instances/adapters/iec/place.hpp"
#include "instances/adapters/iec/project.hpp"
#include "instances/adapters/iec/task_plan.hpp"
#include "instances/adapters/iec/variables.hpp"

namespace plchost::iec {

/// The file between the output of a compiler and the C files of each application (plchost_adapter.h).
struct Glue {
  std::string text;
  SourceProblems problems;  ///< the application cannot be built
  SourceProblems remarks;   ///< it can, and does something that its author may not expect
};

/// Writes that file for one resource. The classes that derive from it know one compiler each.
class GlueWriter {
 public:
  GlueWriter(const GlueWriter&) = delete;
  GlueWriter& operator=(const GlueWriter&) = delete;
  virtual ~GlueWriter() = default;

  Glue write();

 protected:
  GlueWriter(const Project& project, const Configuration& configuration, const Resource& resource,
             Compiler compiler);

  /// A located variable.
  struct Known {
    std::string name;      ///< that an online change knows it by
    std::string value;     ///< where its value lies, for `&` in C
    std::string location;  ///< as in the source: %IX0.0
    Place place;
    std::set<std::size_t> tasks{};  ///< that use it
    bool aliased = false;           ///< another one has some of its bits
  };

  /// Includes, and what the compiler's output needs. After find_places().
  virtual void write_head() = 0;
  /// Fills places().
  virtual void find_places() = 0;
  /// Their storage, if it is not in the compiler's output.
  virtual void write_storage() {}
  /// A statement.
  [[nodiscard]] virtual std::string call(const Program& program) const = 0;
  /// The parts of a copy of a global, with its number: plchost_copy_3 and plchost_before_3.
  struct CopyText {
    std::string storage;            ///< the definitions of both
    std::string value;              ///< the one with the value, for `&` and sizeof
    std::string piece;              ///< sizeof of what is exchanged at a time
    std::string locked = "0";       ///< see plchost_copy
    std::string global;             ///< the address of the global
    std::string_view external_end;  ///< behind each VAR_EXTERNAL: the pointer in it
  };
  [[nodiscard]] virtual CopyText copy(const CopiedGlobal& global, std::size_t number) const = 0;
  /// Statements of plchost_bind(): the programs with copies use them.
  void write_copy_bindings();
  /// The value of a global that is no memory place, as an expression.
  [[nodiscard]] virtual std::string global(const std::string& name) const = 0;
  /// Adds with `add(place, value)` the inputs that the task exchanges with variables of its own, and returns
  /// the places that it then does not exchange itself.
  using AddUse = std::function<void(std::size_t, const std::string&)>;
  virtual std::set<Place> write_own_inputs(std::size_t /*task*/, const AddUse& /*add*/) { return {}; }
  /// The function plchost_each_symbol(): the variables that can be seen from outside. None: the compiler's
  /// output does not tell where they lie.
  virtual void write_symbols();
  /// The last function of the file: plchost_bind().
  virtual void write_binding() = 0;

  template <class... Values>
  void print(fmt::format_string<Values...> format, Values&&... values) {
    fmt::format_to(std::back_inserter(text_), format, std::forward<Values>(values)...);
  }

  [[nodiscard]] const Project& project() const noexcept { return project_; }
  [[nodiscard]] const Configuration& configuration() const noexcept { return configuration_; }
  [[nodiscard]] const Resource& resource() const noexcept { return resource_; }
  [[nodiscard]] TaskPlan& plan() noexcept { return plan_; }
  [[nodiscard]] const TaskPlan& plan() const noexcept { return plan_; }
  [[nodiscard]] std::vector<Known>& places() noexcept { return places_; }
  /// Places that share bits, and are one memory within a task, by plchost_assign().
  [[nodiscard]] bool has_shared_bits() const;
  /// Of a global that is located; else one of no area.
  [[nodiscard]] Place place_or_none(const Variable& variable) const;

 private:
  void find_copies();
  void write_copies();
  void write_call(const Program& program);
  void write_places();
  void write_locations();
  void find_aliases();
  void refuse_shared_bits();
  [[nodiscard]] bool shares_bits(std::size_t task) const { return !rings_[task].empty(); }
  void find_rings();
  void name_shared_memory();
  void write_task(const PlannedTask& task, std::size_t number);
  void write_edge(const PlannedTask& task, std::size_t number);
  std::size_t write_uses(std::size_t number);
  [[nodiscard]] std::vector<std::size_t> exchanged_by(std::size_t task) const;
  void number_retained();
  [[nodiscard]] std::vector<std::size_t> retained_by(std::size_t task) const;
  void write_options(const TaskOptions& options, std::size_t number);
  void write_tasks();
  void write_programs();
  void write_variables();

  struct CopyRange {
    std::size_t first = 0;
    std::size_t count = 0;
  };

  const Project& project_;
  const Configuration& configuration_;
  const Resource& resource_;
  Compiler compiler_;
  TaskPlan plan_;
  ProgramVariables variables_;
  std::vector<CopiedGlobal> copies_;
  std::map<const Program*, CopyRange> copies_of_programs_;
  std::vector<Known> places_;
  std::vector<std::vector<std::size_t>> groups_;  // of places that share bits
  // For each task the outputs and the memory that share bits within it, the widest places first. Each has the
  // next one of those that share its bits, a ring.
  std::vector<std::vector<std::pair<std::size_t, std::size_t>>> rings_;
  std::vector<std::size_t> use_counts_;
  std::vector<std::size_t> retained_number_;  // for each variable, if it is retained
  std::string text_;
};

}  // namespace plchost::iec
