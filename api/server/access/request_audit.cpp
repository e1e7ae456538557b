#include "api/server/access/request_audit.hpp"

#include <array>
#include <chrono>
#include <span>
#include <utility>

#include <fmt/chrono.h>
#include <fmt/format.h>

#include "api/control/application_order.hpp"
#include "api/dds/entries.hpp"
#include "api/dds/text.hpp"
#include "api/server/access/request_check.hpp"
#include "shm/base/log.hpp"
#include "shm/base/names.hpp"

namespace plchost {

namespace {

// As many requests can be under way at the manager, many times over: what is not answered is forgotten.
constexpr std::size_t kMostUnderWay = 1024;
constexpr std::size_t kMostSources = 4096;

std::string key_of(const plc_SampleIdentity& identity) {
  return fmt::format("{}.{}", dds::Guid::from(identity.writer_guid).hex(), identity.sequence_number);
}

// Of what was sent, its digest says what it was.
std::string argument_of(const plc_Request& request) {
  std::string argument(dds::text_of(request.argument));
  std::string digest;
  std::string boot;
  std::string online;
  const std::array<std::pair<std::string_view, std::string*>, 3> known{
      {{kDigestOption, &digest}, {kBootOption, &boot}, {kOnlineOption, &online}}};
  (void)dds::read_entries(std::span(request.ext._buffer, request.ext._length), known);
  if (!digest.empty()) argument += fmt::format(" sha256 {}", digest);
  if (!boot.empty()) argument += " boot";
  if (!online.empty()) argument += " online";
  return argument;
}

}  // namespace

RequestAudit::RequestAudit(std::unique_ptr<AuditLog> log, std::optional<PendingRecords> pending,
                           Describe describe)
    : log_(std::move(log)), describe_(std::move(describe)), pending_(std::move(pending)) {
  if (log_ && pending_) tell_of_unanswered();
}

// Of a server that was killed: whether it was done nobody knows here.
void RequestAudit::tell_of_unanswered() {
  for (AuditRecord& record : pending_->take_all()) {
    const std::chrono::sys_time<std::chrono::nanoseconds> asked{
        std::chrono::nanoseconds(record.time_unix_ns)};
    record.time_unix_ns = unix_time_ns();
    record.result = "unknown";
    record.text = fmt::format("asked at {:%Y-%m-%d %H:%M:%S} UTC; the API server ended before the answer",
                              std::chrono::time_point_cast<std::chrono::milliseconds>(asked));
    write(record);
  }
}

RequestAudit::~RequestAudit() {
  for (auto& [source, posts] : posts_) tell(source, posts, TimePoint::max());
}

void RequestAudit::asked(const dds::Guid& client, const plc_Request& request) {
  if (!log_ || only_reads(request.operation)) return;
  if (under_way_.size() >= kMostUnderWay) under_way_.clear();
  under_way_[key_of(request.header.request_identity)] = {.record = record_of(client, request)};
}

void RequestAudit::handed_on(const plc_SampleIdentity& identity) {
  const auto found = under_way_.find(key_of(identity));
  if (!pending_ || found == under_way_.end()) return;
  found->second.record.time_unix_ns = unix_time_ns();
  const auto written = pending_->add(found->first, found->second.record);
  found->second.handed_on = true;
  if (!written) spdlog::error("what is under way is not recorded: {}", written.error().describe());
}

void RequestAudit::refused(const dds::Guid& client, const plc_Request& request, const Error& error) {
  if (!log_ || only_reads(request.operation)) return;
  AuditRecord record = record_of(client, request);
  write_answered(record, error.code, error.message);
}

AuditRecord RequestAudit::record_of(const dds::Guid& client, const plc_Request& request) const {
  AuditRecord record;
  describe_(client, record);
  record.what = operation_name(request.operation);
  record.on = dds::text_of(request.instance);
  record.argument = argument_of(request);
  return record;
}

void RequestAudit::answered(const plc_SampleIdentity& identity, ErrorCode code, std::string_view text) {
  auto found = under_way_.extract(key_of(identity));
  if (found.empty()) return;
  write_answered(found.mapped().record, code, text);
  if (found.mapped().handed_on) pending_->remove(found.key());
}

void RequestAudit::write_answered(AuditRecord& record, ErrorCode code, std::string_view text) {
  record.time_unix_ns = unix_time_ns();
  record.result = to_string(code);
  record.text = text;
  write(record);
}

void RequestAudit::posted(const plc_EventAck& ack, TimePoint now) {
  if (!log_) return;
  if (posts_.size() >= kMostSources) {
    for (auto& [source, posts] : posts_) tell(source, posts, TimePoint::max());
    posts_.clear();
  }
  Posts& posts = posts_[dds::Guid::from(ack.source)];
  posts.accepted = ack.accepted;
  posts.rejected = ack.rejected;
  posts.rejected_text = dds::text_of(ack.rejected_text);
  posts.last = now;
}

void RequestAudit::tick(TimePoint now) {
  constexpr Duration kForgotten = 2 * kPostPeriod;
  for (auto& [source, posts] : posts_) tell(source, posts, now);
  std::erase_if(posts_, [&](const auto& one) { return now - one.second.last > kForgotten; });
}

void RequestAudit::tell(const dds::Guid& source, Posts& posts, TimePoint now) {
  const bool accepted = posts.accepted != posts.accepted_told && now >= posts.next_accepted;
  const bool rejected = posts.rejected != posts.rejected_told && now >= posts.next_rejected;
  if (!accepted && !rejected) return;
  AuditRecord record;
  describe_(source.participant(), record);
  record.time_unix_ns = unix_time_ns();
  record.what = "post";
  record.result = to_string(rejected ? ErrorCode::refused : ErrorCode::ok);
  record.text = fmt::format("{} taken and {} refused so far{}{}", posts.accepted, posts.rejected,
                            rejected ? "; the last of these: " : "", rejected ? posts.rejected_text : "");
  write(record);
  posts.accepted_told = posts.accepted;
  posts.rejected_told = posts.rejected;
  if (now == TimePoint::max()) return;
  posts.next_accepted = now + kPostPeriod;
  posts.next_rejected = now + kRefusedPeriod;
}

void RequestAudit::write(const AuditRecord& record) {
  const auto written = log_->append(record);
  if (!written && !failing_) spdlog::error("changes are not recorded: {}", written.error().describe());
  if (written && failing_) spdlog::info("changes are recorded again");
  failing_ = !written;
}

std::string RequestAudit::head() const {
  return log_ ? fmt::format("{} {}", log_->head().number, log_->head().hash) : std::string();
}

}  // namespace plchost
