// The ring of blocks between two nodes: threads of one process put in, threads of another one take out.

#include <cstring>

#include "shm/base/crc32c.hpp"
#include "shm/block_driver/slot_ring.hpp"
#include "tests/models/checker/model.hpp"

namespace plchost {

// In the place of shm/base/crc32c.cpp: the ring needs of them that they copy, and that they tell a
// difference.
std::uint32_t crc32c(std::span<const std::byte> bytes, std::uint32_t so_far) noexcept {
  for (const std::byte byte : bytes) so_far = so_far * 31 + static_cast<std::uint32_t>(byte);
  return so_far;
}
std::uint32_t copy_with_crc32c(std::byte* to, std::span<const std::byte> from,
                               std::uint32_t so_far) noexcept {
  if (!from.empty()) std::memcpy(to, from.data(), from.size());
  return crc32c({to, from.size()}, so_far);
}
std::uint32_t copy_out_with_crc32c(std::byte* to, std::span<const std::byte> from,
                                   std::uint32_t so_far) noexcept {
  return copy_with_crc32c(to, from, so_far);
}

}  // namespace plchost

namespace plchost::models {
namespace {

constexpr std::uint32_t kSlots = 2;

struct Shared {
  std::atomic<std::uint64_t> head{0};
  std::atomic<std::uint64_t> published{0};
  std::array<SlotDescriptor, kSlots> descriptors{};
  std::array<std::byte, kSlots * kSlotSize> bytes{};
  RingMemory memory{.head = &head,
                    .published = &published,
                    .descriptors = descriptors.data(),
                    .bytes = bytes.data(),
                    .slots = kSlots};
  RingWriter writer{memory};
  RingReader reader{memory};
  std::array<std::atomic<int>, 8> taken{};  // how often each block was

