#pragma once

#include <array>
#include <csignal>
#include <cstdint>

#include <ucontext.h>

namespace plchost {

/// The signals by which code ends that has a fault.
inline constexpr std::array kFaultSignals = {SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGTRAP, SIGABRT};

/// The address of the instruction that a signal came in; 0: it is not known on this processor. Signal
/// context.
[[nodiscard]] inline std::uintptr_t instruction_of(const ucontext_t& context) noexcept {
#if defined(__x86_64__)
  return static_cast<std::uintptr_t>(context.uc_mcontext.gregs[REG_RIP]);
#elif defined(__aarch64__)
  return context.uc_mcontext.pc;
#else
  (void)context;
  return 0;
#endif
}

}  // namespace plchost
