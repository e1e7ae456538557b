#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "instances/runtime/memory/output_image.hpp"
#include "instances/runtime/memory/output_registers.hpp"

namespace plchost {

/// The counter of a task's cycles: odd inside of one, even outside. In retain memory.
using CycleCounter = std::atomic<std::uint64_t>;

/// One task's copy of a block of inputs. Real-time but for its making.
class InputView {
 public:
  /// `source`: null: nobody writes them.
  InputView(std::vector<std::byte> initial, const plc_image* source);
  /// Registers are read as they are, without a protocol.
  InputView(std::vector<std::byte> initial, std::span<const std::byte> registers);

  void begin_cycle() noexcept;
  [[nodiscard]] std::byte* bytes() noexcept { return bytes_.data(); }
  [[nodiscard]] std::uint64_t missed() const noexcept { return missed_.load(std::memory_order_relaxed); }
  [[nodiscard]] std::uint64_t images() const noexcept {
    return image_ != nullptr ? plc_image_sequence(image_) : 0;
  }

 private:
  std::vector<std::byte> bytes_;
  std::vector<std::byte> scratch_;
  const plc_image* image_ = nullptr;
  std::span<const std::byte> registers_;
  std::atomic<std::uint64_t> missed_{0};  // written by the task alone
};

/// One task's copy of a block of outputs. Real-time but for its making.
class OutputView {
 public:
  /// Which bytes of the block it writes.
  struct Writes {
    std::vector<ByteRange> own;     ///< always
    std::vector<ByteRange> shared;  ///< where it has changed them in its cycle
    bool sole = false;              ///< no other task uses the block
  };
  /// `image`: null: nobody reads them.
  OutputView(std::vector<std::byte> initial, Writes writes, OutputImage* image);
  /// `registers` outlive it.
  OutputView(std::vector<std::byte> initial, Writes writes, OutputRegisters& registers);

  /// Its next publication is its first one since the outputs were safe. Control thread, before the registers
  /// are armed.
  void arm() noexcept { armed_.store(true, std::memory_order_relaxed); }
  /// From its next cycle on it publishes nothing more. Control thread.
  void give_up() noexcept { given_up_.store(true, std::memory_order_seq_cst); }

  /// The outputs of other tasks are in its copy then.
  void begin_cycle() noexcept;
  void end_cycle() noexcept;
  [[nodiscard]] std::byte* bytes() noexcept { return bytes_.data(); }
  [[nodiscard]] std::uint64_t missed() const noexcept { return missed_.load(std::memory_order_relaxed); }
  [[nodiscard]] std::uint64_t images() const noexcept {
    return image_ != nullptr ? plc_image_sequence(&image_->image()) : 0;
  }

 private:
  void refresh() noexcept;
  void write_registers() noexcept;
  bool note_changes() noexcept;
  void write_changes(ByteRange shared) noexcept;
  void lay_over(std::span<std::byte> target) const noexcept;

  std::vector<std::byte> bytes_;
  std::vector<std::byte> base_;  // bytes_ as others have them: where these differ, they are changes
  std::vector<std::byte> scratch_;
  Writes writes_;
  OutputImage* image_ = nullptr;
  OutputRegisters* registers_ = nullptr;
  std::atomic<bool> armed_{false};
  std::atomic<bool> given_up_{false};
  std::atomic<std::uint64_t> missed_{0};  // written by the task alone
};

}  // namespace plchost
