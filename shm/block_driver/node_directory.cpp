#include "shm/block_driver/node_directory.hpp"

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <thread>

#include <fmt/format.h>
#include <unistd.h>

#include "shm/block_driver/directory_lock.hpp"
#include "shm/files/fixed_page.hpp"
#include "shm/files/pool_files.hpp"
#include "shm/threads/process_start.hpp"

namespace plchost {

namespace {

std::string directory_name(std::string_view pool, std::string_view base) {
  return pool_memory_name(pool, base);
}

Result<void> fill_directory(std::span<std::byte> bytes) {
  auto& layout = *reinterpret_cast<DirectoryLayout*>(bytes.data());
  layout.slot_count = kMaxNodes;
  describe_page(layout, kDirectoryKind);
  return {};
}

Result<MemoryFile> open_or_make_directory(const std::string& name) {
  const auto open = [&] {
    return MemoryFile::open(name, sizeof(DirectoryLayout), MemoryFile::Access::read_write);
  };
  const auto make = [&](bool replace) {
    return replace ? MemoryFile::replace(name, sizeof(DirectoryLayout), fill_directory)
                   : MemoryFile::create(name, sizeof(DirectoryLayout), fill_directory);
  };
  // Foreign files and non-files of this name are replaced. A header is mended below.
  return open_or_make(open, make, Replaces::foreign);
}

// No check_name(): its error is a text, and this is read in cycles.
bool is_sane(const NodeRecord& record) noexcept {
  const std::string_view name = record.name.view();
  const bool printable = std::ranges::all_of(name, [](char c) { return c > ' ' && c <= '~'; });
  return record.process.pid > 0 && record.generation != 0 && !name.empty() && printable;
}

DirectoryLayout& directory_in(const MemoryFile& file) noexcept {
  return *reinterpret_cast<DirectoryLayout*>(file.bytes().data());
}

bool has_good_header(const DirectoryLayout& layout) noexcept {
  return is_described(layout, kDirectoryKind) && layout.slot_count == kMaxNodes;
}

bool is_locked_in(const NodeRecord& record, const NodeLocks* locks) noexcept {
  return locks != nullptr && record.locks_file == locks->file();
}

bool has_live_node(const DirectoryLayout& layout, const NodeLocks& locks) noexcept {
  for (std::uint16_t node = 1; node <= kMaxNodes; ++node) {
    if (locks.is_taken(node)) return true;
    const auto record = layout.slots[node - 1U].record.read();
    if (!record || !is_sane(*record) || is_locked_in(*record, &locks)) continue;
    // Of a version before only the number of the process lies where it does now.
    if (!process_has_ended({.pid = record->process.pid}, ProcessLook::quick)) return true;
  }
  return false;
}

Result<void> check_directory(const MemoryFile& file, const std::string& name) {
  if (has_good_header(directory_in(file)) && file.bytes().size() == sizeof(DirectoryLayout)) return {};
  return failure(
      ErrorCode::corrupt,
      fmt::format(
          "shared memory '{}' is no directory of nodes of version {}; stop all processes that use it, and "
          "remove it, or choose another [CmpBlkDrvShm] BaseName",
          name, kDirectoryKind.version));
}

// A stranger may have written over it. Nodes that run write it again within a second; without them it is
// nobody's, and we do. Nodes that do not are of another version.
Result<void> mend_header(const MemoryFile& file, const std::string& name, const NodeLocks& locks) {
  constexpr auto kMendPatience = std::chrono::milliseconds(1500);
  if (file.bytes().size() != sizeof(DirectoryLayout)) return check_directory(file, name);
  const TimePoint deadline = MonotonicClock::now() + kMendPatience;
  while (!has_good_header(directory_in(file))) {
    PLCHOST_TRY_ASSIGN(const auto lock, DirectoryLock::acquire(name));
    if (!has_live_node(directory_in(file), locks)) return fill_directory(file.bytes());
    if (MonotonicClock::now() >= deadline) return check_directory(file, name);
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  return {};
}

Result<void> check_base(std::string_view base) {
  return check_name("[CmpBlkDrvShm] BaseName", base, kMaxBlockBase);
}

}  // namespace

Result<NodeDirectory> NodeDirectory::open(std::string_view pool, std::string_view base) {
  PLCHOST_TRY(check_base(base));
  const std::string name = directory_name(pool, base);
  PLCHOST_TRY_ASSIGN(auto file, in_step("directory of nodes", open_or_make_directory(name)));
  PLCHOST_TRY_ASSIGN(auto locks, in_step("directory of nodes", NodeLocks::open(name)));
  PLCHOST_TRY(mend_header(file, name, *locks));
  return NodeDirectory(std::string(pool), std::string(base), std::move(file), std::move(locks));
}

Result<NodeDirectory> NodeDirectory::open_to_read(std::string_view pool, std::string_view base) {
  PLCHOST_TRY(check_base(base));
  const std::string name = directory_name(pool, base);
  PLCHOST_TRY_ASSIGN(auto file,
                     in_step("directory of nodes",
                             MemoryFile::open(name, sizeof(DirectoryLayout), MemoryFile::Access::read_only)));
  PLCHOST_TRY(check_directory(file, name));
  return NodeDirectory(std::string(pool), std::string(base), std::move(file), nullptr);
}

void NodeDirectory::remove(std::string_view pool, std::string_view base) noexcept {
  const std::string name = directory_name(pool, base);
  const std::string links = name + ".";
  std::error_code error;
  for (std::filesystem::directory_iterator entry(MemoryFile::kDirectory, error), end; !error && entry != end;
       entry.increment(error)) {
    const std::string file = entry->path().filename();
    if (file.starts_with(links)) MemoryFile::remove(file);
  }
  MemoryFile::remove(name);
  NodeLocks::remove(name);
}

DirectoryLayout& NodeDirectory::layout() const noexcept {
  return directory_in(file_);
}

std::optional<NodeRecord> NodeDirectory::record(std::uint16_t node) const noexcept {
  const auto record = slot(node).record.read();
  if (!record || !is_sane(*record)) return std::nullopt;
  return record;
}

std::optional<std::uint16_t> NodeDirectory::find(std::string_view name) const noexcept {
  for (std::uint16_t node = 1; node <= kMaxNodes; ++node) {
    const auto found = record(node);
    if (found && found->name.view() == name) return node;
  }
  return std::nullopt;
}

void NodeDirectory::announce() noexcept {
  layout().changes.fetch_add(1, std::memory_order_release);
  for (std::uint16_t node = 1; node <= kMaxNodes; ++node) {
    if (record(node)) slot(node).work.post();
  }
}

Result<std::uint16_t> NodeDirectory::choose(const NodeEntry& entry) const {
  if (const auto namesake = find(entry.name)) {
    return failure(ErrorCode::already_exists,
                   fmt::format("node name '{}' is taken: {} has it, with address {}", entry.name,
                               owner_text(*namesake), *namesake));
  }
  if (entry.forced_address == 0) return choose_free(entry.name);
  if (entry.forced_address > kMaxNodes) {
    return failure(ErrorCode::invalid_argument, fmt::format("node address {} is not possible: 1 to {} are",
                                                            entry.forced_address, kMaxNodes));
  }
  if (const auto owner = record(entry.forced_address)) {
    return failure(ErrorCode::already_exists,
                   fmt::format("node address {} is taken: node '{}', {}, has it", entry.forced_address,
                               owner->name.view(), owner_text(entry.forced_address)));
  }
  if (!is_free(entry.forced_address)) {
    return failure(
        ErrorCode::already_exists,
        fmt::format("node address {} is taken: {} has it, whose record another program has wiped out",
                    entry.forced_address, owner_text(entry.forced_address)));
  }
  return entry.forced_address;
}

// Low numbers are the ones that people force, so the others come from the upper half first; among them from
// those that nobody has had.
Result<std::uint16_t> NodeDirectory::choose_free(std::string_view name) const {
  std::uint16_t best = 0;
  int best_rank = 0;
  for (std::uint16_t node = 1; node <= kMaxNodes; ++node) {
    if (!is_free(node)) continue;
    const auto last = slot(node).record.read();
    if (last && last->name.view() == name) return node;
    const bool never_used = last && last->generation == 0;
    const int rank = 1 + (node > kMaxNodes / 2 ? 2 : 0) + (never_used ? 1 : 0);
    if (rank > best_rank) {
      best = node;
      best_rank = rank;
    }
  }
  if (best != 0) return best;
  return failure(ErrorCode::full, fmt::format("all {} node addresses are taken", kMaxNodes));
}

std::shared_ptr<NodeLocks> NodeDirectory::locks() const {
  return locks_ != nullptr ? locks_ : NodeLocks::find(directory_name(pool_, base_));
}

std::string NodeDirectory::owner_text(std::uint16_t node) const {
  const auto known = record(node);
  const auto locks = this->locks();
  if (known && !is_locked_in(*known, locks.get())) return fmt::format("process {}", known->process.pid);
  const auto holder = locks != nullptr ? locks->holder(node) : std::nullopt;
  if (!holder) return "a process that has just ended";
  return holder->pid > 0 ? fmt::format("process {}", holder->pid) : "a process of another container";
}

bool NodeDirectory::has_ended(std::uint16_t node, ProcessLook look) const {
  const auto known = record(node);
  if (!known) return false;
  const auto locks = this->locks();
  return is_locked_in(*known, locks.get()) ? !locks->is_taken(node) : process_has_ended(known->process, look);
}

void NodeDirectory::write(std::uint16_t node, const NodeRecord& record) noexcept {
  slot(node).record.recover();  // the writer before may have ended in here
  slot(node).record.write(record);
}

void NodeDirectory::remove_links(std::uint16_t node) const noexcept {
  for (std::uint16_t other = 1; other <= kMaxNodes; ++other) {
    MemoryFile::remove(link(node, other));
    MemoryFile::remove(link(other, node));
  }
}

bool NodeDirectory::reclaim_one(std::uint16_t node) {
  slot(node).record.recover();
  auto owner = record(node);
  if (!owner || !has_ended(node)) return false;
  owner->process = {};
  write(node, *owner);
  remove_links(node);
  return true;
}

std::uint32_t NodeDirectory::reclaim_locked() {
  std::uint32_t count = 0;
  for (std::uint16_t node = 1; node <= kMaxNodes; ++node) {
    if (reclaim_one(node)) ++count;
  }
  return count;
}

std::uint32_t NodeDirectory::reclaim() {
  const auto lock = DirectoryLock::acquire(directory_name(pool_, base_));
  if (!lock) return 0;
  const std::uint32_t count = reclaim_locked();
  if (count > 0) announce();
  return count;
}

namespace {

NodeRecord record_of(const NodeEntry& entry, std::uint32_t generation, std::uint32_t locks_file) {
  NodeRecord record;
  record.name.assign(entry.name);
  record.process = this_process();
  record.generation = generation;
  record.locks_file = locks_file;
  record.forwards = entry.forwards ? 1 : 0;
  record.queue_slots = entry.queue_slots;
  std::copy_n(entry.hosts.begin(), std::min(entry.hosts.size(), kMaxHostRanges), record.hosts.begin());
  return record;
}

bool is_same(const NodeRecord& one, const NodeRecord& other) {
  return one.name.view() == other.name.view() && one.process == other.process &&
         one.generation == other.generation && one.locks_file == other.locks_file &&
         one.forwards == other.forwards && one.queue_slots == other.queue_slots && one.hosts == other.hosts;
}

}  // namespace

Result<NodeLife> NodeDirectory::join(const NodeEntry& entry) {
  PLCHOST_TRY(check_name("node name", entry.name, kMaxInstanceName));
  if (!is_ring_size(entry.queue_slots)) {
    return failure(ErrorCode::invalid_argument,
                   fmt::format("queues of {} slots are not possible: a power of two from {} to {} is",
                               entry.queue_slots, kMinRingSlots, kMaxRingSlots));
  }
  PLCHOST_TRY_ASSIGN(const auto lock, in_step("cannot join the directory of nodes",
                                              DirectoryLock::acquire(directory_name(pool_, base_))));
  reclaim_locked();
  PLCHOST_TRY_ASSIGN(const auto node, choose(entry));
  if (!locks_->take(node)) {
    return failure(ErrorCode::busy,
                   fmt::format("node address {} cannot be locked: {} has it", node, owner_text(node)));
  }
  NodeSlot& place = slot(node);
  std::uint32_t generation = place.record.read().value_or(NodeRecord{}).generation + 1;
  if (generation == 0) ++generation;
  remove_links(node);
  for (auto& word : place.incoming) word.store(0, std::memory_order_relaxed);
  for (auto& word : place.neighbours) word.store(0, std::memory_order_relaxed);
  write(node, record_of(entry, generation, locks_->file()));
  announce();
  return NodeLife{.node = node, .generation = generation};
}

void NodeDirectory::leave(const NodeLife& life) {
  const auto lock = DirectoryLock::acquire(directory_name(pool_, base_));
  auto owner = record(life.node);
  // Without the lock it is left to the others, who find that the process has ended.
  if (!lock || !owner || owner->process.pid != ::getpid() || owner->generation != life.generation) return;
  owner->process = {};
  write(life.node, *owner);
  remove_links(life.node);
  locks_->give_back(life.node);
  announce();
}

Result<void> NodeDirectory::keep(const NodeLife& life, const NodeEntry& entry) {
  if (!has_good_header(layout())) (void)fill_directory(file_.bytes());
  if (!locks_->take(life.node)) {
    return failure(
        ErrorCode::busy,
        fmt::format("node '{}' may have lost its address {}: this program has closed {}, by whose "
                    "lock others see that it runs. Start it again",
                    entry.name, life.node, MemoryFile::path(node_locks_name(directory_name(pool_, base_)))));
  }
  const NodeRecord wanted = record_of(entry, life.generation, locks_->file());
  const auto is_ours = [&](const std::optional<NodeRecord>& owner) {
    return owner && is_same(*owner, wanted);
  };
  if (is_ours(record(life.node))) return {};
  const auto held = DirectoryLock::acquire(directory_name(pool_, base_));
  if (!held || is_ours(record(life.node))) return {};
  write(life.node, wanted);
  announce();
  return {};
}

}  // namespace plchost
