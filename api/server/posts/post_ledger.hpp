#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <unordered_map>

#include "api/dds/guid.hpp"
#include "api/server/posts/post_intent.hpp"
#include "api/server/posts/source_state.hpp"
#include "shm/base/names.hpp"
#include "shm/base/result.hpp"
#include "shm/files/memory_file.hpp"
#include "shm/pool/object_pool.hpp"

namespace plchost {

/// The record of one source of posts. In shared memory; all zero is a free entry.
struct LedgerEntry {
  std::array<std::uint8_t, 16> source{};
  std::atomic<std::uint32_t> in_use{0};  ///< written last
  std::uint32_t audited = 0;             ///< so many accepted posts are in the audit log, modulo 2^32
  std::int64_t used_ns = 0;  ///< CLOCK_MONOTONIC of the last post: the oldest entry is given away first
  KeptState kept;
  FixedText<255> rejected_text;

  [[nodiscard]] const SourceState& state() const noexcept { return kept.state(); }
};

/// The greatest number of a post. Beyond it the numbers would come to an end, where no post is the next one.
inline constexpr std::uint64_t kMaxPostNumber = ~std::uint64_t{0} >> 1U;

/// The meaning of a post's number, seen from the last one that is done.
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

/// How far each source of posts has come, in a shared memory of its own ("POOL.posts"). So the plchost-dds
/// after a killed one neither loses nor repeats a post, whichever instruction the kill hits (PostIntent says
/// how). One process at a time: it holds the ledger's mutex. Used by one thread at a time; opened and
/// destroyed by the same one.
class PostLedger {
 public:
  /// Opens the ledger of a pool, or makes it anew if there is none or it is of another version. Does what a
  /// killed process has left to do. busy: another process has it, also after some seconds.
  [[nodiscard]] static Result<PostLedger> open(const ObjectPool& pool);
  PostLedger(PostLedger&& other) noexcept = default;
  PostLedger& operator=(PostLedger&&) = delete;
  PostLedger(const PostLedger&) = delete;
  PostLedger& operator=(const PostLedger&) = delete;
  ~PostLedger();
  [[nodiscard]] static std::string file_name(std::string_view pool);

  /// The entry of that source. A source that is not known gets a free entry, or that of the source that
  /// posted least recently. If that one runs on, it starts anew at the base that its posts carry.
  [[nodiscard]] LedgerEntry& entry_for(const dds::Guid& source, std::int64_t now_ns);

  /// The same, of a source that is known; null: it is not.
  [[nodiscard]] const LedgerEntry* find(const dds::Guid& source) const;

  /// So many accepted posts of the source are in the audit log. Does nothing for one that is not known.
  void set_audited(const dds::Guid& source, std::uint64_t accepted) noexcept;

  /// This is the record of the source from now on. The entry is one of this ledger.
  void set(LedgerEntry& entry, const SourceState& state) noexcept;

  /// Which event may be posted to.
  enum class Allowed : std::uint8_t { registered, also_unregistered };
  /// Posts, and keeps what `after(seen)` returns, in one step. `seen`: the event that the post was made to,
  /// just before. Returns the event with the post; nothing: the event may not be posted to, and nothing was
  /// done.
  template <class After>
  [[nodiscard]] std::optional<CountedEvent::Snapshot> post(LedgerEntry& entry, const PoolEvent& event,
                                                           Allowed allowed, After after) {
    const auto find = [&]() -> CountedEvent* {
      const bool may = allowed == Allowed::registered ? event.registered() : event.valid();
      return may ? &event.counted() : nullptr;
    };
    return intent().post(place_of(entry, event), entry.kept, find, after);
  }

  /// Each source that is known: `use(entry)`.
  template <class Function>
  void for_each(Function use) const {
    for (const auto& [source, index] : index_) use(std::as_const(entries()[index]));
  }
  /// Of all sources, those that were forgotten included.
  [[nodiscard]] PostCounters total() const noexcept;

 private:
  explicit PostLedger(MemoryFile memory, const ObjectPool& pool);
  [[nodiscard]] LedgerEntry* entries() const noexcept;
  void finish_intent() noexcept;
  [[nodiscard]] PostIntent& intent() const noexcept;
  [[nodiscard]] PostIntent::Place place_of(const LedgerEntry& entry, const PoolEvent& event) const noexcept;

  MemoryFile memory_;
  const ObjectPool* pool_;
  std::unordered_map<dds::Guid, std::uint32_t, dds::GuidHash> index_;
  std::uint32_t next_free_ = 0;  // all from here on are free
};

}  // namespace plchost
