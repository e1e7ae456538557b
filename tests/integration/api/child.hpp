#pragma once

#include <csignal>
#include <string>
#include <utility>
#include <vector>

#include <sys/types.h>

namespace plchost {

/// A child process of a test: killed at the end, if it is still there.
class Child {
 public:
  /// Output goes to `output_file`, or where the test's goes if that is empty.
  Child(const std::string& program, const std::vector<std::string>& arguments,
        const std::string& output_file = "");
  Child(Child&& other) noexcept : pid_(std::exchange(other.pid_, 0)) {}
  Child& operator=(Child&& other) noexcept {
    std::swap(pid_, other.pid_);
    return *this;
  }
  Child(const Child&) = delete;
  Child& operator=(const Child&) = delete;
  ~Child();

  [[nodiscard]] pid_t pid() const { return pid_; }
  void signal(int number) const { ::kill(pid_, number); }
  /// Waits for its end. Exit code, or 128 + signal.
  int wait();

 private:
  pid_t pid_ = 0;
};

struct RunResult {
  int code = -1;
  std::string output;  ///< standard output
  std::string errors;  ///< standard error
};

/// Runs a program and waits for its end.
RunResult run_program(const std::string& program, const std::vector<std::string>& arguments);
/// Runs plcctl in a domain and waits for its end.
RunResult run_plcctl(std::uint32_t domain, std::vector<std::string> arguments);

}  // namespace plchost
