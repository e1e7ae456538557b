#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <sys/types.h>

#include "shm/base/result.hpp"

namespace plchost::bench {

/// A program that was started; it ends (SIGTERM) and is waited for when this goes.
class Child {
 public:
  Child() noexcept = default;
  Child(Child&& other) noexcept : pid_(std::exchange(other.pid_, 0)) {}
  Child& operator=(Child&& other) noexcept;
  Child(const Child&) = delete;
  Child& operator=(const Child&) = delete;
  ~Child() { end(); }

  /// `arguments[0]` is looked up in PATH unless it has a slash. `output`: where its standard output goes, -1:
  /// where this process's goes. It runs on all cores that this thread may use.
  [[nodiscard]] static Result<Child> start(const std::vector<std::string>& arguments, int output = -1);
  void end() noexcept;
  /// Begins its end: several end at the same time if all are asked before the first end().
  void ask_to_end() const noexcept;
  [[nodiscard]] pid_t pid() const noexcept { return pid_; }
  /// For its end by itself; system: it failed.
  [[nodiscard]] Result<void> wait();

 private:
  explicit Child(pid_t pid) noexcept : pid_(pid) {}
  pid_t pid_ = 0;
};

/// Called by a process that was forked: it gets `signal` when `parent` ends, also if that was so before this
/// call.
void end_with(pid_t parent, int signal) noexcept;

/// A program's standard output, once it has ended. system: it failed.
[[nodiscard]] Result<std::string> output_of(const std::vector<std::string>& arguments);

[[nodiscard]] bool is_installed(const std::string& program);

}  // namespace plchost::bench
