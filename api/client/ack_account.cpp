#include "api/client/ack_account.hpp"

#include <algorithm>

#include "api/dds/text.hpp"

namespace plchost {

namespace {

/// The number before the first one that the ledger counts: it is the same as long as the ledger is.
std::uint64_t origin_of(const plc_EventAck& ack) noexcept {
  return ack.sequence_number - ack.accepted - ack.rejected - ack.lost;
}

}  // namespace

void AckAccount::take(const plc_EventAck& ack) {
  if (newest_.epoch != 0 && origin_of(ack) != origin_of(newest_)) earlier_ = sums();
  newest_ = ack;
  newest_.ext = {};
  if (ack.rejected == 0) return;
  last_rejected_ = std::max(last_rejected_, ack.rejected_sequence);
  rejected_code_ = static_cast<ErrorCode>(ack.rejected_code);
  rejected_text_ = dds::text_of(ack.rejected_text);
}

AckAccount::Sums AckAccount::sums() const noexcept {
  return {.accepted = earlier_.accepted + newest_.accepted,
          .no_task = earlier_.no_task + newest_.no_task,
          .rejected = earlier_.rejected + newest_.rejected,
          .lost = earlier_.lost + newest_.lost};
}

PostReport AckAccount::report_since(const Sums& base, std::uint64_t first) const {
  const Sums now = sums();
  PostReport report;
  report.accepted = now.accepted - base.accepted;
  report.no_task = now.no_task - base.no_task;
  if (last_rejected_ >= first) report.rejected = now.rejected - base.rejected;
  report.lost = now.lost - base.lost;
  if (report.rejected > 0) {
    report.rejected_code = rejected_code_;
    report.rejected_text = rejected_text_;
  }
  return report;
}

}  // namespace plchost
