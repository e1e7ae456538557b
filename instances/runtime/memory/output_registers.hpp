#pragma once

#include <atomic>
#include <cstddef>
#include <span>
#include <vector>

#include "instances/runtime/memory/byte_range.hpp"
#include "shm/files/registers.hpp"

namespace plchost {

/// Outputs that are registers of a device: they have no image, and cannot be read back.
class OutputRegisters {
 public:
  /// `ranges`: where outputs lie in `registers`. Tasks begin with `initial`, whatever the registers have.
  /// `safe`: their safe values, as many as registers; empty: they are kept as they are. Set-up.
  OutputRegisters(std::span<std::byte> registers, std::vector<ByteRange> ranges,
                  std::span<const std::byte> initial, std::vector<std::byte> safe);

  // The rest is real-time.

  /// Of a task. Pairs with its seat, as OutputView::give_up().
  [[nodiscard]] bool off() const noexcept { return off_.load(std::memory_order_seq_cst); }
  void write(std::size_t at, std::span<const std::byte> bytes) noexcept {
    copy_to_registers(registers_.subspan(at, bytes.size()), bytes);
  }
  /// Of bytes that several tasks change: keeps the value for restore(). Once all of a cycle are noted and
  /// publish() was called, they are to be written, unless they are off.
  void note(std::size_t at, std::byte value) noexcept {
    changed_[at].store(value, std::memory_order_relaxed);
  }
  /// Pairs with restore(): either that sees what was noted, or it is written after that.
  static void publish() noexcept { std::atomic_thread_fence(std::memory_order_seq_cst); }
  /// Writes them as they were noted last; those that never were have their initial values.
  void restore(ByteRange range) noexcept;

  /// Tasks write nothing more, but for one that is just doing so. Writes the safe values; to be repeated when
  /// no task is within a cycle. Any context, signal handlers included.
  void put_safe() noexcept;
  /// The same of some of them, beside tasks that write others.
  void put_safe(std::span<const ByteRange> ranges) noexcept;
  /// Tasks write again. Control thread.
  void arm() noexcept { off_.store(false, std::memory_order_seq_cst); }

  [[nodiscard]] bool keeps() const noexcept { return safe_.empty(); }
  [[nodiscard]] std::span<const ByteRange> ranges() const noexcept { return ranges_; }
  [[nodiscard]] std::span<const std::byte> safe() const noexcept { return safe_; }

 private:
  static constexpr std::size_t kPart = 64;  // that is written as one
  void restore_part(ByteRange range) noexcept;

  std::span<std::byte> registers_;
  std::vector<ByteRange> ranges_;
  std::vector<std::byte> safe_;
  std::vector<std::atomic<std::byte>> changed_;  // all of them, as tasks have changed them
  std::atomic<bool> off_{false};
};

}  // namespace plchost
