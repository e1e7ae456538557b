#include "instances/runtime/memory/safe_outputs.hpp"

#include <algorithm>
#include <utility>

#include <unistd.h>

namespace plchost {

void SafeOutputs::make(std::vector<Block> blocks, std::size_t tasks) {
  blocks_ = std::move(blocks);
  process_.store(::getpid(), std::memory_order_relaxed);
  rests_.assign(tasks, true);
  fails_.assign(tasks, false);
}

// Each of its tasks alone: nobody drives it any more.
bool SafeOutputs::has_failed(const Block& block) const noexcept {
  return !block.writers.empty() &&
         std::ranges::all_of(block.writers, [&](const Writer& one) { return fails_[one.task]; });
}

void SafeOutputs::put_safe(Block& block, unsigned state) noexcept {
  block.halted = state == PLC_IMAGE_STATE_HALTED;
  const bool failed =
      (failed_.load(std::memory_order_relaxed) || has_failed(block)) && state != PLC_IMAGE_STATE_ENDED;
  if (block.image != nullptr) return block.image->put_safe(failed ? PLC_IMAGE_STATE_EXCEPTION : state);
  block.registers->put_safe();
  block.unsettled = true;
}

void SafeOutputs::put_safe(unsigned state) noexcept {
  armed_ = false;
  if (state == PLC_IMAGE_STATE_ENDED) process_.store(0, std::memory_order_relaxed);
  if (state == PLC_IMAGE_STATE_EXCEPTION) failed_.store(true, std::memory_order_relaxed);
  for (Block& block : blocks_) put_safe(block, state);
}

void SafeOutputs::fail() noexcept {
  // Not for a process that the application has forked, nor after the end.
  if (::getpid() != process_.load(std::memory_order_relaxed)) return;
  failed_.store(true, std::memory_order_seq_cst);
  for (const Block& block : blocks_) {
    if (block.image != nullptr) {
      block.image->fail();
    } else {
      block.registers->put_safe();
    }
  }
}

void SafeOutputs::arm() noexcept {
  armed_ = true;
  rests_.assign(rests_.size(), false);
  for (Block& block : blocks_) {
    block.unsettled = false;
    block.halted = false;
    for (Writer& writer : block.writers) {
      writer.halted = false;
      writer.view->arm();
      if (block.image != nullptr && block.writers.size() > 1) block.image->reserve(writer.alone);
    }
    if (block.image != nullptr) {
      block.image->arm();
    } else {
      block.registers->arm();
    }
  }
}

void SafeOutputs::task_rests(std::size_t task) noexcept {
  if (task >= rests_.size()) return;
  rests_[task] = true;
  if (!armed_) return;
  for (Block& block : blocks_) {
    const bool writes = std::ranges::find(block.writers, task, &Writer::task) != block.writers.end();
    const auto is_over = [&](const Writer& one) { return rests_[one.task] || fails_[one.task]; };
    if (writes && std::ranges::all_of(block.writers, is_over)) put_safe(block, PLC_IMAGE_STATE_STOPPED);
  }
}

void SafeOutputs::task_fails(std::size_t task) noexcept {
  if (task >= fails_.size()) return;
  fails_[task] = true;
  for (Block& block : blocks_) {
    const auto writer = std::ranges::find(block.writers, task, &Writer::task);
    if (writer == block.writers.end()) continue;
    writer->view->give_up();
    if (has_failed(block)) {
      put_safe(block, PLC_IMAGE_STATE_EXCEPTION);
    } else {
      settle(block, [](std::size_t) { return true; });
    }
  }
}

void SafeOutputs::halt(const std::function<bool(std::size_t task)>& is_halted) noexcept {
  if (!armed_) return;
  for (Block& block : blocks_) {
    bool halted = false;
    for (Writer& writer : block.writers) {
      const bool before = std::exchange(writer.halted, is_halted(writer.task) && !fails_[writer.task]);
      halted |= writer.halted;
      if (writer.halted && !before) hold(block, writer);
    }
    if (block.halted && !halted) go_on(block);
  }
}

void SafeOutputs::hold(Block& block, const Writer& halted) noexcept {
  // Registers that are kept need nothing: the task writes none, and other tasks go on.
  if (block.image == nullptr && block.registers->keeps()) return;
  if (!block.halted) put_safe(block, PLC_IMAGE_STATE_HALTED);
  // When the others have gone on, its bytes follow with the end of its own cycle.
  if (block.image != nullptr && block.writers.size() > 1) block.image->reserve(halted.alone);
}

void SafeOutputs::go_on(Block& block) noexcept {
  block.halted = false;
  block.unsettled = false;
  if (block.image != nullptr) return block.image->go_on();
  for (const Writer& writer : block.writers) writer.view->arm();
  block.registers->arm();
  // fail() may have come between: either this sees it, or the registers are off after it.
  if (failed_.load(std::memory_order_seq_cst)) block.registers->put_safe();
}

void SafeOutputs::beat(const InCycle& in_cycle) noexcept {
  for (Block& block : blocks_) {
    if (block.image != nullptr) plc_image_beat(&block.image->image());
    if (block.unsettled) settle(block, in_cycle);
  }
}

// The look comes first: the last one that was within its cycle is written over after it.
void SafeOutputs::settle(Block& block, const InCycle& in_cycle) noexcept {
  block.unsettled = std::ranges::any_of(block.writers, [&](const Writer& writer) {
    return (!armed_ || block.halted || fails_[writer.task]) && in_cycle(writer.task);
  });
  if (block.image == nullptr && block.registers->off()) return block.registers->put_safe();
  for (const Writer& writer : block.writers) {
    if (!fails_[writer.task]) continue;
    if (block.image == nullptr) {
      block.registers->put_safe(writer.alone);
    } else if (!block.image->put_safe_bytes(writer.alone)) {
      block.unsettled = true;
    }
  }
}

}  // namespace plchost
