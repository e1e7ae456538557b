#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <utility>

#include "shm/base/seqlock.hpp"
#include "shm/base/time.hpp"
#include "shm/files/fixed_page.hpp"

namespace plchost {

/// The last `kCount` records of a numbered stream, in a shared memory that outlives its writers. A record
/// begins with its number, `sequence`, from 1 and without a gap.
template <class Record, std::size_t kCount>
struct RingLayout {
  std::uint64_t magic = 0;  ///< written last
  std::uint32_t version = 0;
  std::uint32_t size = 0;
  std::int64_t stream_unix_ns = 0;     ///< when the numbering began
  std::atomic<std::uint64_t> last{0};  ///< the last number that was given
  std::array<Seqlock<Record>, kCount> slots;
};

/// Such a ring, mapped. `Kind` is its PageKind.
template <class Record, std::size_t kCount, const PageKind& Kind>
class RingPage {
 public:
  using Layout = RingLayout<Record, kCount>;
  static_assert(offsetof(Record, sequence) == 0);

  /// A ring that has counted so far was written by a stranger.
  static constexpr std::uint64_t kMaxSequence = std::numeric_limits<std::int64_t>::max();

  /// Continues the ring that is there, or makes one in the place of whatever has its name. Set-up.
  [[nodiscard]] static Result<RingPage> open(const std::string& name, const PageRights& rights = {}) {
    auto ring = of(open_or_make_page<Layout>(name, Kind, Replaces::anything, begin, rights));
    return ring && ring->last() > kMaxSequence ? renew(name, rights) : std::move(ring);
  }
  /// A new ring in the place of the one of that name. Set-up.
  [[nodiscard]] static Result<RingPage> renew(const std::string& name, const PageRights& rights = {}) {
    return of(MemoryFile::replace(name, sizeof(Layout), new_page<Layout>(Kind, begin), rights.memory));
  }
  /// not_found: there is none yet. corrupt: not such a ring. Set-up.
  [[nodiscard]] static Result<RingPage> open_to_read(const std::string& name) {
    return of(open_fixed_page<Layout>(name, Kind, MemoryFile::Access::read_only));
  }

  [[nodiscard]] Layout& layout() const noexcept { return *reinterpret_cast<Layout*>(memory_.bytes().data()); }
  [[nodiscard]] std::uint64_t last() const noexcept { return layout().last.load(std::memory_order_acquire); }
  [[nodiscard]] bool lost() const noexcept { return memory_.lost(); }

  /// Into the slot of its number. A writer that ended in here is no obstacle.
  void put(const Record& record) const noexcept {
    auto& slot = layout().slots[record.sequence % kCount];
    slot.recover();
    slot.write(record);
  }
  /// Nothing: it is being written, was overtaken, or never written.
  [[nodiscard]] std::optional<Record> get(std::uint64_t number) const noexcept {
    auto found = layout().slots[number % kCount].read();
    return found && found->sequence == number ? found : std::nullopt;
  }
  /// The oldest number that is kept when `last` is the newest.
  [[nodiscard]] static std::uint64_t oldest(std::uint64_t last) noexcept {
    return last > kCount ? last - kCount + 1 : 1;
  }

 private:
  explicit RingPage(MemoryFile memory) noexcept : memory_(std::move(memory)) {}
  [[nodiscard]] static Result<RingPage> of(Result<MemoryFile> memory) {
    PLCHOST_TRY(memory);
    return RingPage(*std::move(memory));
  }
  static void begin(Layout& ring) noexcept { ring.stream_unix_ns = unix_time_ns(); }

  MemoryFile memory_;
};

}  // namespace plchost
