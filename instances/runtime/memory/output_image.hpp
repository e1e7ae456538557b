#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "shm/plc_process_image.h"

namespace plchost {

/// The image of shm/plc_process_image.h in memory of `bytes`, plc_image_bytes(size) of them.
[[nodiscard]] plc_image image_in(std::span<std::byte> bytes, std::uint32_t size) noexcept;

/// The image that several tasks of this process publish into, none of which waits for another: each makes a
/// whole image of the latest one and its own bytes, and is too late if another one has published meanwhile;
/// then it does it again. All functions are real-time.
class OutputImage {
 public:
  /// `memory` is an image already, and outlives this. Nobody else writes into it.
  OutputImage(std::span<std::byte> memory, std::uint32_t size) noexcept : image_(image_in(memory, size)) {}
  OutputImage(const OutputImage&) = delete;
  OutputImage& operator=(const OutputImage&) = delete;

  [[nodiscard]] const plc_image& image() const noexcept { return image_; }
  [[nodiscard]] std::uint32_t size() const noexcept { return image_.size; }

  /// Publishes `bytes`. For a sole writer.
  void write(std::span<const std::byte> bytes) noexcept { plc_image_write(&image_, bytes.data()); }

  /// Calls `merge` on a copy of the latest image (of zeros, if there is none) in `scratch`, then publishes
  /// that. It does so again, with a fresh copy, as long as others were faster. false: too often.
  template <class Merge>
  [[nodiscard]] bool merge(std::span<std::byte> scratch, const Merge& merge) noexcept {
    for (int attempt = 0; attempt < kAttempts; ++attempt) {
      const std::uint64_t latest = load();
      const int slot = claim(latest);
      if (slot < 0) continue;
      const bool copied = copy(latest, scratch);
      if (copied) {
        merge(scratch);
        if (publish(latest, static_cast<unsigned>(slot), scratch)) return true;
      }
      release(static_cast<unsigned>(slot));
    }
    return false;
  }

 private:
  // Another one publishes at most once per cycle of its task, which is far longer than a copy.
  static constexpr int kAttempts = 64;

  [[nodiscard]] std::uint64_t load() const noexcept {
    return __atomic_load_n(&image_.header->latest, __ATOMIC_ACQUIRE);
  }
  [[nodiscard]] int claim(std::uint64_t latest) noexcept;
  void release(unsigned slot) noexcept;
  [[nodiscard]] bool copy(std::uint64_t latest, std::span<std::byte> scratch) const noexcept;
  [[nodiscard]] bool publish(std::uint64_t latest, unsigned slot, std::span<const std::byte> bytes) noexcept;

  plc_image image_;
  std::atomic<std::uint32_t> claimed_{0};  // slots that tasks of this process fill; pairs with itself
};

}  // namespace plchost
