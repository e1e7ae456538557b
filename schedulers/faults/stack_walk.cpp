#include "schedulers/faults/stack_walk.hpp"

#include <atomic>
#include <csetjmp>
#include <csignal>
#include <exception>

#include <cxxabi.h>
#include <unwind.h>

#include "schedulers/faults/fault_trap.hpp"

namespace plchost {

namespace {

struct Walk {
  BackTrace* trace;
  std::uintptr_t first;   // the address that the walk begins at: above it are the functions of the handler
  std::uintptr_t bottom;  // of the stack of the code
  std::uintptr_t stack = 0;
  bool begun = false;
  bool thrown = false;  // the function that throws was met
};

// Where a fault of the walk ends it; null: this thread is in none.
constinit thread_local sigjmp_buf* way_out = nullptr;

_Unwind_Reason_Code end_with(const Walk& walk, BackTrace::End end) noexcept {
  walk.trace->end = end;
  return _URC_NORMAL_STOP;
}

void add(BackTrace& trace, std::uintptr_t address) noexcept {
  trace.addresses[trace.count] = address;
  ++trace.count;
}

_Unwind_Reason_Code on_function(_Unwind_Context* function, void* argument) {
  Walk& walk = *static_cast<Walk*>(argument);
  const std::uintptr_t address = _Unwind_GetIP(function);
  const std::uintptr_t stack = _Unwind_GetCFA(function);
  if (!walk.begun) {
    if (address != walk.first) return _URC_NO_REASON;
    walk.begun = true;
  } else {
    if (stack >= walk.bottom) return end_with(walk, BackTrace::End::whole);
    if (address == 0 || stack < walk.stack) return end_with(walk, BackTrace::End::lost);
    if (walk.trace->count == BackTrace::kMost) return end_with(walk, BackTrace::End::deep);
  }
  walk.stack = stack;
  add(*walk.trace, address);
  return _URC_NO_REASON;
}

// The registers as they are right behind the call of a function; false: not known on this processor.
bool return_to(ucontext_t& context, std::uintptr_t caller) noexcept {
#if defined(__x86_64__)
  constexpr greg_t kPushed = sizeof caller;
  context.uc_mcontext.gregs[REG_RIP] = static_cast<greg_t>(caller);
  context.uc_mcontext.gregs[REG_RSP] += kPushed;
  return true;
#elif defined(__aarch64__)
  context.uc_mcontext.pc = caller;
  return true;
#else
  (void)context;
  (void)caller;
  return false;
#endif
}

void let_faults_come(bool come) noexcept {
  sigset_t faults;
  ::sigemptyset(&faults);
  ::sigaddset(&faults, SIGSEGV);
  ::sigaddset(&faults, SIGBUS);
  ::pthread_sigmask(come ? SIG_UNBLOCK : SIG_BLOCK, &faults, nullptr);
}

// In a function of its own: no variable here is changed between the two returns of sigsetjmp.
void walk_guarded(Walk& walk) noexcept {
  sigjmp_buf out;
  if (sigsetjmp(out, 0) == 0) {
    way_out = &out;
    std::atomic_signal_fence(std::memory_order_seq_cst);
    let_faults_come(true);
    _Unwind_Backtrace(on_function, &walk);
  } else {
    walk.trace->end = BackTrace::End::damaged;
  }
  let_faults_come(false);
  std::atomic_signal_fence(std::memory_order_seq_cst);
  way_out = nullptr;
}

bool throws(_Unwind_Context* function) noexcept {
  const std::uintptr_t begin = _Unwind_GetRegionStart(function);
  const auto is = [begin](auto* address) { return reinterpret_cast<std::uintptr_t>(address) == begin; };
  return is(&_Unwind_RaiseException) || is(&_Unwind_Resume_or_Rethrow) || is(&abi::__cxa_throw) ||
         is(&abi::__cxa_rethrow) || is(&std::rethrow_exception);
}

// The search for the handler has just come the same way, so all that is read can be read. The
// functions before are those of that search.
_Unwind_Reason_Code on_thrower(_Unwind_Context* function, void* argument) {
  Walk& walk = *static_cast<Walk*>(argument);
  if (throws(function)) {
    walk.thrown = true;
    walk.trace->count = 0;
    return _URC_NO_REASON;
  }
  if (_Unwind_GetCFA(function) >= walk.bottom) return end_with(walk, BackTrace::End::whole);
  if (walk.trace->count == BackTrace::kMost) return end_with(walk, BackTrace::End::deep);
  add(*walk.trace, _Unwind_GetIP(function));
  return _URC_NO_REASON;
}

_Unwind_Reason_Code look_at_one(_Unwind_Context* function, void* found) {
  *static_cast<std::uintptr_t*>(found) = _Unwind_GetIP(function) + _Unwind_GetCFA(function);
  return _URC_NORMAL_STOP;
}

}  // namespace

// The first call of each binds it, and fills tables of the unwinder.
void StackWalk::prepare() noexcept {
  std::uintptr_t found = 0;
  _Unwind_Backtrace(look_at_one, &found);
}

void StackWalk::walk(BackTrace& into, ucontext_t& context, std::uintptr_t bottom,
                     std::uintptr_t caller) noexcept {
  const std::uintptr_t address = instruction_of(context);
  if (address == 0 && caller == 0) return;
  into.end = BackTrace::End::lost;
  if (caller == 0) {
    Walk walk{.trace = &into, .first = address, .bottom = bottom};
    return walk_guarded(walk);
  }
  add(into, address);
  Walk walk{.trace = &into, .first = caller, .bottom = bottom};
  // The thread is here, so nobody sees its registers meanwhile.
  const auto registers = context.uc_mcontext;
  if (return_to(context, caller)) walk_guarded(walk);
  context.uc_mcontext = registers;
}

void StackWalk::walk_throw(BackTrace& into, std::uintptr_t bottom) noexcept {
  into = {};
  into.end = BackTrace::End::lost;
  Walk walk{.trace = &into, .first = 0, .bottom = bottom};
  _Unwind_Backtrace(on_thrower, &walk);
  // An application that has its own functions for it: nothing tells which are those of the search.
  if (!walk.thrown) into = {};
}

void StackWalk::interrupted() noexcept {
  if (sigjmp_buf* const out = way_out) siglongjmp(*out, 1);
}

}  // namespace plchost
