// A queue between two nodes while a stranger scribbles into it: neither end reads or writes outside of it,
// and what is received is what was sent.
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <span>
#include <vector>

#include "shm/block_driver/slot_ring.hpp"

namespace {

using namespace plchost;

constexpr std::uint32_t kSlots = kMinRingSlots;

/// A ring with nothing around it: the sanitizer sees each step outside.
struct Ring {
  std::atomic<std::uint64_t> head{0};
  std::atomic<std::uint64_t> published{0};
  std::vector<SlotDescriptor> descriptors = std::vector<SlotDescriptor>(kSlots);
  std::vector<std::byte> bytes = std::vector<std::byte>(kSlots * kSlotSize);

  RingMemory memory() {
    return {.head = &head,
            .published = &published,
            .descriptors = descriptors.data(),
            .bytes = bytes.data(),
            .slots = kSlots};
  }
  void scribble(unsigned where, std::size_t place, std::uint8_t value) {
    const auto into = [&](std::span<std::byte> part) { part[place % part.size()] = std::byte{value}; };
    switch (where % 4) {
      case 0:
        return into(std::as_writable_bytes(std::span(&head, 1)));
      case 1:
        return into(std::as_writable_bytes(std::span(&published, 1)));
      case 2:
        return into(std::as_writable_bytes(std::span(descriptors)));
      default:
        return into(bytes);
    }
  }
};

std::vector<std::byte> contents_of(std::uint32_t number, std::size_t size) {
  std::vector<std::byte> contents(size);
  for (std::size_t i = 0; i < size; ++i) contents[i] = static_cast<std::byte>(number * 31 + i);
  return contents;
}

}  // namespace

// The input is a list of [ what : 1 ][ place : 2 ][ value : 1 ].
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  Ring ring;
  RingWriter writer(ring.memory());
  RingReader reader(ring.memory());
  std::vector<std::byte> buffer(kMaxBlockSize);
  std::uint32_t number = 0;
  for (; size >= 4; data += 4, size -= 4) {
    const std::size_t place = std::size_t{data[1]} << 8 | data[2];
    BlockHeader header;
    switch (data[0] % 8) {
      case 0:
      case 1:
        header.source = header.destination = 1;
        header.channel = 1 + place % 2;
        header.sequence = ++number;
        (void)writer.put(header, contents_of(number, place));
        break;
      case 2:
      case 3: {
        const auto wants = [&](const BlockTag& tag, std::uint32_t) { return tag.channel == 1 + place % 2; };
        const std::span into = std::span(buffer).first(data[3] % 16 == 0 ? 100 : buffer.size());
        if (reader.take(wants, into, header) != TakeResult::taken) break;
        const auto sent = contents_of(header.sequence, header.size);
        if (!std::ranges::equal(sent, into.first(header.size))) std::abort();
        break;
      }
      case 4:
        (void)reader.drop_until(reader.head() + place % (2 * kSlots));
        break;
      case 5:
        if (reader.end_of_published() < reader.head()) std::abort();
        break;
      default:
        ring.scribble(data[0] / 8, place, data[3]);
    }
  }
  return 0;
}
