#pragma once

#include <cstdint>

#include <ucontext.h>

#include "shm/base/fault_record.hpp"

namespace plchost {

/// Finds the functions that the calling thread was in when a signal came, by the unwind tables of the files
/// that they are in. No lock is taken and nothing is allocated. A stack that leads astray ends the walk only:
/// see interrupted().
class StackWalk {
 public:
  /// Has all functions ready that the others call. Once, before there are handlers. Set-up.
  static void prepare() noexcept;

  /// Within the handler of the signal that `context` is of. `bottom`: the stack pointer of the function of
  /// the runtime that has called the code; its own functions are left out. `caller`: the origin of a jump to
  /// where no code is; else 0. Opens SIGSEGV and SIGBUS for as long as it works. Signal context.
  static void walk(BackTrace& into, ucontext_t& context, std::uintptr_t bottom,
                   std::uintptr_t caller) noexcept;

  /// Within the search for a handler of a C++ exception: the functions that led to where it was thrown, each
  /// as the address that its call returns to. `bottom`: as above. Real-time.
  static void walk_throw(BackTrace& into, std::uintptr_t bottom) noexcept;

  /// For the handler of SIGSEGV and SIGBUS, first of all: if the fault is one of a walk of this thread, ends
  /// the walk and does not return. Signal context.
  static void interrupted() noexcept;
};

}  // namespace plchost
