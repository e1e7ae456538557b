#include "api/server/event_intake.hpp"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

#include "api/dds/samples.hpp"
#include "api/dds/text.hpp"

namespace plchost {

using dds::text_of;

bool EventIntake::take(dds_entity_t reader) {
  const std::lock_guard lock(mutex_);
  const bool owed_before = !owed_.empty();
  dds::take_valid<plc_EventPost>(reader, [&](const plc_EventPost& post, const dds_sample_info_t& info) {
    if (source_is_writer(reader, info, post)) {
      process_locked(post);
    } else {
      ++malformed_;
    }
  });
  return !owed_before && !owed_.empty();
}

bool EventIntake::source_is_writer(dds_entity_t reader, const dds_sample_info_t& info,
                                   const plc_EventPost& post) {
  constexpr std::size_t kMaxKnown = 4096;
  auto known = writers_.find(info.publication_handle);
  if (known == writers_.end()) {
    const dds::Guid writer = dds::writer_of(reader, info);
    if (writer == dds::Guid{}) return false;
    if (writers_.size() >= kMaxKnown) writers_.clear();
    known = writers_.emplace(info.publication_handle, writer).first;
  }
  return known->second == dds::Guid::from(post.source);
}

void EventIntake::process(const plc_EventPost& post) {
  const std::lock_guard lock(mutex_);
  process_locked(post);
}

void EventIntake::process_locked(const plc_EventPost& post) {
  if (post.base_sequence == 0 || post.base_sequence > post.sequence_number) {
    ++malformed_;
    return;
  }
  const dds::Guid source = dds::Guid::from(post.source);
  LedgerEntry& entry = ledger_.entry_for(source, MonotonicClock::now().time_since_epoch().count());
  // The source says that all before its base are acknowledged: a ledger that does not know it starts there.
  if (entry.last.load(std::memory_order_relaxed) < post.base_sequence - 1) {
    entry.last.store(post.base_sequence - 1, std::memory_order_release);
  }
  const PostOrder order = order_of(post.sequence_number, entry.last.load(std::memory_order_relaxed));
  if (order == PostOrder::next) post_next(post, entry);
  owed_.insert(source);
}

void EventIntake::post_next(const plc_EventPost& post, LedgerEntry& entry) {
  auto done = try_post(post);
  // The post is in the pool; from here to the store is the window that PostLedger speaks of.
  entry.last.store(post.sequence_number, std::memory_order_release);
  if (done && *done == PostResult::not_registered) {
    done = failure(ErrorCode::not_found,
                   fmt::format("external event '{}/{}' is not registered", post.instance, post.event));
  }
  if (done) {
    ++entry.accepted;
    if (*done == PostResult::no_task) ++entry.no_task;
    return;
  }
  ++entry.rejected;
  entry.rejected_sequence = post.sequence_number;
  entry.rejected_code = static_cast<std::int32_t>(done.error().code);
  entry.rejected_text.assign(done.error().message);
}

Result<PostResult> EventIntake::try_post(const plc_EventPost& post) {
  if (auto may = guard_->check(dds::Guid::from(post.source), security::Role::operating); !may) {
    return std::unexpected(may.error());
  }
  const auto host = text_of(post.host);
  if (host != host_) {
    return failure(ErrorCode::not_found, fmt::format("this is host '{}', not '{}'", host_, host));
  }
  const auto instance = text_of(post.instance);
  const auto event = text_of(post.event);
  if (auto good = check_name("instance", instance, kMaxInstanceName); !good)
    return std::unexpected(good.error());
  if (auto good = check_name("event", event, kMaxEventName); !good) return std::unexpected(good.error());
  const auto found = directory_.find(instance, event);
  if (!found) return std::unexpected(found.error());
  return found->post();
}

std::vector<plc_EventAck> EventIntake::collect_acks() {
  const std::lock_guard lock(mutex_);
  std::vector<plc_EventAck> acks;
  acks.reserve(owed_.size());
  for (const dds::Guid& source : owed_) {
    const LedgerEntry& entry = ledger_.entry_for(source, MonotonicClock::now().time_since_epoch().count());
    plc_EventAck& ack = acks.emplace_back();
    source.copy_to(ack.source);
    dds::copy_text(ack.host, host_);
    ack.epoch = epoch_;
    ack.sequence_number = entry.last.load(std::memory_order_relaxed);
    ack.accepted = entry.accepted;
    ack.no_task = entry.no_task;
    ack.rejected = entry.rejected;
    ack.rejected_sequence = entry.rejected_sequence;
    ack.rejected_code = entry.rejected_code;
    dds::copy_text(ack.rejected_text, entry.rejected_text.view());
    ack.credits = kPostCredits;
  }
  owed_.clear();
  return acks;
}

std::uint64_t EventIntake::malformed() const {
  const std::lock_guard lock(mutex_);
  return malformed_;
}

}  // namespace plchost
