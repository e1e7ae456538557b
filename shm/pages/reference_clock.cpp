#include "shm/pages/reference_clock.hpp"

#include <cstddef>
#include <utility>

#include <fmt/format.h>
#include <sys/stat.h>

#include "shm/base/names.hpp"
#include "shm/files/open_or_make.hpp"
#include "shm/files/pool_files.hpp"

namespace plchost {

namespace {

static_assert(sizeof(plc_reference_clock) == 64);
static_assert(offsetof(plc_reference_clock, version) == 8 && offsetof(plc_reference_clock, size) == 12);
static_assert(offsetof(plc_reference_clock, sequence) == 16 && offsetof(plc_reference_clock, check) == 56);

plc_reference_clock& record_of(std::span<std::byte> bytes) noexcept {
  return *reinterpret_cast<plc_reference_clock*>(bytes.data());
}

Result<void> begin(std::span<std::byte> bytes) {
  plc_reference_clock_begin(&record_of(bytes));
  return {};
}

// Firmware that makes the record gives it its name first and its size then; two who do so at once do the
// same. A stranger who has emptied the file has made such a one.
Result<MemoryFile> open_or_make_record(const std::string& name, const OwnerCheck& owners) {
  const auto open = [&]() -> Result<MemoryFile> {
    PLCHOST_TRY(MemoryFile::fill_empty(name, sizeof(plc_reference_clock), owners));
    return MemoryFile::open(name, 1, MemoryFile::Access::read_write, owners);
  };
  const auto make = [&](bool /*replace*/) {
    return MemoryFile::create(name, sizeof(plc_reference_clock), begin);
  };
  return open_or_make(open, make, Replaces::nothing);
}

}  // namespace

Result<void> check_reference_name(std::string_view name) {
  return check_name("name of a reference clock", name, kMaxObjectName);
}

Result<ReferenceClockRecord> ReferenceClockRecord::open(std::string_view pool, std::string_view name) {
  PLCHOST_TRY(check_reference_name(name));
  const std::string file = pool_memory_name(pool, name);
  const auto may_own = [&](uid_t user) { return may_own_memory(pool, user); };
  PLCHOST_TRY_ASSIGN(auto memory,
                     in_step(fmt::format("reference clock '{}'", name), open_or_make_record(file, may_own)));
  const auto refused = [&] {
    return failure(ErrorCode::corrupt,
                   fmt::format("reference clock '{}': shared memory {} is no reference record of version {}; "
                               "remove it, or choose another name",
                               name, file, PLC_REFERENCE_CLOCK_VERSION));
  };
  if (memory.bytes().size() != sizeof(plc_reference_clock)) return refused();
  const Identity identity = identity_of(file);
  ReferenceClockRecord opened(std::move(memory), file, identity);
  plc_reference_clock& record = opened.record();
  // Made by firmware that ended before it had written the first line, or emptied by a stranger.
  if (__atomic_load_n(&record.magic, __ATOMIC_ACQUIRE) == 0) plc_reference_clock_begin(&record);
  if (plc_reference_clock_is_one(&record) == 0) return refused();
  return opened;
}

void ReferenceClockRecord::remove(std::string_view pool, std::string_view name) noexcept {
  MemoryFile::remove(pool_memory_name(pool, name));
}

plc_reference_clock& ReferenceClockRecord::record() const noexcept {
  return record_of(memory_.bytes());
}

bool ReferenceClockRecord::gone() const noexcept {
  if (memory_.lost() || plc_reference_clock_is_one(&record()) == 0) return true;
  return identity_ == Identity{} || identity_of(file_) != identity_;
}

auto ReferenceClockRecord::identity_of(const std::string& file) noexcept -> Identity {
  struct stat status{};
  if (::stat(MemoryFile::path(file).c_str(), &status) != 0) return {};
  return {.device = status.st_dev, .inode = status.st_ino, .size = status.st_size};
}

}  // namespace plchost
