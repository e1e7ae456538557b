#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <string_view>

#include <nlohmann/json.hpp>

#include "api/cli/debug/debug_link.hpp"
#include "api/cli/debug/debug_state.hpp"
#include "shm/base/result.hpp"
#include "shm/base/time.hpp"

namespace plchost {

/// The commands of "plcctl debug": lines from a terminal, a file or a pipe.
class DebugConsole {
 public:
  explicit DebugConsole(DebugLink& link) noexcept : link_(link) {}

  /// Carries out a line; false: it was the last one. Answers and errors are printed.
  bool obey(std::string_view line);
  /// Prints the tasks that have halted since the last call, and the lines of log points. An error: the
  /// session is over.
  [[nodiscard]] Result<void> look();
  /// A command has failed.
  [[nodiscard]] bool failed() const noexcept { return failed_; }

 private:
  void say(const Result<void>& done);
  [[nodiscard]] Result<void> carry_out(std::string_view verb, const std::string& rest);
  [[nodiscard]] Result<void> add_breakpoint(const std::string& rest);
  void has_deleted(const std::string& ids);
  [[nodiscard]] Result<void> list();
  [[nodiscard]] Result<void> tasks();
  [[nodiscard]] Result<void> stack(const std::string& task);
  [[nodiscard]] Result<void> choose_frame(std::string_view verb, const std::string& number);
  [[nodiscard]] Result<void> print(const std::string& name);
  [[nodiscard]] Result<void> set(const std::string& order);
  [[nodiscard]] Result<void> go_on(std::string_view verb, const std::string& rest);
  [[nodiscard]] Result<void> wait(const std::string& seconds);
  void pass_halts_of(const std::string& task);
  [[nodiscard]] Result<void> wait_for_halt(const std::string& task, Duration patience);
  [[nodiscard]] Result<void> choose(const std::string& task);
  [[nodiscard]] Result<std::string> task_or_current(const std::string& named);
  /// The chosen one; an empty object: no task halts. wrong_state: the frame is not told.
  [[nodiscard]] Result<nlohmann::json> current_frame() const;
  [[nodiscard]] Result<void> print_all(const nlohmann::json& frame);
  [[nodiscard]] Result<void> print_variables(const std::string& pattern);
  [[nodiscard]] nlohmann::json current_stack() const;
  void mean(const std::string& task);
  void take(const nlohmann::json& state);

  DebugLink& link_;
  nlohmann::json state_;
  std::string task_;        // that halted last, or was named
  std::int64_t frame_ = 0;  // of its stack
  DebugNews news_;
  std::map<std::string, std::uint64_t>
      passed_;  ///< halts before the last go_on(), and those that ended a wait
  bool failed_ = false;
};

}  // namespace plchost
