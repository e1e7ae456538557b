#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <unordered_map>

#include <control.h>

#include "api/audit/audit_log.hpp"
#include "api/audit/pending_records.hpp"
#include "api/dds/guid.hpp"
#include "shm/base/time.hpp"

namespace plchost {

/// What clients change, in the audit log: each request that changes something, refused or done, with its
/// answer; and for each source of posts how many were taken and refused, at its first, then at most once in
/// kPostPeriod, and in kRefusedPeriod if any were refused. Control loop only.
class RequestAudit {
 public:
  static constexpr Duration kPostPeriod = std::chrono::seconds(60);
  static constexpr Duration kRefusedPeriod = std::chrono::seconds(1);

  /// Who a client is, for the record's `who` and `from`. By its participant.
  using Describe = std::function<void(const dds::Guid& client, AuditRecord& record)>;

  /// `log` may be null: then nothing is recorded. Without `pending` a server that is killed leaves nothing of
  /// what is under way; of what the one before has left is told first.
  RequestAudit(std::unique_ptr<AuditLog> log, std::optional<PendingRecords> pending, Describe describe);
  /// Writes what is not yet told of posts.
  ~RequestAudit();
  RequestAudit(const RequestAudit&) = delete;
  RequestAudit& operator=(const RequestAudit&) = delete;

  /// Before the request is looked at. One that only reads is not recorded.
  void asked(const dds::Guid& client, const plc_Request& request);
  /// Before it is given to who does it, which takes a while.
  void handed_on(const plc_SampleIdentity& identity);
  /// Before its answer is sent: what was acknowledged is in the log.
  void answered(const plc_SampleIdentity& identity, ErrorCode code, std::string_view text);
  /// Of one that is refused before it is looked at.
  void refused(const dds::Guid& client, const plc_Request& request, const Error& error);
  /// What the acknowledgement tells of its source.
  void posted(const plc_EventAck& ack, TimePoint now);
  /// Tells of posts what is due.
  void tick(TimePoint now);

  /// "N HASH" of the last record; empty: nothing is recorded.
  [[nodiscard]] std::string head() const;

 private:
  struct Posts {
    std::uint64_t accepted = 0;
    std::uint64_t rejected = 0;
    std::uint64_t accepted_told = 0;
    std::uint64_t rejected_told = 0;
    std::string rejected_text;
    TimePoint next_accepted{};
    TimePoint next_rejected{};
    TimePoint last{};
  };
  [[nodiscard]] AuditRecord record_of(const dds::Guid& client, const plc_Request& request) const;
  void write_answered(AuditRecord& record, ErrorCode code, std::string_view text);
  void tell_of_unanswered();
  void tell(const dds::Guid& source, Posts& posts, TimePoint now);
  void write(const AuditRecord& record);

  std::unique_ptr<AuditLog> log_;
  Describe describe_;
  std::optional<PendingRecords> pending_;
  struct UnderWay {
    AuditRecord record;
    bool handed_on = false;
  };
  std::map<std::string, UnderWay> under_way_;  // by identity
  std::unordered_map<dds::Guid, Posts, dds::GuidHash> posts_;
  bool failing_ = false;
};

}  // namespace plchost
