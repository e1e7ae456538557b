#pragma once

#include <cstdint>
#include <mutex>
#include <string>
#include <unordered_map>
#include <unordered_set>
#include <vector>

#include <control.h>

#include "api/dds/guid.hpp"
#include "api/server/access_guard.hpp"
#include "api/server/event_directory.hpp"
#include "api/server/post_ledger.hpp"

namespace plchost {

/// How many posts a client may have unacknowledged.
inline constexpr std::uint32_t kPostCredits = 64;

/// The way of a remote post from DDS into the pool: checks it, finds the event, posts, and notes that its
/// source is owed an acknowledgement. Runs in DDS's receiving thread; nothing in it writes to DDS. The lock
/// is held by that thread, and by the control loop for the copying of acknowledgements.
class EventIntake {
 public:
  /// `guard` says who may post; it must outlive this.
  EventIntake(std::string host, const ObjectPool& pool, PostLedger ledger, std::uint64_t epoch,
              const AccessGuard& guard)
      : host_(std::move(host)), epoch_(epoch), guard_(&guard), directory_(pool), ledger_(std::move(ledger)) {}

  /// Takes all that the reader has. Returns true if acknowledgements are owed now and none were before.
  bool take(dds_entity_t reader);

  /// One post, whose `source` was checked. Public for tests.
  void process(const plc_EventPost& post);

  /// The acknowledgements that are owed, one for each source; then none is.
  [[nodiscard]] std::vector<plc_EventAck> collect_acks();

  /// Samples that were no valid post: source not the writer's, or impossible numbers.
  [[nodiscard]] std::uint64_t malformed() const;

 private:
  void process_locked(const plc_EventPost& post);
  void post_next(const plc_EventPost& post, LedgerEntry& entry);
  [[nodiscard]] Result<PostResult> try_post(const plc_EventPost& post);
  [[nodiscard]] bool source_is_writer(dds_entity_t reader, const dds_sample_info_t& info,
                                      const plc_EventPost& post);

  const std::string host_;
  const std::uint64_t epoch_;
  const AccessGuard* const guard_;
  mutable std::mutex mutex_;
  EventDirectory directory_;
  PostLedger ledger_;
  std::unordered_set<dds::Guid, dds::GuidHash> owed_;
  std::unordered_map<dds_instance_handle_t, dds::Guid> writers_;  // asking DDS costs an allocation
  std::uint64_t malformed_ = 0;
};

}  // namespace plchost
