#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <fstream>
#include <string>
#include <vector>

#include <signal.h>
#include <sys/ptrace.h>
#include <sys/user.h>
#include <sys/wait.h>
#include <unistd.h>

namespace plchost {

/// The code that the kernel puts into each process, above all its clock.
class KernelCode {
 public:
  KernelCode() {
    std::ifstream maps("/proc/self/maps");
    for (std::string line; std::getline(maps, line);) {
      if (line.ends_with("[vdso]")) {
        char* rest = nullptr;
        begin_ = std::strtoull(line.c_str(), &rest, 16);
        end_ = std::strtoull(rest + 1, nullptr, 16);
      }
    }
  }
  [[nodiscard]] bool contains(std::uintptr_t address) const noexcept {
    return begin_ <= address && address < end_;
  }

 private:
  std::uintptr_t begin_ = 0;
  std::uintptr_t end_ = 0;
};

/// A child that is led from instruction to instruction by a debugger, until it stops itself by SIGSTOP. It is
/// killed at the end. A read of the kernel's clock is one step: it begins again whenever the kernel sets that
/// clock, which it does between any two steps of a busy machine.
class SteppedChild {
 public:
  /// The address of each instruction, in the order in which they were executed.
  using Trace = std::vector<std::uintptr_t>;

  /// `child` calls ptrace(PTRACE_TRACEME) and stops itself: this waits for that.
  explicit SteppedChild(pid_t child) noexcept : child_(child) { ::waitpid(child_, &status_, 0); }
  SteppedChild(const SteppedChild&) = delete;
  SteppedChild& operator=(const SteppedChild&) = delete;
  ~SteppedChild() {
    ::kill(child_, SIGKILL);
    while (!WIFEXITED(status_) && !WIFSIGNALED(status_) && ::waitpid(child_, &status_, 0) == child_) {
    }
  }

  /// All that is left to be executed.
  [[nodiscard]] Trace run_to_end() {
    Trace trace;
    do {
      trace.push_back(place());
    } while (step());
    return trace;
  }
  /// Leads a child that is at place `from` of `trace` to place `to`. Single steps are slow on a virtual
  /// machine, so it runs to a breakpoint if that is passed seldom. False: the child has ended before, on
  /// another way.
  [[nodiscard]] bool go(const Trace& trace, std::size_t from, std::size_t to) {
    if (from >= to) return true;
    const auto at = [&trace](std::size_t place) {
      return trace.begin() + static_cast<std::ptrdiff_t>(place);
    };
    const auto passed = static_cast<std::size_t>(std::count(at(from), at(to), trace[to]));
    if (kCanBreak && 4 * (passed + 1) < to - from) return run_to(trace[to], passed);
    bool within = true;
    for (; within && from < to; ++from) within = step();
    return within;
  }

 private:
#if defined(__x86_64__)
  static constexpr bool kCanBreak = true;
  static constexpr std::size_t kPlace = offsetof(user, regs.rip);
  static constexpr std::size_t kStack = offsetof(user, regs.rsp);
#else
  static constexpr bool kCanBreak = false;
  static constexpr std::size_t kPlace = 0;
  static constexpr std::size_t kStack = 0;
#endif

  [[nodiscard]] std::uintptr_t place() const noexcept {
    return kCanBreak ? static_cast<std::uintptr_t>(::ptrace(PTRACE_PEEKUSER, child_, kPlace, nullptr)) : 0;
  }
  /// False: the child has ended, or has stopped itself.
  bool go_on(__ptrace_request how) noexcept {
    ::ptrace(how, child_, nullptr, nullptr);
    ::waitpid(child_, &status_, 0);
    return WIFSTOPPED(status_) && WSTOPSIG(status_) == SIGTRAP;
  }
  [[nodiscard]] bool step() noexcept {
    if (!go_on(PTRACE_SINGLESTEP)) return false;
    if (!kCanBreak || !clock_.contains(place())) return true;
    // At the first instruction of the call, the stack holds where it returns to.
    const auto stack = static_cast<std::uintptr_t>(::ptrace(PTRACE_PEEKUSER, child_, kStack, nullptr));
    return run_to(static_cast<std::uintptr_t>(::ptrace(PTRACE_PEEKDATA, child_, stack, nullptr)), 0);
  }
  [[nodiscard]] bool run_to(std::uintptr_t address, std::size_t passed) noexcept {
    constexpr std::uintptr_t kByte = 0xff;
    constexpr std::uintptr_t kBreakpoint = 0xcc;
    const auto code = static_cast<std::uintptr_t>(::ptrace(PTRACE_PEEKTEXT, child_, address, nullptr));
    for (bool within = true; within; --passed) {
      ::ptrace(PTRACE_POKETEXT, child_, address, (code & ~kByte) | kBreakpoint);
      within = go_on(PTRACE_CONT);
      ::ptrace(PTRACE_POKETEXT, child_, address, code);
      if (!within) return false;
      ::ptrace(PTRACE_POKEUSER, child_, kPlace, address);
      if (passed == 0) return true;
      within = step();
    }
    return false;
  }

  pid_t child_;
  int status_ = 0;
  KernelCode clock_;  // the child is a fork, so it has the same addresses
};

}  // namespace plchost
