#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "instances/runtime/memory/byte_range.hpp"
#include "shm/plc_process_image.h"

namespace plchost {

/// The image of shm/plc_process_image.h in memory of `bytes`, plc_image_bytes(size) of them.
[[nodiscard]] plc_image image_in(std::span<std::byte> bytes, std::uint32_t size) noexcept;

/// The image that several tasks of this process publish into, none of which waits for another. Each makes a
/// whole image of the latest one and its own bytes. If another one has published meanwhile, it is too late,
/// and does it again. Tasks publish as they do, whatever readers are shown: begin() and put_safe() show them
/// the safe image, and the first publication after arm() shows them the tasks' ones again. All functions are
/// real-time, unless they say something else.
class OutputImage {
 public:
  /// `memory` is an image already, and outlives this. Nobody else writes into it.
  OutputImage(std::span<std::byte> memory, std::uint32_t size) noexcept : image_(image_in(memory, size)) {}
  OutputImage(const OutputImage&) = delete;
  OutputImage& operator=(const OutputImage&) = delete;

  [[nodiscard]] const plc_image& image() const noexcept { return image_; }
  [[nodiscard]] std::uint32_t size() const noexcept { return image_.size; }

  /// Takes the image over from the process before, whatever that has left. Readers are shown the safe image:
  /// `safe`, or if that is empty, what they were shown before, and `initial` if that was nothing. `holds`: as
  /// of plc_image_hold(); if false, the age of the last image that a task has published goes on. Publishes
  /// `initial`. Set-up, once.
  void begin(std::span<const std::byte> initial, std::span<const std::byte> safe, bool holds);
  /// From now on readers are shown the safe image, or the last one that was published if they are to keep
  /// that. Later publications are not shown. Control thread.
  void put_safe(unsigned state) noexcept;
  /// Of put_safe() the part that needs nothing but atomic operations. To be followed by that. Any context,
  /// signal handlers included.
  void fail() noexcept;
  /// Puts the bytes that are shown now into the next images, until the task that writes them has published.
  /// Control thread, while that task does not run.
  void reserve(std::span<const ByteRange> ranges) noexcept;
  /// The next publication ends put_safe(). Control thread, while all tasks are parked.
  void arm() noexcept { told_.store(plc_image_control(&image_), std::memory_order_relaxed); }
  /// The next publication ends put_safe(PLC_IMAGE_STATE_HALTED), if nothing else was told since. Control
  /// thread.
  void go_on() noexcept;
  /// Puts safe bytes into the images that are published. false: others were faster too often. Control thread.
  [[nodiscard]] bool put_safe_bytes(std::span<const ByteRange> ranges) noexcept;
  /// After each publication.
  void published() noexcept {
    if (const std::uint64_t told = told_.load(std::memory_order_relaxed); told != 0) resume(told);
  }

  /// The image that tasks have published last, also while another is shown. false: none, or overtaken each
  /// time.
  [[nodiscard]] bool read_latest(std::span<std::byte> bytes) const noexcept {
    return plc_image_read_latest(&image_, bytes.data(), nullptr) == PLC_IMAGE_OK;
  }
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

  void resume(std::uint64_t told) noexcept;
  bool put_into(std::span<const std::byte> from, std::span<const ByteRange> ranges) noexcept;
  [[nodiscard]] bool keeps() const noexcept { return safe_.empty(); }
  [[nodiscard]] bool shows_safe() const noexcept {
    return (plc_image_control(&image_) & PLC_IMAGE_SHOWS_SAFE) != 0;
  }

  plc_image image_;
  std::vector<std::byte> safe_;   // empty: the last values are kept
  std::vector<std::byte> shown_;  // of the control thread
  std::vector<std::byte> scratch_;
  std::atomic<std::uint64_t> told_{0};     // the dead-man word that the next publication ends; 0: none
  std::atomic<std::uint32_t> claimed_{0};  // slots that tasks of this process fill; pairs with itself
};

}  // namespace plchost
