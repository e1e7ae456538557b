#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <string>
#include <string_view>
#include <unordered_map>
#include <utility>

#include "api/dds/guid.hpp"
#include "shm/base/names.hpp"
#include "shm/base/result.hpp"
#include "shm/pool/memory_file.hpp"

namespace plchost {

/// What became of posts. received = accepted + rejected + duplicate + early.
struct PostCounters {
  std::uint64_t received = 0;
  std::uint64_t accepted = 0;
  std::uint64_t no_task = 0;  ///< of those accepted
  std::uint64_t rejected = 0;
  std::uint64_t duplicate = 0;
  std::uint64_t early = 0;  ///< not taken, because one before it was missing
  std::uint64_t lost = 0;   ///< never came, and its source went on without it

  void add(const PostCounters& other) noexcept;
};

/// What is kept of one source of posts. In shared memory; all zero is a free entry.
struct LedgerEntry {
  std::array<std::uint8_t, 16> source{};
  std::atomic<std::uint32_t> in_use{0};  ///< written last
  std::int32_t rejected_code = 0;
  std::int64_t used_ns = 0;  ///< CLOCK_MONOTONIC of the last post: the oldest entry is given away first
  std::atomic<std::uint64_t> last{0};        ///< all posts up to this number are done
  std::atomic<std::uint64_t> batch{0};       ///< number of the batch whose events are being posted
  std::atomic<std::uint32_t> batch_done{0};  ///< as many of them are posted: the next server goes on there
  PostCounters counters;
  std::uint64_t rejected_sequence = 0;
  FixedText<255> rejected_text;
};

/// What a post's number says, seen from the last one that is done.
enum class PostOrder : std::uint8_t {
  next,       ///< do it
  duplicate,  ///< done before: acknowledge again
  gap,        ///< posts before it are missing: wait for them to be repeated
};
[[nodiscard]] constexpr PostOrder order_of(std::uint64_t sequence, std::uint64_t last) noexcept {
  if (sequence <= last) return PostOrder::duplicate;
  return sequence == last + 1 ? PostOrder::next : PostOrder::gap;
}

inline constexpr std::uint32_t kLedgerEntries = 1024;

/// How far each source of posts has come, in a shared memory of its own ("POOL.posts"), so that the
/// plchost-dds after a killed one neither loses nor repeats an acknowledged post. The one window: killed
/// between the post and the store into the ledger (two instructions and at most one futex wake apart), a post
/// that was not acknowledged yet is repeated by its client and so counted twice. One process at a time.
class PostLedger {
 public:
  /// Opens the ledger of a pool, or makes it anew if there is none or it is of another version.
  [[nodiscard]] static Result<PostLedger> open(std::string_view pool);
  [[nodiscard]] static std::string file_name(std::string_view pool);

  /// The entry of that source. A source that is not known gets a free entry, or that of the source that
  /// posted least recently: if it lives on, it starts anew at the base that its posts carry.
  [[nodiscard]] LedgerEntry& entry_for(const dds::Guid& source, std::int64_t now_ns);

  /// The same, of a source that is known; null: it is not.
  [[nodiscard]] const LedgerEntry* find(const dds::Guid& source) const;

  /// Each source that is known: `use(entry)`.
  template <class Function>
  void for_each(Function use) const {
    for (const auto& [source, index] : index_) use(std::as_const(entries()[index]));
  }
  /// Of all sources, those that were forgotten included.
  [[nodiscard]] PostCounters total() const noexcept;

  /// How many entries were given away while their source may have lived.
  [[nodiscard]] std::uint64_t reused() const noexcept { return reused_; }

 private:
  explicit PostLedger(MemoryFile memory);
  [[nodiscard]] LedgerEntry* entries() const noexcept;

  MemoryFile memory_;
  std::unordered_map<dds::Guid, std::uint32_t, dds::GuidHash> index_;
  std::uint32_t next_free_ = 0;  // all from here on are free
  std::uint64_t reused_ = 0;
};

}  // namespace plchost
