#pragma once

#include <cstddef>
#include <cstdint>
#include <mutex>
#include <optional>
#include <string>
#include <unordered_map>
#include <unordered_set>
#include <vector>

#include <control.h>

#include "api/dds/guid.hpp"
#include "api/server/clients/access_guard.hpp"
#include "api/server/clients/ack_writers.hpp"
#include "api/server/clients/posted_events.hpp"
#include "api/server/posts/event_directory.hpp"
#include "api/server/posts/post_ledger.hpp"
#include "shm/base/time.hpp"
#include "shm/pages/host_page_copy.hpp"

namespace plchost {

/// How many posts a client may have unacknowledged.
inline constexpr std::uint32_t kPostCredits = 64;

/// A post whose client wants to know when the tasks have run for it.
struct AwaitedPost {
  struct Target {
    std::string instance;
    std::string event;
    std::uint64_t count = 0;  ///< of the event, with this post
    bool taken = true;        ///< tasks took posts then
    bool exact = true;        ///< false: it came again, and `count` is that of a later post
    PoolEvent handle = {};
  };
  dds::Guid source;
  std::uint64_t sequence = 0;
  std::vector<Target> targets = {};
  std::optional<Error> unrun = {};  ///< why no task runs for it; nothing: the tasks' pages tell
  TimePoint received;
};

/// The way of a remote post from DDS into the pool: checks it, finds the event, posts, and acknowledges it or
/// notes that its source is owed an acknowledgement. Runs in DDS's receiving thread. The lock is held by that
/// thread, and by the control loop for the copying of acknowledgements.
class EventIntake {
 public:
  /// `guard` says who may post; it must outlive this.
  EventIntake(std::string host, const ObjectPool& pool, PostLedger ledger, std::uint64_t epoch,
              const AccessGuard& guard)
      : host_(std::move(host)),
        epoch_(epoch),
        guard_(&guard),
        host_page_(pool.name()),
        directory_(pool),
        ledger_(std::move(ledger)) {}

  /// The sources that posted since then are among the next collect_written_acks(): a server that was killed
  /// may not have told of their last posts. Those whose posts are all in the records are not.
  void note_sources_since(TimePoint then);
  /// So many accepted posts of the source are in the records.
  void note_recorded(const dds::Guid& source, std::uint64_t accepted);

  /// From now on posts are acknowledged at once where `writers` has a writer for their client; it must
  /// outlive this.
  void acknowledge_by(AckWriters& writers);

  /// Takes all that the reader has. Returns true if there is something to collect now that cannot wait, and
  /// there was not before.
  bool take_posts(dds_entity_t reader);
  bool take_batches(dds_entity_t reader);

  /// One post, or one batch of them, whose `source` was checked. Public for tests.
  void process(const plc_EventPost& post);
  void process(const plc_EventBatch& batch);

  /// The acknowledgements that are owed, one for each source; then none is. Those for sources that do not
  /// wait for them make nobody collect.
  [[nodiscard]] std::vector<plc_EventAck> collect_acks();
  /// The last acknowledgement of each source that was written since the last call, for the records.
  [[nodiscard]] std::vector<plc_EventAck> collect_written_acks();
  /// To which events posts were taken since the last call, for the records.
  [[nodiscard]] PostedEvents::BySource collect_posted();
  /// The posts since the last call whose runs are waited for.
  [[nodiscard]] std::vector<AwaitedPost> collect_awaited();

  /// The fate of the posts of one source.
  struct Writer {
    dds::Guid source;  ///< all zero: of all sources together
    PostCounters counters;
    std::uint64_t last = 0;
    TimePoint used;  ///< when its last post came
  };
  /// All together first, then each source that is known.
  [[nodiscard]] std::vector<Writer> writers() const;

  /// Samples that were no valid post: source not the writer's, or impossible numbers. Their writers are
  /// answered with the reason.
  [[nodiscard]] std::uint64_t malformed() const;

  /// How many awaited posts there may be between two calls of collect_awaited().
  static constexpr std::size_t kMaxAwaited = 1024;

 private:
  using Sources = std::unordered_set<dds::Guid, dds::GuidHash>;
  template <class Post>
  bool take(dds_entity_t reader);
  void write_acks();
  [[nodiscard]] plc_EventAck make_ack(const LedgerEntry& entry) const;
  [[nodiscard]] std::vector<plc_EventAck> make_acks(const Sources& sources) const;
  [[nodiscard]] bool cannot_wait() const noexcept { return !owed_.empty() || !awaited_.empty(); }
  template <class Post>
  void process_locked(const Post& post);
  void refuse(const dds::Guid& writer, std::uint64_t sequence, std::string_view why);
  using Targets = std::vector<AwaitedPost::Target>;
  template <class Post>
  void post_next(const Post& post, LedgerEntry& entry, const SourceState& state);
  // `targets` is null if nobody waits for the runs.
  [[nodiscard]] Result<void> try_post(const plc_EventPost& post, LedgerEntry& entry, const SourceState& state,
                                      Targets* targets);
  [[nodiscard]] Result<void> try_post(const plc_EventBatch& batch, LedgerEntry& entry,
                                      const SourceState& state, Targets* targets);
  [[nodiscard]] Result<void> look_up(const plc_EventBatch& batch, bool begun, bool awaited);
  [[nodiscard]] Result<PoolEvent> find(std::string_view instance, std::string_view event, bool awaited);
  [[nodiscard]] bool is_starting(std::string_view instance);
  template <class Post>
  [[nodiscard]] Result<void> check(const Post& post) const;
  template <class Post>
  void await_again(const Post& post, const LedgerEntry& entry);
  [[nodiscard]] static Result<void> check_names(std::string_view instance, std::string_view event);
  [[nodiscard]] dds::Guid writer_of(dds_entity_t reader, const dds_sample_info_t& info);

  const std::string host_;
  const std::uint64_t epoch_;
  const AccessGuard* const guard_;
  mutable std::mutex mutex_;
  HostPageCopy host_page_;  // is read when an event is not there
  TimePoint looked_;        // at it
  std::optional<TimePoint> torn_since_;
  EventDirectory directory_;
  PostLedger ledger_;
  AckWriters* ack_writers_ = nullptr;
  Sources owed_;
  Sources owed_late_;                                             // to those that do not wait for it
  Sources written_;                                               // and not collected for the records
  std::unordered_map<dds_instance_handle_t, dds::Guid> writers_;  // asking DDS costs an allocation
  std::vector<AwaitedPost> awaited_;
  PostedEvents posted_;
  std::vector<PoolEvent> batch_events_;  // of the batch that is processed
  TimePoint now_;                        // when the post that is processed came
  std::uint64_t malformed_ = 0;
};

}  // namespace plchost
