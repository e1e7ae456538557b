#include "api/client/ack_account.hpp"

#include <algorithm>

#include "api/dds/text.hpp"
#include "shm/base/names.hpp"

namespace plchost {

namespace {

/// The number before the first one that the ledger counts: it is the same as long as the ledger is.
std::uint64_t origin_of(const plc_EventAck& ack) noexcept {
  return ack.sequence_number - ack.accepted - ack.rejected - ack.lost;
}

}  // namespace

void AckAccount::take(const plc_EventAck& ack) {
  if (newest_.epoch != 0 && origin_of(ack) != origin_of(newest_)) earlier_ = sums();
  const std::uint64_t before = newest_.sequence_number;
  newest_ = ack;
  newest_.ext = {};
  if (ack.rejected != 0) {
    last_rejected_ = std::max(last_rejected_, ack.rejected_sequence);
    rejected_code_ = static_cast<ErrorCode>(ack.rejected_code);
    rejected_text_ = printable_lines(dds::text_of(ack.rejected_text));
  }
  if (ack.sequence_number < first_) {
    base_ = sums();
  } else if (before + 1 < first_) {
    const Sums part = earlier_part(before);
    base_.accepted += part.accepted;
    base_.no_task += part.no_task;
    base_.rejected += part.rejected;
    base_.lost += part.lost;
  }
}

// One acknowledgement tells of posts up to `before`, and of others before and behind first_. How many those
// are is known, and which post was rejected last. Of the rest, the earlier posts are taken to have failed.
AckAccount::Sums AckAccount::earlier_part(std::uint64_t before) const noexcept {
  const Sums all = since_base();
  const std::uint64_t done = all.accepted + all.rejected + all.lost;
  const std::uint64_t own = std::min(newest_.sequence_number - first_ + 1, done);
  std::uint64_t left = std::min(first_ - 1 - before, done - own);
  const auto take = [&left](std::uint64_t most) {
    const std::uint64_t taken = std::min(left, most);
    left -= taken;
    return taken;
  };
  Sums part;
  const bool own_rejected = last_rejected_ >= first_ && all.rejected > 0;
  part.rejected = take(own_rejected ? all.rejected - 1 : all.rejected);
  part.lost = take(all.lost);
  part.accepted = take(all.accepted);
  part.no_task = all.no_task - std::min(all.no_task, all.accepted - part.accepted);
  return part;
}

void AckAccount::begin(std::uint64_t first) noexcept {
  first_ = first;
  base_ = sums();
}

AckAccount::Sums AckAccount::sums() const noexcept {
  return {.accepted = earlier_.accepted + newest_.accepted,
          .no_task = earlier_.no_task + newest_.no_task,
          .rejected = earlier_.rejected + newest_.rejected,
          .lost = earlier_.lost + newest_.lost};
}

AckAccount::Sums AckAccount::since_base() const noexcept {
  const Sums now = sums();
  return {.accepted = now.accepted - base_.accepted,
          .no_task = now.no_task - base_.no_task,
          .rejected = now.rejected - base_.rejected,
          .lost = now.lost - base_.lost};
}

PostReport AckAccount::report() const {
  const Sums own = since_base();
  PostReport report;
  report.accepted = own.accepted;
  report.no_task = own.no_task;
  report.rejected = own.rejected;
  report.lost = own.lost;
  if (report.rejected > 0) {
    report.rejected_code = rejected_code_;
    report.rejected_text = rejected_text_;
  }
  return report;
}

}  // namespace plchost
