#include "shm/pool/pool_header.hpp"

#include <new>

#include <fmt/format.h>

#include "shm/base/time.hpp"
#include "shm/files/memory_file.hpp"
#include "shm/threads/process_start.hpp"

namespace plchost {

namespace {

bool is_known(std::uint32_t version) noexcept {
  return version == kPoolVersion || version == kPoolVersionAcross;
}

}  // namespace

// The constants of a pool. Not by describe_page(): the header says them twice, for a process that attaches
// after a stranger has written over one of the two.
void write_pool_constants(PoolHeader& header, std::uint32_t version, std::uint32_t max_objects,
                          std::uint64_t pid_namespace) noexcept {
  header.version = version;
  header.entry_size = sizeof(ObjectEntry);
  header.size = pool_size(max_objects);
  header.max_objects = max_objects;
  header.bucket_count = bucket_count_for(max_objects);
  header.max_clients = kMaxClients;
  header.max_references = max_references_for(max_objects);
  header.pid_namespace = pid_namespace;
  header.pid_namespace_again = pid_namespace;
  header.version_again = version;
  header.max_objects_again = max_objects;
  header.magic_again.store(kPoolMagic, kRelaxed);
  header.magic.store(kPoolMagic, std::memory_order_release);
}

// Zero-filled memory holds an empty table already; only the header has something to say.
Result<void> fill_pool_header(std::span<std::byte> bytes, const PoolOptions& options,
                              std::uint64_t locks_file) {
  auto& header = *new (bytes.data()) PoolHeader{};
  const std::uint32_t version = options.across_containers ? kPoolVersionAcross : kPoolVersion;
  write_pool_constants(header, version, options.max_objects,
                       options.across_containers ? locks_file : pid_namespace());
  // Somewhere, so that the small numbers that a stranger may write over a mutex are no client's.
  const auto now = static_cast<std::uint64_t>(MonotonicClock::now().time_since_epoch().count());
  constexpr std::uint64_t kMix = 0x9e3779b97f4a7c15;
  if (options.across_containers) header.client_numbers = static_cast<std::uint32_t>((now * kMix) >> 34U);
  return {};
}

Result<void> check_pool_header(const PoolHeader& header, std::uint32_t max_objects, std::size_t file_size,
                               const std::string& name) {
  if (!is_known(header.version)) {
    return failure(
        ErrorCode::corrupt,
        fmt::format("pool '{}' has version {}, this program needs {}, or {} across containers; stop all "
                    "processes that use it, and remove it",
                    name, header.version, kPoolVersion, kPoolVersionAcross));
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

// A stranger who writes over one of both seldom does over the other.
bool is_pool_sound_again(const PoolHeader& header, std::uint32_t max_objects,
                         std::size_t file_size) noexcept {
  return header.magic_again.load(kRelaxed) == kPoolMagic && is_known(header.version_again) &&
         max_objects >= kMinObjects && max_objects <= kMaxObjects && file_size == pool_size(max_objects);
}

// In another namespace each client would look dead to the others, and what it holds would be taken from it.
Result<void> check_pid_namespace(const PoolHeader& header, const std::string& name) {
  const std::uint64_t ours = pid_namespace();
  const std::uint64_t theirs = header.pid_namespace;
  if (theirs == ours || header.pid_namespace_again == ours) return {};
  return failure(
      ErrorCode::refused,
      fmt::format(
          "pool '{}' was made in PID namespace {}, this process is in {}: it is not for several containers. "
          "Start this process in the namespace of the others (of a container: --pid=host). Or set [host] "
          "pool_across_containers = true, stop the manager and all programs that use the pool, remove {} and "
          "start the manager",
          name, theirs, ours, MemoryFile::path(name)));
}

// A stranger who has written over the version of a pool has not done so in both places.
bool is_pool_across(const PoolHeader& header, std::size_t file_size) noexcept {
  const bool again = is_pool_sound_again(header, header.max_objects_again, file_size);
  return (again ? header.version_again : header.version) == kPoolVersionAcross;
}

}  // namespace plchost
