#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <string>

#include "shm/files/pool_files.hpp"
#include "shm/pool/object_pool.hpp"
#include "shm/pool/pool_layout.hpp"
#include "tests/support/own_name.hpp"

namespace {

using namespace plchost;

const std::string& pool_name() {
  static const std::string kName = own_name("fuzz");
  return kName;
}

// A sound segment to start each run with.
const std::array<std::byte, pool_size(kMinObjects)>& sound_segment() {
  static const auto kSegment = [] {
    std::array<std::byte, pool_size(kMinObjects)> segment{};
    ObjectPool::remove(pool_name());
    auto pool = ObjectPool::create(pool_name(), {.max_objects = kMinObjects});
    if (!pool) std::abort();
    for (int i = 0; i < 10; ++i) {
      const auto event = pool->create_event("instance/event" + std::to_string(i));
      event->set_registered(i % 2 == 0);
      event->set_bound_tasks(i % 3 == 0 ? 1 : 0);
    }
    for (const char* name : {"instance/semaphore", "kept"}) {
      if (!pool->create_semaphore(name, 3, {.keep = true})) std::abort();
    }
    if (!pool->create_memory("instance/memory", 100, {.keep = true})) std::abort();
    std::atexit([] {
      ObjectPool::remove(pool_name());
      remove_pool_memories(pool_name());
    });
    const auto memory = MemoryFile::open(pool_name(), segment.size(), MemoryFile::Access::read_only);
    std::ranges::copy(memory->bytes(), segment.begin());
    return segment;
  }();
  return kSegment;
}

void use(ObjectPool& pool) {
  for (int i = 0; i < 2; ++i) {
    (void)pool.list();
    (void)pool.open_event("instance/event1");
    (void)pool.open_event("absent");
    for (std::uint32_t n = 0; n < kMinObjects + 2; ++n) {
      const auto event = pool.create_event("new" + std::to_string(n));
      if (event) event->post();
      if (event && n % 2 == 0) event->set_registered(true);
      const auto semaphore = pool.open_semaphore("instance/semaphore");
      if (semaphore) {
        (void)semaphore->post();
        (void)semaphore->try_wait();
      }
      const auto mutex = pool.create_mutex("mutex" + std::to_string(n % 3));
      if (mutex && mutex->object.try_lock() == ObjectStatus::done) (void)mutex->object.unlock();
    }
    const auto memory = pool.create_memory("instance/memory", 100);
    if (memory) std::ranges::fill(memory->object.bytes(), std::byte{7});
    (void)pool.remove_object("instance/event3");
  }
}

}  // namespace

// The input is a list of [ place : 3 bytes ][ value : 1 byte ]: a stranger's writes into the segment. The
// mutex is left out: the number of a living thread in it means to wait for that.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto& sound = sound_segment();
  const auto memory = MemoryFile::open(pool_name(), sound.size(), MemoryFile::Access::read_write);
  if (!memory) std::abort();
  std::ranges::copy(sound, memory->bytes().begin());
  auto before = ObjectPool::attach(pool_name());
  if (!before) std::abort();
  for (; size >= 4; data += 4, size -= 4) {
    const std::size_t place =
        (std::size_t{data[0]} << 16 | std::size_t{data[1]} << 8 | data[2]) % sound.size();
    const bool in_mutex = place >= offsetof(PoolHeader, mutex) && place < offsetof(PoolHeader, changes);
    // The magic at zero means "wait a second for it", which tests look at.
    const bool in_magic = place < sizeof(std::uint64_t);
    if (!in_mutex && !in_magic) memory->bytes()[place] = static_cast<std::byte>(data[3]);
  }
  use(*before);  // had it open already
  auto after = ObjectPool::attach(pool_name());
  if (after) use(*after);
  (void)ObjectPool::create(pool_name());
  return 0;
}
