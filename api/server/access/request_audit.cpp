#include "api/server/access/request_audit.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <utility>

#include <fmt/chrono.h>
#include <fmt/format.h>

#include "api/dds/text.hpp"
#include "api/server/access/request_check.hpp"
#include "shm/base/names.hpp"
#include "shm/log/log.hpp"

namespace plchost {

namespace {

// Many times the requests that can be under way at the manager: those beyond it without an answer are
// forgotten.
constexpr std::size_t kMostUnderWay = 1024;
constexpr std::size_t kMostSources = 1024;

std::string key_of(const plc_SampleIdentity& identity) {
  return fmt::format("{}.{}", dds::Guid::from(identity.writer_guid).hex(), identity.sequence_number);
}

// Whether nothing was done. One that was handed on may have been done when it timed out, or nobody knows.
bool is_refusal(ErrorCode code) noexcept {
  constexpr std::array kDoneOrUnknown{ErrorCode::ok, ErrorCode::timed_out, ErrorCode::unavailable,
                                      ErrorCode::system, ErrorCode::corrupt};
  return std::ranges::find(kDoneOrUnknown, code) == kDoneOrUnknown.end();
}

// "line1/ready 3, line1/fast 2 and 5 to others"
std::string names_of(const PostedEvents::Posts& posts) {
  std::string names;
  for (const auto& [instance, event, count] : posts.events) {
    names += fmt::format("{}{}/{} {}", names.empty() ? "" : ", ", instance, event, count);
  }
  if (posts.others > 0) names += fmt::format("{}{} to others", names.empty() ? "" : " and ", posts.others);
  return names;
}

// Of what was sent, its digest says what it was.
std::string argument_of(const plc_Request& request) {
  std::string argument(dds::text_of(request.argument));
  const std::string_view digest = dds::text_of(request.sha256);
  if (!digest.empty()) argument += fmt::format(" sha256 {}", digest);
  if (request.boot) argument += " boot";
  if (request.online) argument += " online";
  return argument;
}

}  // namespace

RequestAudit::RequestAudit(std::string folder, Describe describe, std::function<void()> on_written,
                           Recorded on_recorded)
    : describe_(std::move(describe)), on_recorded_(std::move(on_recorded)) {
  if (folder.empty()) return;
  const auto open = [folder = std::move(folder)] {
    auto logs = AuditLogs::open(folder);
    if (logs) tell_of_unanswered(*logs);
    return logs;
  };
  writer_ = std::make_unique<AuditWriter>(open, std::move(on_written));
}

// Of a server that was killed: whether it was done nobody knows here.
void RequestAudit::tell_of_unanswered(AuditLogs& logs) {
  if (!logs.pending) return;
  for (AuditRecord& record : logs.pending->take_all()) {
    const std::chrono::sys_time<std::chrono::nanoseconds> asked{
        std::chrono::nanoseconds(record.time_unix_ns)};
    record.time_unix_ns = unix_time_ns();
    record.result = "unknown";
    record.text = fmt::format("asked at {:%Y-%m-%d %H:%M:%S} UTC; the API server ended before the answer",
                              std::chrono::time_point_cast<std::chrono::milliseconds>(asked));
    (void)logs.done->append(record);  // counted if it cannot be written
  }
}

RequestAudit::~RequestAudit() {
  if (!writer_) return;
  for (auto& [source, posts] : posts_) tell(source, posts, TimePoint::max());
  for (auto& [client, refusals] : refusals_) tell_refused(refusals, TimePoint::max());
  writer_->flush();
  note_recorded(MonotonicClock::now());
}

void RequestAudit::asked(const dds::Guid& client, const plc_Request& request) {
  if (!writer_ || only_reads(request.operation)) return;
  if (under_way_.size() >= kMostUnderWay) under_way_.clear();
  under_way_[key_of(request.header.request_identity)] = {.client = client,
                                                         .record = record_of(client, request)};
}

void RequestAudit::handed_on(const plc_SampleIdentity& identity) {
  const auto found = under_way_.find(key_of(identity));
  if (found == under_way_.end()) return;
  found->second.record.time_unix_ns = unix_time_ns();
  found->second.handed_on = true;
  writer_->add_pending(found->first, found->second.record);
}

void RequestAudit::refused(const dds::Guid& client, const plc_Request& request, const Error& error,
                           TimePoint now) {
  if (!writer_ || only_reads(request.operation)) return;
  AuditRecord record = record_of(client, request);
  record.result = to_string(error.code);
  record.text = error.message;
  refuse(client, std::move(record), now);
}

AuditRecord RequestAudit::record_of(const dds::Guid& client, const plc_Request& request) const {
  AuditRecord record;
  describe_(client, record);
  record.what = operation_name(request.operation);
  record.on = dds::text_of(request.instance);
  record.argument = argument_of(request);
  return record;
}

AuditWriter::Ticket RequestAudit::answered(const plc_SampleIdentity& identity, ErrorCode code,
                                           std::string_view text, TimePoint now) {
  auto found = under_way_.extract(key_of(identity));
  if (found.empty()) return 0;
  UnderWay& request = found.mapped();
  request.record.result = to_string(code);
  request.record.text = text;
  AuditWriter::Ticket ticket = 0;
  if (is_refusal(code)) {
    refuse(request.client, std::move(request.record), now);
  } else {
    request.record.time_unix_ns = unix_time_ns();
    ticket = writer_->write(std::move(request.record));
  }
  if (request.handed_on) writer_->remove_pending(found.key());
  return ticket;
}

// The first one at once.
void RequestAudit::refuse(const dds::Guid& client, AuditRecord record, TimePoint now) {
  record.time_unix_ns = unix_time_ns();
  const bool is_one_more = refusals_.size() >= kMostRefused && !refusals_.contains(client);
  const auto [entry, is_new] = refusals_.try_emplace(is_one_more ? dds::Guid{} : client);
  Refusals& refusals = entry->second;
  if (is_new && !is_one_more) refusals.spare = kRefusedAtOnce - 1;
  const bool soon = now < refusals.next;
  if (soon && refusals.spare == 0) {
    ++refusals.count;
    refusals.last = std::move(record);
    return;
  }
  if (soon) --refusals.spare;
  tell_refused(refusals, now);
  refusals.next = now + kRefusedPeriod;
  (void)writer_->write_refused(std::move(record));
}

void RequestAudit::tell_refused(Refusals& refusals, TimePoint now) {
  if (refusals.count == 0 || now < refusals.next) return;
  refusals.last.text = fmt::format("the last of {} within {} s: {}", refusals.count,
                                   std::chrono::duration_cast<std::chrono::seconds>(kRefusedPeriod).count(),
                                   refusals.last.text);
  (void)writer_->write_refused(std::move(refusals.last));
  refusals.count = 0;
  if (now != TimePoint::max()) refusals.next = now + kRefusedPeriod;
}

RequestAudit::Posts& RequestAudit::posts_of(const dds::Guid& source) {
  if (posts_.size() >= kMostSources && !posts_.contains(source)) {
    for (auto& [known, posts] : posts_) tell(known, posts, TimePoint::max());
    posts_.clear();
  }
  return posts_[source];
}

void RequestAudit::posted_to(const PostedEvents::BySource& events, TimePoint now) {
  if (!writer_) return;
  for (const auto& [source, more] : events) {
    Posts& posts = posts_of(source);
    posts.events.add(more);
    posts.last = now;
  }
}

void RequestAudit::posted(const plc_EventAck& ack, TimePoint now) {
  if (!writer_) return;
  Posts& posts = posts_of(dds::Guid::from(ack.source));
  posts.accepted = ack.accepted;
  posts.rejected = ack.rejected;
  posts.rejected_text = dds::text_of(ack.rejected_text);
  posts.last = now;
}

void RequestAudit::tick(TimePoint now) {
  if (!writer_) return;
  constexpr Duration kForgotten = 2 * kPostPeriod;
  note_recorded(now);
  for (auto& [source, posts] : posts_) tell(source, posts, now);
  std::erase_if(posts_, [&](const auto& one) { return now - one.second.last > kForgotten; });
  for (auto& [client, refusals] : refusals_) tell_refused(refusals, now);
  std::erase_if(refusals_, [&](const auto& one) {
    return one.second.count == 0 && now > one.second.next + kPostPeriod;
  });
  std::string problem = writer_->problem(now);
  if (problem == problem_) return;
  problem_ = std::move(problem);
  if (problem_.empty()) return spdlog::info("changes are recorded again");
  spdlog::error("changes are not recorded: {}", problem_);
}

AuditRecord RequestAudit::record_of(const dds::Guid& source, const Posts& posts) const {
  AuditRecord record;
  describe_(source.participant(), record);
  record.time_unix_ns = unix_time_ns();
  record.what = "post";
  record.text = fmt::format("{} taken and {} refused so far", posts.accepted, posts.rejected);
  return record;
}

void RequestAudit::tell(const dds::Guid& source, Posts& posts, TimePoint now) {
  if (posts.accepted != posts.accepted_told && now >= posts.next_accepted) {
    AuditRecord record = record_of(source, posts);
    record.result = to_string(ErrorCode::ok);
    record.argument = names_of(posts.events);
    posts.ticket = writer_->write(std::move(record));
    posts.accepted_told = posts.accepted;
    posts.events = {};
    if (now != TimePoint::max()) posts.next_accepted = now + kPostPeriod;
  }
  if (posts.rejected != posts.rejected_told && now >= posts.next_rejected) {
    AuditRecord record = record_of(source, posts);
    record.result = to_string(ErrorCode::refused);
    record.text += "; the last of these: " + posts.rejected_text;
    (void)writer_->write_refused(std::move(record));
    posts.rejected_told = posts.rejected;
    if (now != TimePoint::max()) posts.next_rejected = now + kRefusedPeriod;
  }
}

// A record is written also if the disk refused it: then the next server tells the posts once more.
void RequestAudit::note_recorded(TimePoint now) {
  if (!on_recorded_ || !writer_->problem(now).empty()) return;
  for (auto& [source, posts] : posts_) {
    if (posts.ticket == 0 || !is_written(posts.ticket)) continue;
    posts.ticket = 0;
    on_recorded_(source, posts.accepted_told);
  }
}

bool RequestAudit::is_written(AuditWriter::Ticket ticket) const noexcept {
  return !writer_ || writer_->is_written(ticket);
}

void RequestAudit::flush() {
  if (writer_) writer_->flush();
}

AuditHead RequestAudit::head() const {
  const AuditHead head = writer_ ? writer_->head() : AuditHead{};
  return head.number == 0 ? AuditHead{.number = 0, .hash = {}} : head;
}

}  // namespace plchost
