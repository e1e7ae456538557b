#include "shm/pool/pool_adoption.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <thread>
#include <vector>

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include "shm/base/unique_fd.hpp"
#include "shm/files/pool_files.hpp"
#include "shm/plc_process_image.h"
#include "shm/plc_reference_clock.h"
#include "shm/pool/pool_table.hpp"

namespace plchost {

namespace {

static_assert(PLC_IMAGE_MAX_NAME == kMaxObjectName);

/// The kind of a memory's file.
struct MemoryFileState {
  enum class Kind : std::uint8_t {
    none,        ///< nothing, or nothing to be read
    empty,       ///< just being made, or emptied by a stranger
    unfinished,  ///< just being made: it does not say yet what it is
    described,   ///< says what it is, and has the size for it
    of_blocks,   ///< of CmpBlkDrvShm, which keeps it without an entry
    other,
  };
  Kind kind = Kind::none;
  struct stat status{};
};
using Kind = MemoryFileState::Kind;

std::string path_in_memory(std::string_view file) {
  return MemoryFile::path(file);
}

bool is_image(const plc_image_header& header, std::uint64_t file_size) noexcept {
  if (header.size == 0 || header.size > PLC_IMAGE_MAX_SIZE) return false;
  const auto size = static_cast<unsigned>(header.size);
  return plc_image_is_one(&header, size) != 0 && file_size == plc_image_bytes(size);
}

bool is_reference_clock(const plc_reference_clock& record, std::uint64_t file_size) noexcept {
  return plc_reference_clock_is_one(&record) != 0 && file_size == sizeof(record);
}

// Read, not mapped: it may be cut short meanwhile.
MemoryFileState examine(const std::string& path) {
  MemoryFileState state;
  const UniqueFd fd(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK));
  if (!fd) {
    if (errno != ENOENT && ::lstat(path.c_str(), &state.status) == 0) state.kind = Kind::other;
    return state;
  }
  if (::fstat(fd.get(), &state.status) != 0) return state;
  state.kind = Kind::other;
  if (!S_ISREG(state.status.st_mode)) return state;
  std::array<char, std::max(sizeof(plc_image_header), sizeof(plc_reference_clock))> begin{};
  if (::pread(fd.get(), begin.data(), begin.size(), 0) < 0) return state;
  plc_image_header image{};
  plc_reference_clock clock{};
  std::memcpy(&image, begin.data(), sizeof(image));
  std::memcpy(&clock, begin.data(), sizeof(clock));
  const auto size = static_cast<std::uint64_t>(state.status.st_size);
  // The beginning of its magic numbers.
  constexpr std::string_view kOfBlocks = "pblk";
  if (size == 0) {
    state.kind = Kind::empty;
  } else if (std::string_view(begin.data(), kOfBlocks.size()) == kOfBlocks) {
    state.kind = Kind::of_blocks;
  } else if (image.magic == 0) {
    state.kind = Kind::unfinished;
  } else if (is_image(image, size) || is_reference_clock(clock, size)) {
    state.kind = Kind::described;
  }
  return state;
}

MemoryFileState examine_patiently(const std::string& path) {
  constexpr auto kPatience = std::chrono::milliseconds(20);
  const TimePoint deadline = MonotonicClock::now() + kPatience;
  for (;;) {
    MemoryFileState state = examine(path);
    const bool on_its_way = state.kind == Kind::empty || state.kind == Kind::unfinished;
    if (!on_its_way || MonotonicClock::now() >= deadline) return state;
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
}

bool can_be_adopted(const MemoryFileState& state, const std::string& pool) {
  return state.kind == Kind::described && may_write_pool(pool, state.status.st_uid);
}

bool is_memory(const ObjectEntry& entry) noexcept {
  return entry.type.load(kRelaxed) == static_cast<std::uint32_t>(ObjectType::memory);
}

constexpr mode_t kPermissions = 0777;

void describe_as(ObjectEntry& entry, const struct stat& status, std::uint32_t attributes) noexcept {
  entry.attributes.store(attributes, kRelaxed);
  entry.size.store(static_cast<std::uint64_t>(status.st_size), kRelaxed);
  entry.owner.store(status.st_uid, kRelaxed);
  entry.group.store(status.st_gid, kRelaxed);
  entry.mode.store(status.st_mode & kPermissions, kRelaxed);
}

// As adopted from its first steps: of a memory that is half made a repair would remove the file.
bool adopt(PoolSegment& segment, PoolLock& held, std::string_view name, const MemoryFileState& state) {
  PoolTable objects = segment.table(held);
  ObjectEntry* const entry = objects.insert(name, ObjectType::event);
  if (entry == nullptr) return false;
  describe_as(*entry, state.status, kKept | kAdopted);
  entry->type.store(static_cast<std::uint32_t>(ObjectType::memory), kRelaxed);
  objects.publish(*entry);
  return true;
}

// `foreign`: it is there, of a user who may not write the pool.
bool set_right(PoolSegment& segment, PoolLock& held, std::string_view name, const MemoryFileState& state,
               bool adoptable, bool foreign) {
  ObjectEntry* const entry = segment.find(held, name);
  if (entry == nullptr) return adoptable && adopt(segment, held, name, state);
  if (!is_memory(*entry)) return false;
  if (PoolAdoption::is_left_over(*entry)) return false;
  const bool same_owner = entry->owner.load(kRelaxed) == state.status.st_uid;
  if (state.kind == Kind::none || state.kind == Kind::empty || (foreign && !same_owner)) {
    segment.destroy(held, *entry);
    return true;
  }
  const bool same_size = entry->size.load(kRelaxed) == static_cast<std::uint64_t>(state.status.st_size);
  if (!adoptable || (same_size && same_owner)) return false;
  segment.table(held).erase(*entry);
  return adopt(segment, held, name, state);
}

}  // namespace

bool PoolAdoption::is_left_over(const ObjectEntry& entry) noexcept {
  return PoolTable::is_valid(entry) && is_memory(entry) && PoolTable::is_idle(entry);
}

bool PoolAdoption::is_for_adoption(const std::string& path, const std::string& pool) {
  return can_be_adopted(examine(path), pool);
}

bool PoolAdoption::is_in_use(const std::string& path, const std::string& pool) {
  const MemoryFileState state = examine(path);
  const bool of_blocks = state.kind == Kind::of_blocks && may_write_pool(pool, state.status.st_uid);
  return of_blocks || can_be_adopted(state, pool);
}

bool PoolAdoption::reconcile(PoolSegment& segment, std::string_view name) {
  if (!segment.writable()) return false;
  const std::string path = path_in_memory(pool_memory_name(segment.name(), name));
  const MemoryFileState before = examine_patiently(path);
  const ObjectEntry* const known = segment.peek(name);
  const bool there = before.kind != Kind::none;
  const bool welcome = there && may_write_pool(segment.name(), before.status.st_uid);
  const bool adoptable = welcome && before.kind == Kind::described;
  if (known == nullptr && !adoptable) return false;
  auto held = segment.lock();
  if (!held) return false;
  const MemoryFileState now = examine(path);
  const bool same_owner = now.status.st_uid == before.status.st_uid;
  return set_right(segment, *held, name, now, adoptable && same_owner && now.kind == Kind::described,
                   there && !welcome && same_owner && now.kind != Kind::none);
}

Result<ObjectEntry*> PoolAdoption::use_again(PoolSegment& segment, PoolLock& held, ObjectEntry& entry,
                                             std::size_t size, const MemoryRights& rights,
                                             std::uint32_t attributes) {
  const std::string name(entry.name.view());
  segment.destroy(held, entry);
  ObjectEntry* const left = segment.find(held, name);
  if (left == nullptr) return left;
  const std::string path = path_in_memory(pool_memory_name(segment.name(), name));
  const UniqueFd fd(::open(path.c_str(), O_RDWR | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK));
  struct stat status{};
  const bool same_rights = fd && ::fstat(fd.get(), &status) == 0 && S_ISREG(status.st_mode) &&
                           (status.st_mode & kPermissions) == rights.mode &&
                           status.st_gid == rights.group.value_or(::getegid());
  if (!same_rights) {
    return failure(
        ErrorCode::refused,
        fmt::format("memory '{}': {} is left of user {}, and {} is sticky: only that user, root, or a "
                    "manager that runs as root can remove it. Choose another name, or wait for that: such a "
                    "manager does it within a second",
                    name, path, left->owner.load(kRelaxed), MemoryFile::kDirectory));
  }
  if (::ftruncate(fd.get(), 0) != 0) return failure(ErrorCode::system, "cannot empty " + path, errno);
  if (const int error = ::posix_fallocate(fd.get(), 0, static_cast<off_t>(size)); error != 0) {
    return failure(ErrorCode::full, fmt::format("{} bytes of shared memory for {}", size, path), error);
  }
  if (::fstat(fd.get(), &status) != 0) return failure(ErrorCode::system, "cannot examine " + path, errno);
  describe_as(*left, status, attributes);
  return left;
}

// A folder that has not changed is not looked at again. The time of a change is exact only to some ms, and a
// file is complete only some time after its name is there.
void PoolAdoption::look_at_files() {
  constexpr int kNamesAtOnce = 4000;
  constexpr std::int64_t kSettledAfterS = 2;
  if (!folder_) {
    struct stat status{};
    timespec now{};
    if (::stat(MemoryFile::kDirectory, &status) != 0) return;
    ::clock_gettime(CLOCK_REALTIME_COARSE, &now);
    const bool seen = status.st_mtim.tv_sec == changed_.tv_sec && status.st_mtim.tv_nsec == changed_.tv_nsec;
    if (seen && now.tv_sec - changed_.tv_sec > kSettledAfterS) return;
    changed_ = status.st_mtim;
    folder_.reset(::opendir(MemoryFile::kDirectory));
    if (!folder_) return;
  }
  for (int i = 0; i < kNamesAtOnce; ++i) {
    // NOLINTNEXTLINE(concurrency-mt-unsafe): nobody else reads this stream
    const dirent* const file = ::readdir(folder_.get());
    if (file == nullptr) {
      folder_.reset();
      return;
    }
    const auto name = memory_of_file(segment_->name(), static_cast<const char*>(file->d_name));
    if (!name || segment_->peek(*name) != nullptr) continue;
    if (is_for_adoption(path_in_memory(static_cast<const char*>(file->d_name)), segment_->name())) {
      (void)reconcile(*segment_, *name);
    }
  }
}

std::vector<ObjectEntry*> PoolAdoption::look_at_entries() {
  constexpr std::size_t kEntriesAtOnce = 20'000;
  std::vector<ObjectEntry*> left_over;
  const auto used = segment_->view().used_entries();
  if (next_entry_ >= used.size()) next_entry_ = 0;
  const std::size_t end = std::min(used.size(), next_entry_ + kEntriesAtOnce);
  for (; next_entry_ < end; ++next_entry_) {
    if (is_left_over(used[next_entry_])) left_over.push_back(&used[next_entry_]);
  }
  return left_over;
}

}  // namespace plchost
