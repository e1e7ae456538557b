#include "shm/pool/pool_segment.hpp"

#include <new>
#include <thread>

#include <fmt/format.h>
#include <unistd.h>

#include "shm/base/process_start.hpp"
#include "shm/base/time.hpp"
#include "shm/pool/object_pool.hpp"
#include "shm/pool/pool_clients.hpp"
#include "shm/pool/pool_references.hpp"
#include "shm/pool/pool_table.hpp"

namespace plchost {

namespace {

constexpr auto kPatience = std::chrono::seconds(1);
constexpr auto kLookInterval = std::chrono::milliseconds(1);
constexpr auto kRelaxed = std::memory_order_relaxed;

PoolHeader& header_of(const MemoryFile& memory) noexcept {
  return *reinterpret_cast<PoolHeader*>(memory.bytes().data());
}

// What never changes while the pool is there.
void write_constants(PoolHeader& header, std::uint32_t max_objects) noexcept {
  header.version = kPoolVersion;
  header.entry_size = sizeof(ObjectEntry);
  header.size = pool_size(max_objects);
  header.max_objects = max_objects;
  header.bucket_count = bucket_count_for(max_objects);
  header.max_clients = kMaxClients;
  header.max_references = max_references_for(max_objects);
  header.magic.store(kPoolMagic, std::memory_order_release);
}

// Zero-filled memory holds an empty table already; only the header has something to say.
Result<void> fill_header(std::span<std::byte> bytes, std::uint32_t max_objects) {
  write_constants(*new (bytes.data()) PoolHeader{}, max_objects);
  return {};
}

Result<void> check_header(const PoolHeader& header, std::uint32_t max_objects, std::size_t file_size,
                          const std::string& name) {
  if (header.version != kPoolVersion) {
    return failure(
        ErrorCode::corrupt,
        fmt::format("pool '{}' has version {}, this program needs {}; stop who uses it and remove it", name,
                    header.version, kPoolVersion));
  }
  const bool sound = header.entry_size == sizeof(ObjectEntry) && max_objects >= kMinObjects &&
                     max_objects <= kMaxObjects && header.bucket_count == bucket_count_for(max_objects) &&
                     header.max_clients == kMaxClients &&
                     header.max_references == max_references_for(max_objects) &&
                     header.size == pool_size(max_objects) && file_size == pool_size(max_objects);
  if (sound) return {};
  return failure(ErrorCode::corrupt,
                 fmt::format("pool '{}': its header does not fit its size of {} bytes", name, file_size));
}

}  // namespace

PoolSegment::PoolSegment(std::string name, MemoryFile memory, std::uint32_t max_objects, Access access)
    : name_(std::move(name)),
      memory_(std::move(memory)),
      guard_(memory_.bytes()),
      view_(memory_.bytes(), max_objects),
      access_(access),
      pid_(::getpid()),
      start_(start_of(pid_).value_or(0)) {}

PoolSegment::~PoolSegment() {
  if (client_ == nullptr || pid_ != ::getpid()) return;
  const auto held = lock();
  ClientSlot* const slot = held ? own_client() : nullptr;
  if (slot == nullptr) return;
  release_all(*slot);
  PoolClients::leave(*slot);
}

// busy: somebody has begun to make it and has not ended yet.
Result<std::shared_ptr<PoolSegment>> PoolSegment::attach_now(const std::string& name, Access access) {
  const auto unfinished = [&] {
    return failure(ErrorCode::busy, fmt::format("pool '{}' is not complete; remove it", name));
  };
  auto memory = MemoryFile::open(name, sizeof(PoolHeader), access);
  if (!memory) {
    return memory.error().code == ErrorCode::corrupt ? unfinished() : std::unexpected(memory.error());
  }
  const std::size_t file_size = memory->bytes().size();
  const PoolHeader& header = header_of(*memory);
  const std::uint64_t magic = header.magic.load(std::memory_order_acquire);
  if (magic == 0) return unfinished();
  if (magic != kPoolMagic) {
    return failure(ErrorCode::corrupt,
                   fmt::format("shared memory '{}' is not a pool; choose another name", name));
  }
  const std::uint32_t max_objects = header.max_objects;
  if (auto sound = check_header(header, max_objects, file_size, name); !sound) {
    return std::unexpected(sound.error());
  }
  return std::shared_ptr<PoolSegment>(new PoolSegment(name, std::move(*memory), max_objects, access));
}

// busy: it was not completed in time, so whoever began is gone.
Result<std::shared_ptr<PoolSegment>> PoolSegment::attach_patiently(const std::string& name, Access access) {
  const TimePoint deadline = MonotonicClock::now() + kPatience;
  for (;;) {
    auto pool = attach_now(name, access);
    if (pool || pool.error().code != ErrorCode::busy || MonotonicClock::now() >= deadline) return pool;
    std::this_thread::sleep_for(kLookInterval);
  }
}

Result<std::shared_ptr<PoolSegment>> PoolSegment::attach(const std::string& name, Access access) {
  auto pool = attach_patiently(name, access);
  if (!pool && pool.error().code == ErrorCode::busy) pool.error().code = ErrorCode::corrupt;
  return pool;
}

Result<std::shared_ptr<PoolSegment>> PoolSegment::create(const std::string& name,
                                                         const PoolOptions& options) {
  if (options.max_objects < kMinObjects || options.max_objects > kMaxObjects) {
    return failure(ErrorCode::invalid_argument,
                   fmt::format("pool '{}': {} objects; allowed are {} to {}", name, options.max_objects,
                               kMinObjects, kMaxObjects));
  }
  constexpr int kAttempts = 10;  // another round is needed only if others make and remove the pool meanwhile
  for (int attempt = 1;; ++attempt) {
    auto pool = attach_patiently(name, Access::read_write);
    if (pool || attempt == kAttempts) return pool;
    if (pool.error().code == ErrorCode::busy) {
      MemoryFile::remove(name);
    } else if (pool.error().code != ErrorCode::not_found) {
      return pool;
    }
    auto memory = MemoryFile::create(
        name, pool_size(options.max_objects),
        [&](std::span<std::byte> bytes) { return fill_header(bytes, options.max_objects); }, options.rights);
    if (memory) {
      return std::shared_ptr<PoolSegment>(
          new PoolSegment(name, std::move(*memory), options.max_objects, Access::read_write));
    }
    if (memory.error().code != ErrorCode::already_exists) return std::unexpected(memory.error());
  }
}

Result<PoolLock> PoolSegment::lock(bool look_thoroughly, Duration patience) {
  if (!writable()) {
    return failure(ErrorCode::refused,
                   fmt::format("pool '{}' was attached to read only; nothing can be changed in it", name_));
  }
  if (pid_ != ::getpid()) {
    return failure(
        ErrorCode::wrong_state,
        fmt::format("pool '{}' was attached by process {}; a child attaches it anew", name_, pid_));
  }
  auto held = PoolLock::acquire(view_.header(), name_, patience);
  if (!held) return held;
  mend_header();
  if (held->owner_died()) repair();
  PoolClients(view_).sweep(MonotonicClock::now(), look_thoroughly || held->owner_died(),
                           [this](ClientSlot& client) { release_all(client); });
  return held;
}

// If a stranger wrote over it, those who come later could not attach.
void PoolSegment::mend_header() noexcept {
  const auto max_objects = static_cast<std::uint32_t>(view_.entries().size());
  const PoolHeader& header = view_.header();
  const bool sound = header.magic.load(kRelaxed) == kPoolMagic &&
                     check_header(header, header.max_objects, pool_size(max_objects), name_).has_value();
  if (!sound) write_constants(view_.header(), max_objects);
}

// What was half-made when its maker died: a memory whose file may have its name already, an object that
// nobody has a reference to yet.
void PoolSegment::repair() noexcept {
  for (const ObjectEntry& entry : view_.entries()) {
    const bool half_made = entry.state.load(kRelaxed) == static_cast<std::uint32_t>(EntryState::changing);
    if (half_made && entry.type.load(kRelaxed) == static_cast<std::uint32_t>(ObjectType::memory) &&
        (entry.attributes.load(kRelaxed) & kAdopted) == 0) {
      MemoryFile::remove(pool_memory_name(name_, entry.name.view()));
    }
  }
  PoolTable(view_).rebuild();
  view_.header().client_high_water.store(kMaxClients, kRelaxed);
  PoolReferences(view_).rebuild();
  for (ObjectEntry& entry : view_.used_entries()) {
    if (PoolTable::is_valid(entry)) drop_if_idle(entry);
  }
}

ClientSlot* PoolSegment::own_client() const noexcept {
  const bool ours = client_ != nullptr && client_->pid.load(kRelaxed) == static_cast<std::uint32_t>(pid_) &&
                    client_->generation.load(kRelaxed) == client_generation_;
  return ours ? client_ : nullptr;
}

Result<ClientSlot*> PoolSegment::client() {
  if (ClientSlot* const slot = own_client(); slot != nullptr) return slot;
  client_ = PoolClients(view_).join(static_cast<std::uint32_t>(pid_), start_, program_name());
  if (client_ == nullptr) {
    return failure(ErrorCode::full,
                   fmt::format("pool '{}' has {} users, no more are possible", name_, kMaxClients));
  }
  client_generation_ = client_->generation.load(kRelaxed);
  return client_;
}

Result<ReferenceEntry*> PoolSegment::add_reference(ObjectEntry& object, bool writable) {
  const auto slot = client();
  if (!slot) return std::unexpected(slot.error());
  ReferenceEntry* const reference = PoolReferences(view_).add(object, **slot, writable);
  if (reference == nullptr) {
    return failure(ErrorCode::full, fmt::format("pool '{}' has {} references, no more are possible", name_,
                                                view_.references().size()));
  }
  return reference;
}

void PoolSegment::release(ReferenceEntry& reference, std::uint32_t generation) noexcept {
  const auto held = lock();
  const ClientSlot* const slot = held ? own_client() : nullptr;
  const bool ours = slot != nullptr && reference.object.load(kRelaxed) != 0 &&
                    reference.generation.load(kRelaxed) == generation &&
                    view_.client(reference.client) == slot;
  if (ours) release_one(reference);
}

void PoolSegment::release_one(ReferenceEntry& reference) noexcept {
  if (ObjectEntry* const object = PoolReferences(view_).release(reference)) drop_if_idle(*object);
}

void PoolSegment::release_all(ClientSlot& client) noexcept {
  bool mended = false;
  for (std::size_t step = 0; step < view_.references().size(); ++step) {
    ReferenceEntry* const reference = view_.reference(client.first_reference);
    if (reference == nullptr) break;
    const bool listed = view_.client(reference->client) == &client && reference->object.load(kRelaxed) != 0;
    if (listed) {
      release_one(*reference);
    } else if (!mended) {
      PoolReferences(view_).rebuild();  // the list is damaged
      mended = true;
    } else {
      break;  // a stranger goes on writing
    }
  }
}

// An event that was made by who posts and binds stays in its place until that is needed for another one.
void PoolSegment::drop_if_idle(ObjectEntry& object) noexcept {
  const bool reclaimed_later = object.type.load(kRelaxed) == static_cast<std::uint32_t>(ObjectType::event) &&
                               (object.attributes.load(kRelaxed) & kDirect) == 0;
  if (reclaimed_later) return;
  std::uint64_t binding = object.binding.load(std::memory_order_acquire);
  // Fails if a task is being bound to it at this moment.
  if (!PoolTable::is_idle(object) ||
      !object.binding.compare_exchange_strong(binding, Binding::next_generation(binding),
                                              std::memory_order_acq_rel, kRelaxed)) {
    return;
  }
  destroy(object);
}

void PoolSegment::destroy(ObjectEntry& object) noexcept {
  if (object.type.load(kRelaxed) == static_cast<std::uint32_t>(ObjectType::memory)) {
    object.state.store(static_cast<std::uint32_t>(EntryState::changing), std::memory_order_release);
    if (!MemoryFile::remove(pool_memory_name(name_, object.name.view()))) {
      // Another user's: see PoolAdoption::is_left_over().
      object.attributes.store(0, kRelaxed);
      object.state.store(static_cast<std::uint32_t>(EntryState::used), std::memory_order_release);
      return;
    }
  }
  PoolTable(view_).erase(object);
}

}  // namespace plchost
