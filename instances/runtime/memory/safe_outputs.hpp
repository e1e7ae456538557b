#pragma once

#include <atomic>
#include <cstddef>
#include <functional>
#include <vector>

#include <sys/types.h>

#include "instances/runtime/memory/output_image.hpp"
#include "instances/runtime/memory/output_registers.hpp"
#include "instances/runtime/memory/task_areas.hpp"

namespace plchost {

// The outputs of an application, as a terminal sees them
// ======================================================
//
//                 arm()            first cycle            put_safe()
//      safe ───────────────► armed ─────────────► driven ────────────► safe
//                              └──────────────────────────────────────► safe
//
//   safe    Terminals are shown the safe values: zeros, given ones, or those that were put out last.
//   armed   The tasks are started. Terminals are still shown the safe values.
//   driven  Terminals are shown what the tasks put out. Bytes that one task alone writes follow with the end
//           of its own first cycle.
//
// halt() leads a block from driven or armed to safe, and back to armed.
//
// An image keeps what the tasks put out last, and the safe values beside it. So a task goes on with its own
// values. put_safe() changes what is shown, so nothing that a task publishes later is seen. Registers are
// written over; a task that is just writing them when they are made safe is written over once more.

/// Puts the outputs that a terminal can see into their safe state, and back. All but make() is real-time.
class SafeOutputs {
 public:
  /// A task that writes a block.
  struct Writer {
    std::size_t task = 0;
    OutputView* view = nullptr;
    std::vector<ByteRange> alone;  ///< the bytes that no other task writes
    bool halted = false;           ///< a debugger halts the task
  };
  /// A block of outputs: an image, or registers.
  struct Block {
    OutputImage* image = nullptr;
    OutputRegisters* registers = nullptr;  ///< if there is no image
    std::vector<Writer> writers{};
    bool unsettled = false;  ///< a task that is within a cycle may write over its safe values
    bool halted = false;     ///< it is safe because a debugger halts a task that writes it
  };

  /// Whether a task is within a cycle, or a part of it that will end. The control thread asks.
  using InCycle = std::function<bool(std::size_t task)>;

  /// Of an application of so many tasks. Set-up.
  void make(std::vector<Block> blocks, std::size_t tasks);

  /// All outputs; `state` is one of PLC_IMAGE_STATE_..., for the dead-man word. After a fault, and after
  /// those of all tasks that write the area, it stays PLC_IMAGE_STATE_EXCEPTION until the end. Control
  /// thread.
  void put_safe(unsigned state) noexcept;
  /// A fault of the whole application: the part of put_safe() that a signal handler can do. Any context.
  void fail() noexcept;
  /// The tasks are about to start. Control thread, while all are parked.
  void arm() noexcept;
  /// The task is parked in a stop: outputs that only such tasks write are safe from now on. Control thread.
  void task_rests(std::size_t task) noexcept;
  /// The task alone is in exception, and never publishes again. Control thread.
  void task_fails(std::size_t task) noexcept;
  /// A debugger halts the tasks of which `is_halted` is true. Blocks that they write are safe until none of
  /// them halts any more, and a cycle has ended then. Control thread, while each of those tasks stands still,
  /// and before it goes on.
  void halt(const std::function<bool(std::size_t task)>& is_halted) noexcept;
  /// Every 100 ms: gives a sign to terminals, and writes safe values again that a task may have written over.
  /// Control thread.
  void beat(const InCycle& in_cycle) noexcept;

 private:
  void put_safe(Block& block, unsigned state) noexcept;
  void hold(Block& block, const Writer& halted) noexcept;
  void go_on(Block& block) noexcept;
  [[nodiscard]] bool has_failed(const Block& block) const noexcept;
  void settle(Block& block, const InCycle& in_cycle) noexcept;

  std::vector<Block> blocks_;
  std::vector<bool> rests_;  // by task
  std::vector<bool> fails_;  // by task
  bool armed_ = false;       // or driven
  std::atomic<bool> failed_{false};
  std::atomic<pid_t> process_{0};  // a signal handler asks; 0: the end was told
};

}  // namespace plchost
