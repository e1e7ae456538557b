#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "instances/runtime/debug/breakpoint.hpp"
#include "instances/runtime/debug/debug_task.hpp"
#include "instances/runtime/debug/declared_pou.hpp"
#include "instances/runtime/variables/variable_access.hpp"
#include "schedulers/task_set.hpp"
#include "shm/base/result.hpp"
#include "shm/base/time.hpp"
#include "shm/base/unique_fd.hpp"

namespace plchost {

class TextBudget;

// The debugging of an application
// ===============================
//
// One debugger at a time has the session. It sets breakpoints and lets tasks go, by commands with the number
// of its session. It is there as long as it asks for the state: when it does not for kLease, or leaves, its
// breakpoints go and all tasks go on.
//
// A task that halts stands still in the middle of its cycle (Task::stand_still). All other tasks run, or halt
// at their next statements if the session says so. Breakpoints are exchanged while tasks run: a task says
// which table it looks at, and the control thread keeps that one until no task does.
//
// suspend() lets all go and keeps any from halting. A stop, an exception, and an exchange of the scheduler or
// of the application call it. resume() puts the breakpoints in again, as far as their places are still there.

/// Control thread, unless said otherwise.
class DebugService {
 public:
  static constexpr Duration kLease = std::chrono::seconds(10);
  /// Frames that are told of each task, and lines of log points.
  static constexpr std::size_t kMostFrames = 32;
  static constexpr std::size_t kLogKept = 32;
  /// Elements that are told of each array among local variables; of a state that is too long fewer.
  static constexpr std::size_t kMostElements = 256;
  /// How much of a stack is told.
  struct StackDetail {
    std::size_t frames = 0;
    std::size_t with_locals = 0;  ///< the innermost, of those
    std::size_t elements = 0;     ///< of each array among them
  };

  /// The application that runs, and the names of its tasks; all outlive this object. Not for one that
  /// declares no POU: then nothing else is called.
  struct Program {
    TaskSet* tasks = nullptr;
    std::function<const PouCollection&()> pous;
    std::function<const VariableAccess&()> variables;
    std::function<void()> before_go;  ///< tasks are about to go on: halts() says so already
  };
  [[nodiscard]] Result<void> attach(Program program);
  /// The application is a debug build, and its tasks are there.
  [[nodiscard]] bool attached() const noexcept { return !tasks_.empty(); }
  /// Readable when a task has halted; -1: not attached.
  [[nodiscard]] int fd() const noexcept { return event_.get(); }

  /// "attach", "attach take", or "SESSION COMMAND": see instances/debugging.md. The answer is an object of
  /// JSON. wrong_state: the session is another one's, or none; the text says which.
  [[nodiscard]] Result<std::string> obey(std::string_view command, TimePoint now);
  /// The debugger with this session was there at that time.
  void seen(std::uint64_t session, TimePoint when) noexcept;
  /// Looks for tasks that have halted, hits of log points, and the end of the lease.
  void advance(TimePoint now);
  /// advance() has something to do soon.
  [[nodiscard]] bool has_work() const noexcept { return session_ != 0; }

  /// How many tasks were let go.
  std::size_t suspend(std::string_view why);
  void resume(std::string_view scheduler);
  [[nodiscard]] std::size_t halted() const noexcept;
  /// The task with this number halts.
  [[nodiscard]] bool halts(std::size_t task) const noexcept {
    return task < tasks_.size() && tasks_[task]->halt().has_value();
  }
  /// All that halted have been let go, and none halts until resume().
  [[nodiscard]] bool suspended() const noexcept { return suspended_; }
  /// An object of JSON with all that a debugger shows, at most `most` bytes.
  [[nodiscard]] std::string state(std::size_t most) const;

  /// Of the task with this number. Real-time.
  [[nodiscard]] DebugTask* task(std::size_t number) noexcept {
    return number < tasks_.size() ? tasks_[number].get() : nullptr;
  }

 private:
  using Breakpoints = std::vector<std::shared_ptr<const Breakpoint>>;

  [[nodiscard]] Result<std::string> begin_session(bool take, TimePoint now);
  [[nodiscard]] Result<std::string> carry_out(std::string_view verb, std::string_view rest);
  [[nodiscard]] Result<std::string> add_breakpoint(std::string_view text);
  [[nodiscard]] Result<std::string> remove_breakpoints(std::string_view id);
  [[nodiscard]] Result<std::string> go_on(std::string_view verb, std::string_view rest);
  [[nodiscard]] Result<std::string> pause(std::string_view task);
  [[nodiscard]] Result<StepRule> rule_of(std::string_view verb, std::string_view place,
                                         const DebugTask::Halt& halt) const;
  [[nodiscard]] Result<std::vector<std::size_t>> tasks_named(std::string_view name) const;
  [[nodiscard]] Result<Breakpoint> resolve(std::uint32_t id, BreakpointOrder order) const;
  /// Nothing: the POU has no variable of that name.
  [[nodiscard]] Result<std::optional<ValuePlace>> find_own_value(std::uint32_t pou,
                                                                 std::string_view name) const;
  /// Nothing: there is no local variable of that name at that statement.
  [[nodiscard]] Result<std::optional<ValuePlace>> find_local_value(PouLine place,
                                                                   std::string_view name) const;
  [[nodiscard]] ValuePlace place_of(VariableElement element) const;
  /// "TASK FRAME NAME=VALUE"
  [[nodiscard]] Result<std::string> write_local(std::string_view order);
  /// Of a task that halts; 0: where it halts.
  [[nodiscard]] Result<const Plc_Frame*> frame_of(std::string_view task, std::string_view number) const;
  [[nodiscard]] std::string_view state_text(const DebugTask& task, bool halted) const noexcept;
  [[nodiscard]] nlohmann::json state_of_task(std::size_t number, StackDetail detail,
                                             TextBudget& budget) const;
  [[nodiscard]] std::string remark() const;
  [[nodiscard]] std::string remark_of(const Breakpoint& breakpoint) const;
  void end_session(std::string_view why);
  /// Task and rule of each.
  void let_go(std::span<const std::pair<std::size_t, StepRule>> tasks);
  void let_all_go();
  void publish(Breakpoints breakpoints);
  void collect();
  void arm() noexcept;
  void take_logs();
  void write_log(const LogHit& hit, std::string_view task);
  [[nodiscard]] const std::string& name_of(std::size_t task) const {
    return program_.tasks->task(task).config().name;
  }

  Program program_;
  UniqueFd event_;
  DebugBoard board_;
  std::vector<std::unique_ptr<DebugTask>> tasks_;
  std::vector<std::uint64_t> told_halts_;  // of each task
  std::string scheduler_;
  std::uint64_t session_ = 0;  // 0: none
  std::uint64_t last_session_ = 0;
  TimePoint seen_;
  bool suspended_ = true;
  bool halt_all_ = false;
  std::uint32_t next_id_ = 1;
  Breakpoints breakpoints_;
  std::unique_ptr<const BreakpointTable> table_;
  std::vector<std::unique_ptr<const BreakpointTable>> retired_;
  Breakpoints removed_;  // log points may still have hits that are not written
  struct LogLine {
    std::uint64_t number = 0;
    std::string text;
  };
  std::deque<LogLine> log_;
  std::uint64_t log_number_ = 0;
};

}  // namespace plchost
