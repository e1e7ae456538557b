#include "instances/runtime/memory/output_image.hpp"

#include <algorithm>
#include <cstring>

#include <unistd.h>

namespace plchost {

plc_image image_in(std::span<std::byte> bytes, std::uint32_t size) noexcept {
  plc_image image{};
  image.header = reinterpret_cast<plc_image_header*>(bytes.data());
  image.mapped = bytes.size();
  image.size = size;
  image.descriptor = -1;
  return image;
}

// Killed at any instruction in here, readers have one of the two images, whole.
void OutputImage::begin(std::span<const std::byte> initial, std::span<const std::byte> safe, bool holds) {
  safe_.assign(safe.begin(), safe.end());
  shown_.assign(initial.begin(), initial.end());
  scratch_.resize(initial.size());
  if (!keeps()) {
    shown_ = safe_;
  } else if (plc_image_read(&image_, scratch_.data(), nullptr) == PLC_IMAGE_OK) {
    shown_ = scratch_;
  }
  // A terminal that goes by the age must not take the values of the process before for fresh ones.
  plc_image_i64 stamp_ns = 0;
  if (holds) {
    stamp_ns = plc_image_now_ns();
  } else if (plc_image_read_latest(&image_, scratch_.data(), &stamp_ns) != PLC_IMAGE_OK) {
    stamp_ns = 0;
  }
  plc_image_take(&image_, static_cast<plc_image_u64>(::getpid()));
  plc_image_hold(&image_, holds ? 1 : 0);
  plc_image_set_safe(&image_, shown_.data());
  plc_image_tell(&image_, PLC_IMAGE_STATE_STOPPED, 1);
  __atomic_store_n(&image_.header->on_end, keeps() ? 0U : 1U, __ATOMIC_RELAXED);
  plc_image_beat(&image_);
  const std::uint64_t latest = load();
  const unsigned slot = static_cast<unsigned>((latest & 0xffU) + 1) % PLC_IMAGE_SLOTS;
  const std::uint64_t sequence = plc_image_next_sequence(latest);
  plc_image_fill(&image_, slot, sequence, initial.data(), stamp_ns);
  __atomic_store_n(&image_.header->latest, sequence << 8U | slot, __ATOMIC_RELEASE);
}

void OutputImage::put_safe(unsigned state) noexcept {
  told_.store(0, std::memory_order_relaxed);
  for (int attempt = 0; attempt < kAttempts; ++attempt) {
    const std::uint64_t told = plc_image_control(&image_);
    if (keeps() && (told & PLC_IMAGE_SHOWS_SAFE) == 0) {
      if (!read_latest(shown_)) continue;
      plc_image_set_safe(&image_, shown_.data());
    }
    // Not if the first cycle has ended meanwhile: then its values are those to be kept.
    if (plc_image_tell_since(&image_, told, state, 1) != 0) return;
  }
  // An image that cannot be read, because a stranger has spoiled it, cannot be kept either.
  plc_image_tell(&image_, state, keeps() ? 0 : 1);
}

void OutputImage::fail() noexcept {
  told_.store(0, std::memory_order_relaxed);
  plc_image_tell(&image_, PLC_IMAGE_STATE_EXCEPTION, keeps() ? 0 : 1);
}

void OutputImage::reserve(std::span<const ByteRange> ranges) noexcept {
  if (shows_safe() && plc_image_read(&image_, shown_.data(), nullptr) == PLC_IMAGE_OK)
    (void)put_into(shown_, ranges);
}

void OutputImage::go_on() noexcept {
  const std::uint64_t told = plc_image_control(&image_);
  if ((told & PLC_IMAGE_STATE) == PLC_IMAGE_STATE_HALTED) told_.store(told, std::memory_order_relaxed);
}

bool OutputImage::put_safe_bytes(std::span<const ByteRange> ranges) noexcept {
  return keeps() || put_into(safe_, ranges);
}

bool OutputImage::put_into(std::span<const std::byte> from, std::span<const ByteRange> ranges) noexcept {
  return ranges.empty() || merge(scratch_, [&](std::span<std::byte> target) {
           for (const ByteRange range : ranges)
             std::memcpy(target.data() + range.offset, from.data() + range.offset, range.bytes);
         });
}

// A state that another one has told meanwhile stays: a fault, say.
void OutputImage::resume(std::uint64_t told) noexcept {
  plc_image_resume(&image_, told);
  told_.compare_exchange_strong(told, 0, std::memory_order_relaxed);
}

// The slot that was published longest ago, of those that nobody fills: readers have the most time.
int OutputImage::claim(std::uint64_t latest) noexcept {
  const auto newest = static_cast<unsigned>(latest & 0xffU) % PLC_IMAGE_SLOTS;
  for (unsigned step = 1; step < PLC_IMAGE_SLOTS; ++step) {
    const unsigned slot = (newest + step) % PLC_IMAGE_SLOTS;
    const std::uint32_t bit = 1U << slot;
    if ((claimed_.fetch_or(bit, std::memory_order_acq_rel) & bit) != 0) continue;
    // Only now: until it was claimed another one may have published it.
    if (load() == latest) return static_cast<int>(slot);
    release(slot);
    return -1;
  }
  return -1;
}

void OutputImage::release(unsigned slot) noexcept {
  claimed_.fetch_and(~(1U << slot), std::memory_order_acq_rel);
}

bool OutputImage::copy(std::uint64_t latest, std::span<std::byte> scratch) const noexcept {
  // A stranger's number: there is nothing to take over.
  if (latest == 0 || (latest & 0xffU) >= PLC_IMAGE_SLOTS) {
    std::ranges::fill(scratch, std::byte{0});
    return true;
  }
  if (plc_image_copy(&image_, latest, scratch.data(), nullptr) != 0) return true;
  // Overtaken, or spoiled for good: then the bytes that were there are as good as any.
  return load() == latest;
}

bool OutputImage::publish(std::uint64_t latest, unsigned slot, std::span<const std::byte> bytes) noexcept {
  const std::uint64_t sequence = plc_image_next_sequence(latest);
  plc_image_fill(&image_, slot, sequence, bytes.data(), plc_image_now_ns());
  const std::uint64_t next = sequence << 8U | slot;
  if (!__atomic_compare_exchange_n(&image_.header->latest, &latest, next, false, __ATOMIC_ACQ_REL,
                                   __ATOMIC_ACQUIRE)) {
    return false;
  }
  release(slot);
  return true;
}

}  // namespace plchost
