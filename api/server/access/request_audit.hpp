#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <unordered_map>

#include <control.h>

#include "api/audit/audit_writer.hpp"
#include "api/dds/guid.hpp"
#include "api/server/clients/posted_events.hpp"
#include "shm/base/time.hpp"

namespace plchost {

/// The changes by clients, in the audit log: each request that changes something and was not refused, with
/// its answer. For each source of posts it has the events and how many posts were taken, at its first, then
/// at most once in kPostPeriod. Requests and posts that were refused go into a log of their own, so that they
/// never push out what was done. That log has the first ones of a client, then once in kRefusedPeriod how
/// many. Control loop only.
class RequestAudit {
 public:
  static constexpr Duration kPostPeriod = std::chrono::seconds(60);
  static constexpr Duration kRefusedPeriod = std::chrono::seconds(1);
  /// So many requests of a client are told one by one, and so many more after kPostPeriod without any.
  static constexpr std::size_t kRefusedAtOnce = 16;

  /// The identity of a client, for the record's `who` and `from`. By its participant.
  using Describe = std::function<void(const dds::Guid& client, AuditRecord& record)>;

  /// So many accepted posts of the source are on the disk.
  using Recorded = std::function<void(const dds::Guid& source, std::uint64_t accepted)>;

  /// Of more clients that are refused at a time, the requests are told together.
  static constexpr std::size_t kMostRefused = 256;

  /// `folder`: see AuditLogs; empty: nothing is recorded. It is opened on the thread that writes it, so this
  /// never waits for the disk. Requests that a killed server has left under way are told first. `on_written`:
  /// see AuditWriter. `on_recorded`: by tick().
  RequestAudit(std::string folder, Describe describe, std::function<void()> on_written = {},
               Recorded on_recorded = {});
  /// Writes what is not yet told of posts.
  ~RequestAudit();
  RequestAudit(const RequestAudit&) = delete;
  RequestAudit& operator=(const RequestAudit&) = delete;

  /// Before the request is looked at. One that only reads is not recorded.
  void asked(const dds::Guid& client, const plc_Request& request);
  /// Before it is given to the manager, which takes a while.
  void handed_on(const plc_SampleIdentity& identity);
  /// Before its answer is sent, which is when the ticket is written: an acknowledged change is in the log.
  [[nodiscard]] AuditWriter::Ticket answered(const plc_SampleIdentity& identity, ErrorCode code,
                                             std::string_view text, TimePoint now);
  /// Of one that is refused before it is looked at.
  void refused(const dds::Guid& client, const plc_Request& request, const Error& error, TimePoint now);
  /// The acknowledgement's data about its source.
  void posted(const plc_EventAck& ack, TimePoint now);
  /// To which events. Before posted().
  void posted_to(const PostedEvents::BySource& events, TimePoint now);
  /// Tells of posts what is due, and the process's log when records do not reach the disk any more, or again.
  void tick(TimePoint now);

  [[nodiscard]] bool is_written(AuditWriter::Ticket ticket) const noexcept;
  /// Waits until all is written.
  void flush();
  /// The last record of what was done. Number 0, without a hash: nothing is recorded, or not yet.
  [[nodiscard]] AuditHead head() const;
  /// As AuditWriter::problem(), at the last tick().
  [[nodiscard]] const std::string& problem() const noexcept { return problem_; }

 private:
  struct Posts {
    std::uint64_t accepted = 0;
    std::uint64_t rejected = 0;
    std::uint64_t accepted_told = 0;
    std::uint64_t rejected_told = 0;
    AuditWriter::Ticket ticket = 0;  // of the record that has `accepted_told`; 0: it is noted
    std::string rejected_text;
    PostedEvents::Posts events;  // not told yet
    TimePoint next_accepted{};
    TimePoint next_rejected{};
    TimePoint last{};
  };
  struct Refusals {
    AuditRecord last;
    std::uint64_t count = 0;  // not told yet
    std::size_t spare = 0;    // so many more are told before `next`
    TimePoint next{};
  };
  struct UnderWay {
    dds::Guid client;
    AuditRecord record;
    bool handed_on = false;
  };
  using Sources = std::unordered_map<dds::Guid, Posts, dds::GuidHash>;
  [[nodiscard]] AuditRecord record_of(const dds::Guid& client, const plc_Request& request) const;
  [[nodiscard]] AuditRecord record_of(const dds::Guid& source, const Posts& posts) const;
  Posts& posts_of(const dds::Guid& source);
  void refuse(const dds::Guid& client, AuditRecord record, TimePoint now);
  static void tell_of_unanswered(AuditLogs& logs);
  void tell(const dds::Guid& source, Posts& posts, TimePoint now);
  void note_recorded(TimePoint now);
  void tell_refused(Refusals& refusals, TimePoint now);

  std::unique_ptr<AuditWriter> writer_;  // null: nothing is recorded
  Describe describe_;
  Recorded on_recorded_;
  std::map<std::string, UnderWay> under_way_;  // by identity
  Sources posts_;
  std::unordered_map<dds::Guid, Refusals, dds::GuidHash> refusals_;  // by client
  std::string problem_;
};

}  // namespace plchost
