#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <unordered_map>
#include <utility>

#include "api/dds/guid.hpp"
#include "shm/base/names.hpp"
#include "shm/base/result.hpp"
#include "shm/pool/memory_file.hpp"
#include "shm/pool/object_pool.hpp"

namespace plchost {

/// What became of posts. received = accepted + rejected + duplicate + early + malformed.
struct PostCounters {
  std::uint64_t received = 0;
  std::uint64_t accepted = 0;
  std::uint64_t no_task = 0;  ///< of those accepted
  std::uint64_t rejected = 0;
  std::uint64_t duplicate = 0;
  std::uint64_t early = 0;      ///< not taken, because one before it was missing
  std::uint64_t lost = 0;       ///< never came, and its source went on without it
  std::uint64_t malformed = 0;  ///< with numbers or a source that cannot be: counted nowhere else

  void add(const PostCounters& other) noexcept;
};

/// How far one source has come.
struct SourceState {
  std::uint64_t last = 0;          ///< all posts up to this number are done
  std::uint64_t batch = 0;         ///< number of the batch whose events are being posted
  std::uint32_t batch_done = 0;    ///< so many of them are posted: the next server goes on there
  std::int32_t rejected_code = 0;  ///< of the post `rejected_sequence`
  std::uint64_t rejected_sequence = 0;
  std::uint64_t batch_no_task = 0;  ///< 1: one of them was taken by no task
  std::uint64_t last_count = 0;  ///< the event's count with the post `last`; 0: it was rejected, or a batch
  std::uint64_t last_taken = 0;  ///< 1: tasks took posts then
  PostCounters counters = {};
};

/// What is kept of one source of posts. In shared memory; all zero is a free entry.
struct LedgerEntry {
  std::array<std::uint8_t, 16> source{};
  std::atomic<std::uint32_t> in_use{0};   ///< written last
  std::atomic<std::uint32_t> current{0};  ///< of the two states: the other one is being written
  std::int64_t used_ns = 0;  ///< CLOCK_MONOTONIC of the last post: the oldest entry is given away first
  std::array<SourceState, 2> states{};
  FixedText<255> rejected_text;

  [[nodiscard]] const SourceState& state() const noexcept {
    return states[current.load(std::memory_order_acquire) & 1U];
  }
};

/// The greatest number of a post. Beyond it the numbers would come to an end, where no post is the next one.
inline constexpr std::uint64_t kMaxPostNumber = ~std::uint64_t{0} >> 1U;

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
/// plchost-dds after a killed one neither loses nor repeats a post, whichever instruction the kill hits:
///
///   1. The new state of the source is written beside the one that counts, then the intent: which source,
///      which event, and the mark that the event will have.
///   2. One compare-exchange counts the post and changes the event's mark.
///   3. One store makes the new state count.
///   4. Waiting tasks are woken, and the intent is cleared.
///
/// If an intent is left, the next server compares the marks. If the post was made, it does 3 and 4; both do
/// no harm when they were done before. If not, nothing has happened, and the client repeats the post. Other
/// posters change the count at any time, but never the mark. One process at a time: it holds the ledger's
/// mutex. Used by one thread at a time; opened and destroyed by the same one.
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
  /// posted least recently: if it lives on, it starts anew at the base that its posts carry.
  [[nodiscard]] LedgerEntry& entry_for(const dds::Guid& source, std::int64_t now_ns);

  /// The same, of a source that is known; null: it is not.
  [[nodiscard]] const LedgerEntry* find(const dds::Guid& source) const;

  /// What is kept of the source is this from now on. The entry is one of this ledger.
  void set(LedgerEntry& entry, const SourceState& state) noexcept;

  /// Which event may be posted to.
  enum class Allowed : std::uint8_t { registered, also_unregistered };
  /// Posts, and keeps what `after(seen)` returns, in one step. `seen`: the event that the post was made to,
  /// just before. Returns the event with the post; nothing: the event may not be posted to, and nothing was
  /// done.
  template <class After>
  [[nodiscard]] std::optional<CountedEvent::Snapshot> post(LedgerEntry& entry, const PoolEvent& event,
                                                           Allowed allowed, After after) {
    begin_post(entry, event);
    for (;;) {
      const bool may = allowed == Allowed::registered ? event.registered() : event.valid();
      if (!may) break;
      CountedEvent::Snapshot seen = event.counted().snapshot();
      write_intent(entry, after(std::as_const(seen)), seen);
      if (!event.counted().post_marked(seen)) continue;
      end_post(entry, event.counted(), seen);
      return seen;
    }
    drop_intent();
    return std::nullopt;
  }

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
  explicit PostLedger(MemoryFile memory, const ObjectPool& pool);
  [[nodiscard]] LedgerEntry* entries() const noexcept;
  void finish_intent() noexcept;
  void begin_post(const LedgerEntry& entry, const PoolEvent& event) noexcept;
  void write_intent(LedgerEntry& entry, const SourceState& after, CountedEvent::Snapshot seen) noexcept;
  void end_post(LedgerEntry& entry, CountedEvent& event, CountedEvent::Snapshot made) noexcept;
  void drop_intent() noexcept;

  MemoryFile memory_;
  const ObjectPool* pool_;
  std::unordered_map<dds::Guid, std::uint32_t, dds::GuidHash> index_;
  std::uint32_t next_free_ = 0;  // all from here on are free
  std::uint64_t reused_ = 0;
};

}  // namespace plchost
