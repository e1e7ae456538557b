#include "shm/pool/pool_segment.hpp"

#include <algorithm>
#include <new>
#include <thread>

#include <fmt/format.h>
#include <unistd.h>

#include "shm/base/time.hpp"
#include "shm/files/open_or_make.hpp"
#include "shm/files/pool_files.hpp"
#include "shm/pool/pool_clients.hpp"
#include "shm/pool/pool_header.hpp"
#include "shm/pool/pool_references.hpp"
#include "shm/pool/pool_table.hpp"
#include "shm/pool/process_pools.hpp"
#include "shm/threads/process_start.hpp"

namespace plchost {

namespace {

constexpr auto kPatience = std::chrono::milliseconds(100);
constexpr auto kLookInterval = std::chrono::milliseconds(1);

PoolHeader& header_of(const MemoryFile& memory) noexcept {
  return *reinterpret_cast<PoolHeader*>(memory.bytes().data());
}

// Of the two copies in the header one may be a stranger's.
Result<std::shared_ptr<ClientLocks>> open_locks(const PoolHeader& header, const std::string& name) {
  auto locks = ClientLocks::open(name, header.pid_namespace_again);
  if (locks || header.pid_namespace == header.pid_namespace_again) return locks;
  return ClientLocks::open(name, header.pid_namespace);
}

}  // namespace

PoolSegment::PoolSegment(std::string name, MemoryFile memory, std::uint32_t max_objects, Access access,
                         bool across, std::shared_ptr<ClientLocks> locks)
    : name_(std::move(name)),
      memory_(std::move(memory)),
      view_(memory_.bytes(), max_objects),
      access_(access),
      process_(this_process()),
      across_(across),
      pid_namespace_(locks ? locks->file() : pid_namespace()),
      locks_(std::move(locks)),
      journal_(view_.header(), memory_.bytes().size()),
      told_(counted()) {
  if (locks_ && writable()) ProcessPools::of_this_process().add(view_, *locks_);
}

// The segment of a file whose header was checked.
Result<std::shared_ptr<PoolSegment>> PoolSegment::make(const std::string& name, MemoryFile memory,
                                                       std::uint32_t max_objects, Access access) {
  const PoolHeader& header = header_of(memory);
  std::shared_ptr<ClientLocks> locks;
  const bool across = is_pool_across(header, memory.bytes().size());
  if (across) {
    auto opened = open_locks(header, name);
    // To look at the pool they are not needed.
    if (!opened && access == Access::read_write) return std::unexpected(std::move(opened).error());
    if (opened) locks = *std::move(opened);
  } else {
    PLCHOST_TRY(check_pid_namespace(header, name));
  }
  return std::shared_ptr<PoolSegment>(
      new PoolSegment(name, std::move(memory), max_objects, access, across, std::move(locks)));
}

// As if this client had ended: if the lock is not to be had, or it holds very much, others release the rest.
PoolSegment::~PoolSegment() {
  if (locks_ && writable()) ProcessPools::of_this_process().remove(view_);
  if (client_ == nullptr || process_.pid != ::getpid()) return;
  if (ClientSlot* const slot = own_client(); slot != nullptr) slot->ended.store(1, kRelaxed);
  constexpr int kAttempts = 50;
  for (int i = 0; i < kAttempts && own_client() != nullptr && lock(); ++i) {
  }
}

// busy: somebody has begun to make it and has not ended yet.
Result<std::shared_ptr<PoolSegment>> PoolSegment::attach_now(const std::string& name, Access access,
                                                             const OwnerCheck& owners) {
  const auto unfinished = [&] {
    return failure(ErrorCode::busy, fmt::format("pool '{}' is not complete; remove it", name));
  };
  auto memory = MemoryFile::open(name, sizeof(PoolHeader), access, owners);
  if (!memory) {
    return memory.error().code == ErrorCode::corrupt ? unfinished() : std::unexpected(memory.error());
  }
  const std::size_t file_size = memory->bytes().size();
  const PoolHeader& header = header_of(*memory);
  const std::uint64_t magic = header.magic.load(std::memory_order_acquire);
  std::uint32_t max_objects = header.max_objects_again;
  if (is_pool_sound_again(header, max_objects, file_size)) {
    return PoolSegment::make(name, std::move(*memory), max_objects, access);
  }
  if (magic == 0) return unfinished();
  if (magic != kPoolMagic) {
    return failure(ErrorCode::corrupt,
                   fmt::format("shared memory '{}' is not a pool; choose another name", name));
  }
  max_objects = header.max_objects;
  PLCHOST_TRY(check_pool_header(header, max_objects, file_size, name));
  return PoolSegment::make(name, std::move(*memory), max_objects, access);
}

// busy: it was not completed in time, so its maker is gone.
Result<std::shared_ptr<PoolSegment>> PoolSegment::attach_patiently(const std::string& name, Access access,
                                                                   const OwnerCheck& owners) {
  const TimePoint deadline = MonotonicClock::now() + kPatience;
  for (;;) {
    auto pool = attach_now(name, access, owners);
    if (pool || pool.error().code != ErrorCode::busy || MonotonicClock::now() >= deadline) return pool;
    std::this_thread::sleep_for(kLookInterval);
  }
}

Result<std::shared_ptr<PoolSegment>> PoolSegment::attach(const std::string& name, Access access) {
  // A client takes what there is: only the process that sets up the host knows its owner.
  auto pool = attach_patiently(name, access, is_any_owner);
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
  const auto owners = [&options](uid_t user) {
    return is_own_or_roots(user) || user == options.rights.owner;
  };
  const auto open = [&] {
    auto pool = attach_patiently(name, Access::read_write, owners);
    if (!pool && pool.error().code == ErrorCode::busy) {
      MemoryFile::remove(name);
      pool.error().code = ErrorCode::not_found;
    }
    return pool;
  };
  const auto make = [&](bool /*replace*/) -> Result<std::shared_ptr<PoolSegment>> {
    std::uint64_t locks_file = 0;
    if (options.across_containers) {
      PLCHOST_TRY_ASSIGN(locks_file, ClientLocks::make(name, options.rights, owners));
    }
    const auto fill = [&](std::span<std::byte> bytes) {
      return fill_pool_header(bytes, options, locks_file);
    };
    PLCHOST_TRY_ASSIGN(auto memory,
                       MemoryFile::create(name, pool_size(options.max_objects), fill, options.rights));
    return PoolSegment::make(name, std::move(memory), options.max_objects, Access::read_write);
  };
  return open_or_make(open, make, Replaces::nothing);
}

Result<PoolLock> PoolSegment::acquire(Duration patience) {
  // A second wait for a holder that was waited for in vain just now is short.
  constexpr Duration kMoment = std::chrono::milliseconds(5);
  PoolHeader& header = view_.header();
  if (locks_) {
    PLCHOST_TRY(locks_->renew(header.client_numbers));
  }
  const PoolMutex mutex = this->mutex(header.mutex);
  const std::uint32_t stuck = stuck_.load(kRelaxed);
  if (stuck != 0 && mutex.holder() == stuck) patience = std::min(patience, kMoment);
  auto held = PoolLock::acquire(mutex, header, journal_, clients(), name_, patience);
  if (lost()) {
    return failure(ErrorCode::corrupt,
                   fmt::format("pool '{}': another program has cut its file in {} short; its contents are "
                               "lost to this process, which must open it anew",
                               name_, MemoryFile::kDirectory));
  }
  const bool in_vain = !held && held.error().code == ErrorCode::timed_out;
  stuck_.store(in_vain ? mutex.holder() : 0, kRelaxed);
  if (!held) return held;
  mend_header();
  if (held->owner_died()) repair(*held);
  return held;
}

Result<PoolLock> PoolSegment::lock(bool look_thoroughly, Duration patience) {
  if (!writable()) {
    return failure(ErrorCode::refused,
                   fmt::format("pool '{}' was attached to read only; nothing can be changed in it", name_));
  }
  if (process_.pid != ::getpid()) {
    return failure(
        ErrorCode::wrong_state,
        fmt::format("pool '{}' was attached by process {}; a child attaches it anew", name_, process_.pid));
  }
  constexpr std::size_t kPiece = 256;  // references
  const TimePoint until = MonotonicClock::now() + std::min(patience, kBurial);
  for (;;) {
    auto held = acquire(patience);
    if (!held) return held;
    release_late(*held);
    const TimePoint now = MonotonicClock::now();
    struct Burial {  // so that the function below has room for what it needs without the heap
      PoolSegment& segment;
      PoolLock& held;
      std::size_t left = kPiece;
    } burial{.segment = *this, .held = *held};
    const bool all = clients().sweep(
        now, look_thoroughly || held->owner_died(),
        [&burial](ClientSlot& client) { return burial.segment.bury(burial.held, client, burial.left); });
    held->burying = !all;
    if (all || now >= until) return held;
  }
}

// If a stranger wrote over it, those who come later could not attach.
void PoolSegment::mend_header() noexcept {
  const auto max_objects = static_cast<std::uint32_t>(view_.entries().size());
  PoolHeader& header = view_.header();
  const std::size_t size = pool_size(max_objects);
  const bool sound = header.magic.load(kRelaxed) == kPoolMagic &&
                     check_pool_header(header, header.max_objects, size, name_).has_value() &&
                     is_pool_sound_again(header, header.max_objects_again, size) &&
                     header.version == version() && header.version_again == version() &&
                     header.pid_namespace == pid_namespace_ && header.pid_namespace_again == pid_namespace_;
  if (sound) return;
  write_pool_constants(header, version(), max_objects, pid_namespace_);
  header.header_mended.fetch_add(1, kRelaxed);
}

PoolFindings PoolSegment::counted() const noexcept {
  const PoolHeader& header = view_.header();
  return {.lost = lost(),
          .headers_mended = header.header_mended.load(kRelaxed),
          .rebuilds = header.rebuilds.load(kRelaxed),
          .lost_objects = header.lost_objects.load(kRelaxed)};
}

PoolFindings PoolSegment::take_findings() noexcept {
  const PoolFindings now = counted();
  const PoolFindings before = std::exchange(told_, now);
  return {.lost = now.lost,
          .headers_mended = now.headers_mended - before.headers_mended,
          .rebuilds = now.rebuilds - before.rebuilds,
          .lost_objects = now.lost_objects - before.lost_objects};
}

// The unfinished step of an owner that ended is undone; an object that it was making or taking away goes.
void PoolSegment::repair(PoolLock& held) noexcept {
  PoolHeader& header = view_.header();
  header.repairs.fetch_add(1, kRelaxed);
  const bool undone = header.rebuilding.load(kRelaxed) == 0 && journal_.roll_back();
  if (!undone) return rebuild(held);
  ObjectEntry* const entry = view_.entry(header.unsettled);
  journal_.set(header.unsettled, 0);
  if (entry == nullptr) return;
  if (entry->state.load(kRelaxed) == static_cast<std::uint32_t>(EntryState::changing)) {
    // The file of one that was being adopted is another's.
    const bool adopted = (entry->attributes.load(kRelaxed) & kAdopted) != 0;
    adopted ? table(held).erase(*entry) : destroy(held, *entry);
  } else if (PoolTable::is_valid(*entry)) {
    drop_if_idle(held, *entry);
  }
}

// All lists, from the entries. That takes as long as the pool is large.
void PoolSegment::rebuild(PoolLock& held) noexcept {
  PoolHeader& header = view_.header();
  journal_.commit();
  header.rebuilding.store(1, kRelaxed);
  for (const ObjectEntry& entry : view_.entries()) {
    const bool half_made = entry.state.load(kRelaxed) == static_cast<std::uint32_t>(EntryState::changing);
    if (half_made && entry.type.load(kRelaxed) == static_cast<std::uint32_t>(ObjectType::memory) &&
        (entry.attributes.load(kRelaxed) & kAdopted) == 0) {
      (void)held.trash.take(pool_memory_name(name_, entry.name.view()));
    }
  }
  table(held).rebuild();
  header.client_high_water.store(kMaxClients, kRelaxed);
  PoolReferences(view_, journal_).rebuild();
  header.unsettled.store(0, kRelaxed);
  header.rebuilding.store(0, kRelaxed);
  for (ObjectEntry& entry : view_.used_entries()) {
    if (PoolTable::is_valid(entry)) drop_if_idle(held, entry);
  }
}

ClientSlot* PoolSegment::own_client() const noexcept {
  const bool ours =
      client_ != nullptr && client_->pid.load(kRelaxed) == static_cast<std::uint32_t>(process_.pid) &&
      client_->generation.load(kRelaxed) == client_generation_ &&
      (!locks_ || client_->start.load(kRelaxed) == locks_->number(view_.header().client_numbers));
  return ours ? client_ : nullptr;
}

Result<ClientSlot*> PoolSegment::client() {
  if (ClientSlot* const slot = own_client(); slot != nullptr) return slot;
  if (locks_) process_.start = locks_->number(view_.header().client_numbers);
  client_ = clients().join(process_, program_name());
  if (client_ == nullptr) {
    return failure(ErrorCode::full,
                   fmt::format("pool '{}' has {} users, no more are possible", name_, kMaxClients));
  }
  client_generation_ = client_->generation.load(kRelaxed);
  return client_;
}

bool PoolSegment::has_ended(const ReferenceInfo& client) const noexcept {
  const ProcessIdentity process{
      .pid = static_cast<pid_t>(client.pid), .image = client.image, .start = client.start};
  return knows_clients() && client_has_ended(process, locks_.get());
}

pid_t PoolSegment::seen_as(std::uint64_t client_number) const noexcept {
  const bool possible = locks_ != nullptr && client_number <= ClientMutex::kMaxClient;
  return possible ? locks_->seen_as(static_cast<std::uint32_t>(client_number)) : 0;
}

ObjectEntry* PoolSegment::peek(std::string_view name) const noexcept {
  return PoolTable::peek(view_, name);
}

// Where there was no time yet to release all that dead clients held, this object is looked at.
ObjectEntry* PoolSegment::find(PoolLock& held, std::string_view name) noexcept {
  PoolTable objects = table(held);
  ObjectEntry* const object = objects.find(name);
  if (object == nullptr || !held.burying) return object;
  for (ReferenceEntry& reference : view_.used_references()) {
    if (object->reference_count.load(kRelaxed) == 0) break;
    if (!view_.is_on(reference, *object)) continue;
    const ClientSlot* const client = view_.client_of(reference);
    if (client == nullptr || client->ended.load(kRelaxed) != 0) release_one(held, reference);
  }
  return objects.find(name);
}

Result<ReferenceEntry*> PoolSegment::add_reference(PoolLock& /*held*/, ObjectEntry& object, bool writable) {
  PLCHOST_TRY_ASSIGN(const auto slot, client());
  ReferenceEntry* const reference = PoolReferences(view_, journal_).add(object, *slot, writable);
  if (reference == nullptr) {
    return failure(ErrorCode::full, fmt::format("pool '{}' has {} references, no more are possible", name_,
                                                view_.references().size()));
  }
  return reference;
}

void PoolSegment::release(ReferenceEntry& reference, std::uint32_t generation) noexcept {
  auto held = lock();
  if (held) return release_own(*held, reference, generation);
  if (held.error().code != ErrorCode::timed_out) return;
  const std::lock_guard guard(late_guard_);
  late_.emplace_back(&reference, generation);
}

void PoolSegment::release_late(PoolLock& held) noexcept {
  const std::lock_guard guard(late_guard_);
  for (const auto& [reference, generation] : late_) release_own(held, *reference, generation);
  late_.clear();
}

void PoolSegment::release_own(PoolLock& held, ReferenceEntry& reference, std::uint32_t generation) noexcept {
  const ClientSlot* const slot = own_client();
  const bool ours = slot != nullptr && reference.object.load(kRelaxed) != 0 &&
                    reference.generation.load(kRelaxed) == generation &&
                    view_.client(reference.client) == slot;
  if (ours) release_one(held, reference);
}

void PoolSegment::release_one(PoolLock& held, ReferenceEntry& reference) noexcept {
  if (ObjectEntry* const object = PoolReferences(view_, journal_).release(reference)) {
    drop_if_idle(held, *object);
  }
  journal_.commit();
}

// False: there is more, and it is the turn of others. The search goes on where it ended: the client takes no
// reference any more. A place is behind it only when its release cannot be undone.
bool PoolSegment::bury(PoolLock& held, ClientSlot& client, std::size_t& left) noexcept {
  constexpr std::size_t kPlacesForOne = 256;  // are searched in the time in which one is released
  const auto all = view_.used_references();
  const std::size_t begin = client.released.load(kRelaxed);
  std::size_t at = begin;
  for (; at < all.size(); ++at) {
    if (left == 0 || held.trash.full()) break;
    if ((at - begin) % kPlacesForOne == kPlacesForOne - 1) --left;
    if (view_.client_of(all[at]) != &client) continue;
    if (left > 0) --left;
    release_one(held, all[at]);
  }
  client.released.store(static_cast<std::uint32_t>(at), kRelaxed);
  if (at < all.size()) return false;
  const auto is_its = [&](const ReferenceEntry& reference) { return view_.client_of(reference) == &client; };
  // The place that the search began at may be a stranger's. Without it there is nothing left.
  if (begin != 0) left -= std::min(left, all.size() / kPlacesForOne);
  if (begin != 0 && std::ranges::any_of(all, is_its)) {
    client.released.store(0, kRelaxed);
    return bury(held, client, left);
  }
  if (client.reference_count.load(kRelaxed) == 0) return true;
  // A stranger has written over the count.
  PoolReferences(view_, journal_).rebuild();
  client.released.store(0, kRelaxed);
  return client.reference_count.load(kRelaxed) == 0;
}

// An event that was made by a program that posts and binds stays in its place until that is needed for
// another one.
void PoolSegment::drop_if_idle(PoolLock& held, ObjectEntry& object) noexcept {
  const bool reclaimed_later = object.type.load(kRelaxed) == static_cast<std::uint32_t>(ObjectType::event) &&
                               (object.attributes.load(kRelaxed) & kDirect) == 0;
  if (reclaimed_later) return;
  std::uint64_t binding = object.binding.load(std::memory_order_acquire);
  if (!PoolTable::is_idle(object)) return;
  // References that were put back would be of an old generation.
  journal_.set(view_.header().unsettled, view_.link_to(object));
  journal_.commit();
  // Fails if a task is being bound to it at this moment.
  if (object.binding.compare_exchange_strong(binding, Binding::next_generation(binding),
                                             std::memory_order_acq_rel, kRelaxed)) {
    destroy(held, object);
  } else {
    journal_.set(view_.header().unsettled, 0);
  }
}

void PoolSegment::destroy(PoolLock& held, ObjectEntry& object) noexcept {
  PoolTable objects = table(held);
  objects.withdraw(object);
  if (object.type.load(kRelaxed) == static_cast<std::uint32_t>(ObjectType::memory)) {
    if (!held.trash.take(pool_memory_name(name_, object.name.view()))) {
      // Another user's: see PoolAdoption::is_left_over().
      object.attributes.store(0, kRelaxed);
      objects.publish(object);
      journal_.commit();
      return;
    }
  }
  objects.erase(object);
}

void PoolSegment::let_go(PoolLock& held, ObjectEntry& object) noexcept {
  journal_.set(object.attributes, object.attributes.load(kRelaxed) & ~(kKept | kAdopted));
  drop_if_idle(held, object);
}

}  // namespace plchost
