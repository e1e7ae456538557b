#include "instances/runtime/memory/output_image.hpp"

#include <algorithm>

namespace plchost {

plc_image image_in(std::span<std::byte> bytes, std::uint32_t size) noexcept {
  plc_image image{};
  image.header = reinterpret_cast<plc_image_header*>(bytes.data());
  image.mapped = bytes.size();
  image.size = size;
  image.descriptor = -1;
  return image;
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
