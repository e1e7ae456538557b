#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>

namespace plchost {

/// For a mapping of a file that others may cut short: where the file has ended, a touch is a SIGBUS. Under a
/// guard the first such touch turns the whole mapping into zeros that belong to nobody, and goes on. This way
/// costs a real-time reader nothing. A pread of 64 bytes takes 0.8 us of each cycle, and a jump out of the
/// handler needs a saved context before each read.
class MemoryGuard {
 public:
  /// So many mappings of a process can be guarded.
  static constexpr std::size_t kMost = 4096;

  MemoryGuard() noexcept = default;
  /// `memory` is mapped and stays so until the guard is gone. Set-up.
  explicit MemoryGuard(std::span<std::byte> memory) noexcept;

  /// false: there are kMost others. Any context.
  [[nodiscard]] explicit operator bool() const noexcept { return slot_ != nullptr; }
  /// The file was cut short, and what is read has been zeros since. Any context.
  [[nodiscard]] bool lost() const noexcept {
    return slot_ != nullptr && slot_->lost.load(std::memory_order_relaxed);
  }

  /// `address` lies in a guarded mapping that is lost. Any context.
  [[nodiscard]] static bool is_lost(const void* address) noexcept;

  /// Some memory of this process was lost: a futex in it is another one since, so a wake does not reach the
  /// threads that slept on it before. Any context.
  [[nodiscard]] static bool any_lost() noexcept { return lost_any.load(std::memory_order_acquire); }

  /// Installs a handler of SIGBUS that does so, once for the process. A fault outside of guarded memory goes
  /// to the handler that was there before, or ends the process as ever. Set-up.
  static void watch_process() noexcept;
  /// For a thread of others that has all signals blocked, as DDS's own: there a fault would end the process,
  /// handler or not. Costs a system call once for each thread. Any context.
  static void watch_thread() noexcept;
  /// For the handler of SIGBUS: whether `address` is guarded, and can be touched now. Any context.
  [[nodiscard]] static bool mend(const void* address) noexcept;

 private:
  struct Slot {
    std::atomic<std::uintptr_t> begin{0};  // 0: free
    std::atomic<std::uintptr_t> end{0};    // 0: not guarded (yet)
    std::atomic<bool> lost{false};
  };
  struct Release {
    void operator()(Slot* slot) const noexcept;
  };
  static std::array<Slot, kMost> slots;
  static std::atomic<bool> lost_any;

  std::unique_ptr<Slot, Release> slot_;
};

}  // namespace plchost
