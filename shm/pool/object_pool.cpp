#include "shm/pool/object_pool.hpp"

#include <algorithm>
#include <chrono>
#include <iterator>
#include <span>
#include <thread>

#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include "shm/files/pool_files.hpp"
#include "shm/pool/object_listing.hpp"
#include "shm/pool/pool_adoption.hpp"
#include "shm/pool/pool_segment.hpp"
#include "shm/pool/pool_table.hpp"

namespace plchost {

/// The object to make or open.
struct ObjectPool::Wanted {
  std::string_view name;
  ObjectType type = ObjectType::event;
  std::uint64_t initial = 0;  // of a memory its size; 0: the one that it has
};

namespace {

ObjectType type_of(const ObjectEntry& entry) noexcept {
  return static_cast<ObjectType>(entry.type.load(kRelaxed));
}

Result<void> check_is(const ObjectEntry& entry, ObjectType type, std::string_view name) {
  if (type_of(entry) == type) return {};
  return failure(ErrorCode::wrong_type, fmt::format("object '{}' is of type {}, not {}", name,
                                                    to_string(type_of(entry)), to_string(type)));
}

Result<void> check_initial(const ObjectTraits& traits, std::string_view name, std::uint64_t initial) {
  if (initial >= traits.least_initial && initial <= traits.most_initial) return {};
  return failure(ErrorCode::invalid_argument,
                 fmt::format("{} '{}': {}; allowed are {} to {}", traits.name, shown(name),
                             fmt::format(fmt::runtime(traits.value_form), initial), traits.least_initial,
                             traits.most_initial));
}

Result<void> check_size(const ObjectEntry& entry, std::uint64_t size, std::string_view name) {
  const std::uint64_t found = entry.size.load(kRelaxed);
  if (size == 0 || type_of(entry) != ObjectType::memory || found == size) return {};
  return failure(ErrorCode::wrong_size, fmt::format("memory '{}' has {} bytes, not {}", name, found, size));
}

Result<void> check_permitted(const ObjectEntry& entry, MemoryFile::Access access, std::string_view name) {
  const uid_t owner = entry.owner.load(kRelaxed);
  const gid_t group = entry.group.load(kRelaxed);
  const mode_t mode = entry.mode.load(kRelaxed);
  const Permission permission = permission_for_caller(owner, group, mode);
  const bool to_write = access == MemoryFile::Access::read_write;
  if (permission.read && (permission.write || !to_write)) return {};
  return failure(ErrorCode::refused,
                 fmt::format("object '{}' ({}) does not allow user {} to {} it", name,
                             describe_rights(owner, group, mode), ::geteuid(), to_write ? "write" : "read"));
}

std::unexpected<Error> nothing_of_that_name(std::string_view name, const std::string& pool) {
  return failure(ErrorCode::not_found, fmt::format("no object '{}' in pool '{}'", name, pool));
}

// As with files, nobody gives an object to a group that he is not in.
Result<void> check_group(const ObjectOptions& options) {
  if (!options.group || may_give_to(*options.group)) return {};
  return failure(ErrorCode::refused, fmt::format("user {} is not in group {}, and can make no object for it",
                                                 ::geteuid(), *options.group));
}

// Rights that the options leave open are those of the pool. The group of a process that is not in the pool's
// is its own.
MemoryRights rights_for(const ObjectOptions& options, const std::string& pool) {
  struct stat status{};
  const std::string path = MemoryFile::path(pool);
  if (::stat(path.c_str(), &status) != 0) return {.group = options.group, .mode = options.mode};
  constexpr mode_t kPermissions = 0666;
  const gid_t usual = may_give_to(status.st_gid) ? status.st_gid : ::getegid();
  return {.group = options.group.value_or(usual),
          .mode = options.mode != 0 ? options.mode : status.st_mode & kPermissions};
}

std::uint32_t attributes_for(const ObjectOptions& options, ObjectType type) noexcept {
  return (options.keep ? kKept : 0) | (type == ObjectType::event ? kDirect : 0);
}

// How long one without the right to write waits for a moment in which nobody changes anything.
TimePoint look_until() noexcept {
  return MonotonicClock::now() + std::chrono::milliseconds(50);
}

void describe_new(ObjectEntry& entry, const MemoryRights& rights, std::uint32_t attributes) noexcept {
  entry.owner.store(::geteuid(), kRelaxed);
  entry.group.store(rights.group.value_or(::getegid()), kRelaxed);
  entry.mode.store(rights.mode, kRelaxed);
  entry.attributes.store(attributes, kRelaxed);
}

}  // namespace

Result<ObjectPool> ObjectPool::create(const std::string& name, const PoolOptions& options) {
  PLCHOST_TRY_ASSIGN(auto segment, PoolSegment::create(name, options));
  return ObjectPool(std::move(segment));
}

Result<ObjectPool> ObjectPool::attach(const std::string& name, Access access) {
  PLCHOST_TRY_ASSIGN(auto segment, PoolSegment::attach(name, access));
  return ObjectPool(std::move(segment));
}

void ObjectPool::remove(const std::string& name) noexcept {
  MemoryFile::remove(name);
  MemoryFile::remove(ClientLocks::file_name(name));
}

bool ObjectPool::across_containers() const noexcept {
  return segment_->across_containers();
}

bool ObjectPool::has_ended(const ReferenceInfo& holder) const noexcept {
  return segment_->has_ended(holder);
}

const std::string& ObjectPool::name() const noexcept {
  return segment_->name();
}

PoolFindings ObjectPool::tidy() noexcept {
  constexpr auto kPatience = std::chrono::milliseconds(20);
  if (!adoption_) adoption_ = std::make_shared<PoolAdoption>(segment_);
  const std::vector<ObjectEntry*> left_over = adoption_->look_at_entries();
  bool locked = false;
  if (auto held = segment_->lock(true, kPatience)) {
    locked = true;
    for (ObjectEntry* const entry : left_over) {
      if (held->trash.full()) break;
      if (PoolAdoption::is_left_over(*entry)) segment_->destroy(*held, *entry);
    }
  }
  if (locked) adoption_->look_at_files();
  return segment_->take_findings();
}

std::uint32_t ObjectPool::capacity() const noexcept {
  return static_cast<std::uint32_t>(segment_->view().entries().size());
}

std::uint64_t ObjectPool::changes() const noexcept {
  return segment_->view().header().changes.load(std::memory_order_acquire);
}

Result<PoolEvent> ObjectPool::create_event(std::string_view name) & {
  PLCHOST_TRY(check_object_name(name));
  const Wanted wanted{.name = name};
  PLCHOST_TRY_ASSIGN(auto held, segment_->lock());
  ObjectEntry* entry = segment_->find(held, name);
  if (entry == nullptr) {
    PoolTable objects = segment_->table(held);
    entry = objects.insert(name, ObjectType::event);
    if (entry == nullptr) return no_room(wanted);
    describe_new(*entry, rights_for({}, this->name()), 0);
    objects.publish(*entry);
  }
  PLCHOST_TRY(check_is(*entry, ObjectType::event, name));
  return PoolEvent(*entry);
}

Result<PoolEvent> ObjectPool::open_event(std::string_view name) const& {
  PLCHOST_TRY(check_object_name(name));
  PLCHOST_TRY_ASSIGN(auto held, segment_->lock());
  ObjectEntry* const entry = segment_->find(held, name);
  if (entry == nullptr) return nothing_of_that_name(name, this->name());
  PLCHOST_TRY(check_is(*entry, ObjectType::event, name));
  return PoolEvent(*entry);
}

std::uint32_t ObjectPool::place_of(const PoolEvent& event) const noexcept {
  return static_cast<std::uint32_t>(event.entry_ - segment_->view().entries().data());
}

CountedEvent* ObjectPool::event_at(std::uint32_t place) const noexcept {
  const auto all = segment_->view().entries();
  return place < all.size() ? &all[place].event : nullptr;
}

std::unexpected<Error> ObjectPool::no_room(const Wanted& wanted) const {
  return failure(ErrorCode::full,
                 fmt::format("no room for {} '{}': pool '{}' holds {} objects, all of them in use",
                             to_string(wanted.type), wanted.name, name(), segment_->view().entries().size()));
}

// `held` is null if the pool is mapped to read only.
Result<void> ObjectPool::refer(PoolObject& object, PoolLock* held, ObjectEntry& entry, const Wanted& wanted,
                               Access access) const {
  if (auto same = check_is(entry, wanted.type, wanted.name); !same) return same;
  if (auto same = check_size(entry, wanted.initial, wanted.name); !same) return same;
  if (auto may = check_permitted(entry, access, wanted.name); !may) return may;
  const bool writable = access == Access::read_write && segment_->writable();
  if (held != nullptr) {
    PLCHOST_TRY_ASSIGN(const auto reference, segment_->add_reference(*held, entry, writable));
    object.reference_ = reference;
    object.reference_generation_ = reference->generation.load(kRelaxed);
  }
  object.entry_ = &entry;
  object.generation_ = Binding::generation(entry.binding.load(std::memory_order_acquire));
  object.writable_ = writable;
  object.segment_ = segment_;
  return {};
}

Result<void> ObjectPool::map(SharedMemory& memory, const Wanted& wanted, Access access) const {
  const std::uint64_t size = memory.entry().size.load(kRelaxed);
  // The file that the object was made with, or found with, not one that somebody has put in its place.
  const uid_t owner = memory.entry().owner.load(kRelaxed);
  PLCHOST_TRY_ASSIGN(auto file, in_step(fmt::format("memory '{}'", wanted.name),
                                        MemoryFile::open(pool_memory_name(name(), wanted.name), 1, access,
                                                         [owner](uid_t user) { return user == owner; })));
  if (file.bytes().size() != size) {
    return failure(ErrorCode::corrupt, fmt::format("memory '{}' has {} bytes, and its file {}: remove it",
                                                   wanted.name, size, file.bytes().size()));
  }
  memory.memory_ = std::move(file);
  return {};
}

// The object is not there.
Result<ObjectEntry*> ObjectPool::make_entry(PoolLock& held, const Wanted& wanted,
                                            const ObjectOptions& options, UnnamedMemory* memory) {
  PoolTable objects = segment_->table(held);
  ObjectEntry* const entry = objects.insert(wanted.name, wanted.type);
  if (entry == nullptr) return no_room(wanted);
  describe_new(*entry, rights_for(options, name()), attributes_for(options, wanted.type));
  traits_of(wanted.type)->begin(*entry, wanted.initial);
  if (memory != nullptr) {
    // A file of that name that is no object, nor to be one, is what is left of another pool of the name.
    const auto named =
        memory->give_name([&](const std::string& path) { return !PoolAdoption::is_in_use(path, name()); });
    if (!named) {
      objects.erase(*entry);
      return std::unexpected(named.error());
    }
  }
  objects.publish(*entry);
  return entry;
}

Result<bool> ObjectPool::create_locked(PoolObject& object, const Wanted& wanted, const ObjectOptions& options,
                                       UnnamedMemory* memory) {
  PLCHOST_TRY_ASSIGN(auto held, segment_->lock());
  ObjectEntry* entry = segment_->find(held, wanted.name);
  bool made = entry == nullptr;
  if (entry != nullptr && wanted.type == ObjectType::memory && PoolAdoption::is_left_over(*entry)) {
    PLCHOST_TRY_ASSIGN(
        entry, PoolAdoption::use_again(*segment_, held, *entry, wanted.initial, rights_for(options, name()),
                                       attributes_for(options, wanted.type)));
    made = true;
  }
  if (entry == nullptr) {
    PLCHOST_TRY_ASSIGN(entry, make_entry(held, wanted, options, memory));
  }
  auto referred = refer(object, &held, *entry, wanted, Access::read_write);
  if (referred) return made;
  if (made) segment_->destroy(held, *entry);
  return std::unexpected(std::move(referred).error());
}

Result<bool> ObjectPool::create_into(PoolObject& object, const Wanted& wanted, const ObjectOptions& options,
                                     std::span<const std::byte> contents) {
  PLCHOST_TRY(check_object_name(wanted.name));
  PLCHOST_TRY(check_initial(*traits_of(wanted.type), wanted.name, wanted.initial));
  PLCHOST_TRY(check_group(options));
  if (wanted.type == ObjectType::memory) {
    return create_memory_into(static_cast<SharedMemory&>(object), wanted, options, contents);
  }
  return create_locked(object, wanted, options, nullptr);
}

Result<Created<SharedMemory>> ObjectPool::create_memory(std::string_view name, std::size_t size,
                                                        const ObjectOptions& options,
                                                        std::span<const std::byte> contents) {
  if (contents.size() > size) {
    return failure(
        ErrorCode::wrong_size,
        fmt::format("memory '{}' of {} bytes cannot have {} bytes of contents", name, size, contents.size()));
  }
  SharedMemory object;
  const Wanted wanted{.name = name, .type = ObjectType::memory, .initial = size};
  PLCHOST_TRY_ASSIGN(const auto made, create_into(object, wanted, options, contents));
  return Created<SharedMemory>{.object = std::move(object), .made = made};
}

Result<bool> ObjectPool::create_memory_into(SharedMemory& object, const Wanted& wanted,
                                            const ObjectOptions& options,
                                            std::span<const std::byte> contents) {
  PLCHOST_TRY_ASSIGN(const bool there, if_found(open_into(object, wanted, Access::read_write)));
  if (there) return false;
  // The host takes its time to find so many bytes: not with the lock held.
  PLCHOST_TRY_ASSIGN(auto unnamed, prepare_memory(wanted.name, wanted.initial, options));
  std::ranges::copy(contents, unnamed.bytes().begin());
  auto made = create_locked(object, wanted, options, &unnamed);
  if (!made && made.error().code == ErrorCode::already_exists) {
    // Firmware has just made it.
    if (open_into(object, wanted, Access::read_write)) return false;
    return failure(ErrorCode::refused,
                   fmt::format("memory '{}': {}, and is in use by the runtime; choose another name",
                               wanted.name, made.error().message));
  }
  if (!made) return made;
  PLCHOST_TRY(map(object, wanted, Access::read_write));
  return made;
}

// Without the lock, whose word it may not write. If another process changes the table meanwhile, it looks
// again, until `until`. Then, and if that process has ended over it, the last look has to do: each single
// change leaves lists that can be read.
template <class Look>
auto ObjectPool::look_only(TimePoint until, Look look) const {
  constexpr auto kPause = std::chrono::milliseconds(1);
  const std::atomic<std::uint64_t>& changes = segment_->view().header().changes;
  for (bool again = false;; again = true) {
    const std::uint64_t before = changes.load();
    auto seen = look();
    std::atomic_thread_fence(std::memory_order_acquire);
    const bool changing = (before & 1) != 0;
    if (!changing && changes.load() == before) return seen;
    if (changing && again && segment_->holder_has_ended()) return seen;
    if (MonotonicClock::now() >= until) return seen;
    std::this_thread::sleep_for(kPause);
  }
}

Result<void> ObjectPool::find_and_refer(PoolObject& object, const Wanted& wanted, Access access) const {
  const auto refer_to = [&](PoolLock* held, ObjectEntry* entry) -> Result<void> {
    if (entry == nullptr || PoolAdoption::is_left_over(*entry)) {
      return nothing_of_that_name(wanted.name, name());
    }
    return refer(object, held, *entry, wanted, access);
  };
  if (!segment_->writable()) {
    if (access == Access::read_write) return std::unexpected(segment_->lock().error());
    return look_only(look_until(), [&] { return refer_to(nullptr, segment_->peek(wanted.name)); });
  }
  PLCHOST_TRY_ASSIGN(auto held, segment_->lock());
  return refer_to(&held, segment_->find(held, wanted.name));
}

Result<void> ObjectPool::open_once(PoolObject& object, const Wanted& wanted, Access access) const {
  if (auto found = find_and_refer(object, wanted, access); !found) return found;
  if (wanted.type != ObjectType::memory) return {};
  auto mapped = map(static_cast<SharedMemory&>(object), wanted, access);
  if (!mapped) object.close();
  return mapped;
}

// A memory a second time, if table and file disagreed.
Result<void> ObjectPool::open_into(PoolObject& object, const Wanted& wanted, Access access) const {
  if (auto valid = check_object_name(wanted.name); !valid) return valid;
  auto opened = open_once(object, wanted, access);
  const auto code = opened ? ErrorCode::ok : opened.error().code;
  const bool missed =
      code == ErrorCode::not_found || code == ErrorCode::corrupt || code == ErrorCode::refused;
  if (wanted.type != ObjectType::memory || !missed) return opened;
  if (!PoolAdoption::reconcile(*segment_, wanted.name)) return opened;
  return open_once(object, wanted, access);
}

Result<bool> ObjectPool::create_into(PoolObject& object, ObjectType type, std::string_view name,
                                     std::uint64_t initial, const ObjectOptions& options) {
  return create_into(object, Wanted{.name = name, .type = type, .initial = initial}, options);
}

Result<void> ObjectPool::open_into(PoolObject& object, ObjectType type, std::string_view name,
                                   Access access) const {
  return open_into(object, Wanted{.name = name, .type = type}, access);
}

// The entry of the old one goes first: a death in between leaves no half of either.
Result<SharedMemory> ObjectPool::replace_memory(std::string_view name, UnnamedMemory& prepared) {
  const Wanted wanted{.name = name, .type = ObjectType::memory, .initial = prepared.bytes().size()};
  PLCHOST_TRY_ASSIGN(auto held, segment_->lock());
  if (ObjectEntry* const old = segment_->find(held, name); old != nullptr) {
    PLCHOST_TRY(check_is(*old, ObjectType::memory, name));
    PLCHOST_TRY(check_permitted(*old, Access::read_write, name));
    segment_->table(held).erase(*old);
  }
  PLCHOST_TRY_ASSIGN(const auto made, make_entry(held, wanted, {.keep = true}, &prepared));
  SharedMemory memory;
  // The one before is gone and this one is kept, so no room for a reference is no reason to fail.
  auto referred = refer(memory, &held, *made, wanted, Access::read_write);
  if (!referred) referred = refer(memory, nullptr, *made, wanted, Access::read_write);
  PLCHOST_TRY(referred);
  memory.memory_ = prepared.take();
  return memory;
}

Result<UnnamedMemory> ObjectPool::prepare_memory(std::string_view name, std::size_t size,
                                                 const ObjectOptions& options) const {
  PLCHOST_TRY(check_object_name(name));
  return UnnamedMemory::make(pool_memory_name(this->name(), name), size, rights_for(options, this->name()));
}

Result<SharedMemory> ObjectPool::replace_memory(std::string_view name, std::size_t size,
                                                const MemoryFile::Fill& fill) {
  PLCHOST_TRY_ASSIGN(auto prepared, prepare_memory(name, size));
  PLCHOST_TRY(fill(prepared.bytes()));
  return replace_memory(name, prepared);
}

Result<void> ObjectPool::remove_object(std::string_view name) {
  if (auto valid = check_object_name(name); !valid) return valid;
  // Firmware may have made it with a header alone.
  if (segment_->peek(name) == nullptr) (void)PoolAdoption::reconcile(*segment_, name);
  PLCHOST_TRY_ASSIGN(auto held, segment_->lock());
  ObjectEntry* const entry = segment_->find(held, name);
  if (entry == nullptr) return nothing_of_that_name(name, this->name());
  if (auto may = check_permitted(*entry, Access::read_write, name); !may) return may;
  segment_->let_go(held, *entry);
  return {};
}

// Hands each part that `look` gives to `take`, until that says that it was the last. In between others can
// have the lock. Without the right to write a part may be looked at again.
template <class Look, class Take>
Result<void> ObjectPool::look_in_parts(Look look, Take take) const {
  const TimePoint until = look_until();
  for (bool first = true, more = true; more; first = false) {
    if (!segment_->writable()) {
      more = take(look_only(until, look));
      continue;
    }
    PLCHOST_TRY_ASSIGN(const auto held, segment_->lock(first));
    more = take(look());
  }
  return {};
}

void ObjectPool::withdraw_events(std::string_view instance) const noexcept {
  plchost::withdraw_events(segment_->view(), instance);
}

// First the table of references, then the objects.
Result<std::vector<ObjectInfo>> ObjectPool::list() const {
  constexpr std::size_t kReferences = 4096;
  constexpr std::size_t kObjects = 256;
  const PoolView& view = segment_->view();
  ObjectHolders holders;
  std::size_t place = 0;
  PLCHOST_TRY(look_in_parts([&] { return ObjectHolders::look_at(view, place, kReferences); },
                            [&](ObjectHolders::Part part) {
                              holders.add(std::move(part));
                              place += kReferences;
                              return place < view.used_references().size();
                            }));
  std::vector<ObjectInfo> all;
  std::size_t at = 0;
  const auto part = [&] {
    std::vector<ObjectInfo> infos;
    const auto used = view.used_entries();
    for (std::size_t i = at; i < std::min(at + kObjects, used.size()); ++i) {
      if (PoolTable::is_valid(used[i]) && !PoolTable::is_idle(used[i])) {
        infos.push_back(describe_object(view, used[i], holders, across_containers()));
      }
    }
    return infos;
  };
  PLCHOST_TRY(look_in_parts(part, [&](std::vector<ObjectInfo> infos) {
    std::ranges::move(infos, std::back_inserter(all));
    at += kObjects;
    return at < view.used_entries().size();
  }));
  number_as_seen(*segment_, all);
  return all;
}

Result<ObjectInfo> ObjectPool::look_at(std::string_view name) const {
  PLCHOST_TRY(check_object_name(name));
  const PoolView& view = segment_->view();
  const auto describe = [&](const ObjectEntry* entry) -> Result<ObjectInfo> {
    if (entry == nullptr || PoolTable::is_idle(*entry)) return nothing_of_that_name(name, this->name());
    return describe_object(view, *entry, ObjectHolders::of(view, *entry), across_containers());
  };
  const auto look = [&]() -> Result<ObjectInfo> {
    if (!segment_->writable()) {
      return look_only(look_until(), [&] { return describe(segment_->peek(name)); });
    }
    PLCHOST_TRY_ASSIGN(auto held, segment_->lock(true));
    return describe(segment_->find(held, name));
  };
  auto found = look();
  if (found) number_as_seen(*segment_, std::span(&*found, 1));
  return found;
}

}  // namespace plchost
