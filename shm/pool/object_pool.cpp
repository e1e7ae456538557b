#include "shm/pool/object_pool.hpp"

#include <new>
#include <thread>

#include <fmt/format.h>

#include "shm/base/time.hpp"
#include "shm/pool/pool_layout.hpp"
#include "shm/pool/pool_lock.hpp"
#include "shm/pool/pool_table.hpp"

namespace plchost {

namespace {

constexpr auto kPatience = std::chrono::seconds(1);
constexpr auto kLookInterval = std::chrono::milliseconds(1);

PoolHeader& header_of(const MemoryFile& memory) noexcept {
  return *reinterpret_cast<PoolHeader*>(memory.bytes().data());
}

// Zero-filled memory holds an empty table already; only the header has something to say.
Result<void> fill_header(std::span<std::byte> bytes, std::uint32_t max_objects) {
  auto* const header = new (bytes.data()) PoolHeader{};
  header->version = kPoolVersion;
  header->entry_size = sizeof(ObjectEntry);
  header->size = bytes.size();
  header->max_objects = max_objects;
  header->bucket_count = bucket_count_for(max_objects);
  auto made = PoolLock::make_mutex(*header);
  if (made) header->magic.store(kPoolMagic, std::memory_order_release);
  return made;
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
                     header.size == pool_size(max_objects) && file_size == pool_size(max_objects);
  if (sound) return {};
  return failure(ErrorCode::corrupt,
                 fmt::format("pool '{}': its header does not fit its size of {} bytes", name, file_size));
}

Result<void> check_object_name(std::string_view name) {
  if (is_object_name(name)) return {};
  std::string shown(name.substr(0, kMaxObjectName));
  for (char& c : shown) {
    if (c < ' ' || c > '~') c = '?';
  }
  return failure(
      ErrorCode::invalid_argument,
      fmt::format("object name '{}' ({} bytes) is not valid: allowed are 1 to {} printable ASCII characters",
                  shown, name.size(), kMaxObjectName));
}

ObjectType type_of(const ObjectEntry& entry) noexcept {
  return static_cast<ObjectType>(entry.type.load(std::memory_order_relaxed));
}

Result<void> check_is_event(const ObjectEntry& entry, std::string_view name) {
  if (type_of(entry) == ObjectType::event) return {};
  return failure(ErrorCode::already_exists,
                 fmt::format("object '{}' is of type {}, not an event", name, to_string(type_of(entry))));
}

}  // namespace

std::string_view to_string(ObjectType type) noexcept {
  switch (type) {
    case ObjectType::memory:
      return "memory";
    case ObjectType::semaphore:
      return "semaphore";
    case ObjectType::event:
      return "event";
    case ObjectType::free:
      return "free";
  }
  return "unknown";
}

PoolEvent::PoolEvent(ObjectEntry& entry) noexcept
    : entry_(&entry), generation_(Binding::generation(entry.binding.load(std::memory_order_acquire))) {}

PostResult PoolEvent::post() const noexcept {
  if (entry_ == nullptr) return PostResult::not_registered;
  // Acquire pairs with the release of who registered it, and of who gave the entry to another object.
  const std::uint64_t binding = entry_->binding.load(std::memory_order_acquire);
  if (Binding::generation(binding) != generation_ || !Binding::registered(binding)) {
    return PostResult::not_registered;
  }
  entry_->event.post();
  return Binding::bound(binding) > 0 ? PostResult::posted : PostResult::no_task;
}

bool PoolEvent::valid() const noexcept {
  return entry_ != nullptr &&
         Binding::generation(entry_->binding.load(std::memory_order_acquire)) == generation_;
}

bool PoolEvent::registered() const noexcept {
  return valid() && Binding::registered(entry_->binding.load(std::memory_order_acquire));
}

std::uint32_t PoolEvent::bound_tasks() const noexcept {
  return valid() ? Binding::bound(entry_->binding.load(std::memory_order_acquire)) : 0;
}

bool PoolEvent::change_binding(std::uint64_t clear, std::uint64_t set) const noexcept {
  if (entry_ == nullptr) return false;
  std::uint64_t before = entry_->binding.load(std::memory_order_acquire);
  do {
    if (Binding::generation(before) != generation_) return false;
  } while (!entry_->binding.compare_exchange_weak(before, (before & ~clear) | set, std::memory_order_acq_rel,
                                                  std::memory_order_acquire));
  return true;
}

bool PoolEvent::set_registered(bool registered) const noexcept {
  return change_binding(Binding::kRegistered, registered ? Binding::kRegistered : 0);
}

bool PoolEvent::set_bound_tasks(std::uint32_t count) const noexcept {
  return change_binding(Binding::kBoundMask, count & Binding::kBoundMask);
}

CountedEvent& PoolEvent::counted() const noexcept {
  return entry_->event;
}

// busy: somebody has begun to make it and has not ended yet.
Result<ObjectPool> ObjectPool::attach_now(const std::string& name) {
  const auto unfinished = [&] {
    return failure(ErrorCode::busy, fmt::format("pool '{}' is not complete; remove it", name));
  };
  auto memory = MemoryFile::open(name, sizeof(PoolHeader), MemoryFile::Access::read_write);
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
  return ObjectPool(name, std::move(*memory), max_objects);
}

// busy: it was not completed in time, so whoever began is gone.
Result<ObjectPool> ObjectPool::attach_patiently(const std::string& name) {
  const TimePoint deadline = MonotonicClock::now() + kPatience;
  for (;;) {
    auto pool = attach_now(name);
    if (pool || pool.error().code != ErrorCode::busy || MonotonicClock::now() >= deadline) return pool;
    std::this_thread::sleep_for(kLookInterval);
  }
}

Result<ObjectPool> ObjectPool::attach(const std::string& name) {
  auto pool = attach_patiently(name);
  if (!pool && pool.error().code == ErrorCode::busy) pool.error().code = ErrorCode::corrupt;
  return pool;
}

Result<ObjectPool> ObjectPool::create(const std::string& name, const PoolOptions& options) {
  if (options.max_objects < kMinObjects || options.max_objects > kMaxObjects) {
    return failure(ErrorCode::invalid_argument,
                   fmt::format("pool '{}': {} objects; allowed are {} to {}", name, options.max_objects,
                               kMinObjects, kMaxObjects));
  }
  constexpr int kAttempts = 10;  // another round is needed only if others make and remove the pool meanwhile
  for (int attempt = 1;; ++attempt) {
    auto pool = attach_patiently(name);
    if (pool || attempt == kAttempts) return pool;
    if (pool.error().code == ErrorCode::busy) {
      remove(name);
    } else if (pool.error().code != ErrorCode::not_found) {
      return pool;
    }
    auto memory = MemoryFile::create(name, pool_size(options.max_objects), [&](std::span<std::byte> bytes) {
      return fill_header(bytes, options.max_objects);
    });
    if (memory) return ObjectPool(name, std::move(*memory), options.max_objects);
    if (memory.error().code != ErrorCode::already_exists) return std::unexpected(memory.error());
  }
}

PoolTable ObjectPool::table() const noexcept {
  return {memory_.bytes(), max_objects_};
}

Result<PoolLock> ObjectPool::lock(PoolTable& table) const {
  auto lock = PoolLock::acquire(table.header(), name_);
  if (lock && lock->owner_died()) {
    table.rebuild();
    lock->make_consistent();
  }
  return lock;
}

Result<PoolEvent> ObjectPool::create_event(std::string_view name) {
  if (auto valid = check_object_name(name); !valid) return std::unexpected(valid.error());
  PoolTable objects = table();
  const auto held = lock(objects);
  if (!held) return std::unexpected(held.error());
  ObjectEntry* entry = objects.find(name);
  if (entry == nullptr) entry = objects.insert(name, ObjectType::event);
  if (entry == nullptr) {
    return failure(ErrorCode::full,
                   fmt::format("no room for event '{}': pool '{}' holds {} objects, all of them in use", name,
                               name_, max_objects_));
  }
  if (auto event = check_is_event(*entry, name); !event) return std::unexpected(event.error());
  return PoolEvent(*entry);
}

Result<PoolEvent> ObjectPool::open_event(std::string_view name) const {
  if (auto valid = check_object_name(name); !valid) return std::unexpected(valid.error());
  PoolTable objects = table();
  const auto held = lock(objects);
  if (!held) return std::unexpected(held.error());
  ObjectEntry* const entry = objects.find(name);
  if (entry == nullptr) {
    return failure(ErrorCode::not_found, fmt::format("no object '{}' in pool '{}'", name, name_));
  }
  if (auto event = check_is_event(*entry, name); !event) return std::unexpected(event.error());
  return PoolEvent(*entry);
}

std::vector<ObjectInfo> ObjectPool::list() const {
  std::vector<ObjectInfo> infos;
  PoolTable objects = table();
  const auto held = lock(objects);
  if (!held) return infos;
  for (const ObjectEntry& entry : objects.entries()) {
    const std::uint64_t binding = entry.binding.load(std::memory_order_acquire);
    if (!PoolTable::is_valid(entry) || !Binding::in_use(binding)) continue;
    const std::uint64_t posts = entry.event.count() - entry.first_count.load(std::memory_order_relaxed);
    infos.push_back({.name = std::string(entry.name.view()),
                     .type = type_of(entry),
                     .value = posts,
                     .registered = Binding::registered(binding),
                     .bound_tasks = Binding::bound(binding)});
  }
  return infos;
}

}  // namespace plchost