  void check(std::uint32_t blocks) {
    for (std::uint32_t i = 1; i <= blocks; ++i) require(taken[i].load() <= 1, "a block was taken twice");
    std::uint32_t taken_in_all = 0;
    for (const auto& count : taken) taken_in_all += static_cast<std::uint32_t>(count.load());
    require(reader.damaged() == 0, "a block came damaged");
    require(reader.taken() == taken_in_all, "a block was taken by nobody");
    require(reader.head() == head.load(), "the writer was not told the newest head");
    require(published.load() - taken_in_all == count_waiting(memory), "a block is lost");
  }
};

Shared& make(Scene& scene) {
  auto& shared = scene.make<Shared>();
  scene.name(shared.bytes, "bytes");
  scene.name(shared.descriptors, "descriptors");
  scene.name(shared.writer, "writer");
  scene.name(shared.reader, "reader");
  scene.name(shared.published, "published");
  scene.name(shared.head, "head");
  return shared;
}

PutResult put(Shared& shared, std::uint32_t channel) {
  const std::array<std::byte, 4> contents{static_cast<std::byte>(channel)};
  return shared.writer.put({.destination = NodeAddress{.host = 0, .node = 2}.number(),
                            .source = NodeAddress{.host = 0, .node = 1}.number(),
                            .channel = channel},
                           contents);
}

bool take(Shared& shared, std::uint32_t channel) {
  std::array<std::byte, 16> buffer{};
  BlockHeader header;
  const TakeResult result = shared.reader.take(
      [&](const BlockTag& tag, std::uint32_t) { return channel == 0 || tag.channel == channel; }, buffer,
      header);
  require(result != TakeResult::too_small, "a size that no block has");
  if (result != TakeResult::taken) return false;
  require(channel == 0 || header.channel == channel, "a block of another channel");
  require(buffer[0] == static_cast<std::byte>(header.channel), "the contents of another block");
  shared.taken[header.channel].fetch_add(1, std::memory_order_relaxed);
  return true;
}

// Two threads take the two blocks that are there, while the writer puts in more.
void two_readers_one_writer(Scene& scene) {
  Shared& shared = make(scene);
  put(shared, 1);
  put(shared, 2);
  for (const char* name : {"reader", "other reader"}) scene.thread(name, [&] { take(shared, 0); });
  scene.thread("writer", [&] {
    for (std::uint32_t block = 3; block <= 4; ++block)
      require(put(shared, block) != PutResult::broken, "the writer calls a sound link broken");
  });
  scene.at_end([&] { shared.check(4); });
}

// Each its own channel, against the order in which they lie.
void readers_of_two_channels(Scene& scene) {
  Shared& shared = make(scene);
  put(shared, 1);
  put(shared, 2);
  scene.thread("reader of 2", [&] { require(take(shared, 2), "a block that waits is not seen"); });
  scene.thread("reader of 1", [&] { require(take(shared, 1), "a block that waits is not seen"); });
  scene.thread("writer",
               [&] { require(put(shared, 3) != PutResult::broken, "the writer calls a sound link broken"); });
  scene.at_end([&] { shared.check(3); });
}

void two_writers_one_reader(Scene& scene) {
  Shared& shared = make(scene);
  put(shared, 1);
  for (std::uint32_t block = 2; block <= 3; ++block) {
    scene.thread(block == 2 ? "writer" : "other writer", [&shared, block] {
      require(put(shared, block) != PutResult::broken, "the writer calls a sound link broken");
    });
  }
  scene.thread("reader", [&] {
    take(shared, 0);
    take(shared, 0);
  });
  scene.at_end([&] { shared.check(3); });
}

// Each writer needs a slot that the reader has freed, and may know of it only from the other writer.
void two_writers_of_a_full_ring(Scene& scene) {
  Shared& shared = make(scene);
  put(shared, 1);
  put(shared, 2);
  for (std::uint32_t block = 3; block <= 4; ++block) {
    scene.thread(block == 3 ? "writer" : "other writer", [&shared, block] {
      require(put(shared, block) != PutResult::broken, "the writer calls a sound link broken");
    });
  }
  scene.thread("reader", [&] {
    take(shared, 0);
    take(shared, 0);
  });
  scene.at_end([&] { shared.check(4); });
}

// A reader stands still within its take while the slots are filled and taken once more.
void the_ring_goes_round(Scene& scene) {
  Shared& shared = make(scene);
  put(shared, 1);
  put(shared, 2);
  scene.thread("reader", [&] { take(shared, 1); });
  scene.thread("writer and other reader", [&] {
    take(shared, 2);
    for (std::uint32_t block = 3; block <= 4; ++block)
      require(put(shared, block) != PutResult::broken, "the writer calls a sound link broken");
    take(shared, 0);
    take(shared, 0);
  });
  scene.at_end([&] { shared.check(4); });
}

// The process that puts in is killed at any instruction: all that it has published is whole.
void a_writer_is_killed(Scene& scene) {
  Shared& shared = make(scene);
  scene.limits({.kills = 1});
  scene.thread("victim",
               [&] {
                 put(shared, 1);
                 put(shared, 2);
               },
               {.may_be_killed = true});
  scene.thread("reader", [&] {
    take(shared, 0);
    take(shared, 0);
  });
  scene.at_end([&] {
    require(shared.reader.damaged() == 0, "half a block was published");
    require(shared.reader.head() == shared.head.load(), "the writer was not told the newest head");
  });
}

}  // namespace
}  // namespace plchost::models

int main(int argc, char** argv) {
  using namespace plchost::models;
  return run(argc, argv,
             {{"two_writers_of_a_full_ring", two_writers_of_a_full_ring},
              {"the_ring_goes_round", the_ring_goes_round},
              {"a_writer_is_killed", a_writer_is_killed},
              {"two_writers_one_reader", two_writers_one_reader},
              {"readers_of_two_channels", readers_of_two_channels},
              {"two_readers_one_writer", two_readers_one_writer}});
}
