#include "api/client/ack_account.hpp"

#include <gtest/gtest.h>

#include "api/dds/text.hpp"

namespace plchost {
namespace {

/// An acknowledgement as a ledger gives it that knows the source since the number behind `origin`.
plc_EventAck ack_of(std::uint64_t epoch, std::uint64_t origin, std::uint64_t accepted,
                    std::uint64_t rejected = 0) {
  plc_EventAck ack{};
  ack.epoch = epoch;
  ack.sequence_number = origin + accepted + rejected;
  ack.accepted = accepted;
  ack.rejected = rejected;
  ack.rejected_sequence = rejected > 0 ? ack.sequence_number : 0;
  ack.rejected_code = rejected > 0 ? static_cast<std::int32_t>(ErrorCode::not_found) : 0;
  dds::copy_text(ack.rejected_text, rejected > 0 ? "no such event" : "");
  return ack;
}

TEST(AckAccount, CountsFromItsBase) {
  AckAccount sut;
  sut.take(ack_of(1, 0, 5));
  const auto base = sut.sums();
  sut.take(ack_of(1, 0, 7, 1));
  const PostReport report = sut.report_since(base, 1);
  EXPECT_EQ(report.accepted, 2U);
  EXPECT_EQ(report.rejected, 1U);
  EXPECT_EQ(report.rejected_code, ErrorCode::not_found);
  EXPECT_EQ(report.rejected_text, "no such event");
}

TEST(AckAccount, ChargesNoReportWithTheRejectionOfAnEarlierPost) {
  AckAccount sut;
  sut.take(ack_of(1, 0, 5));
  const auto base = sut.sums();
  plc_EventAck ack = ack_of(1, 0, 6, 1);  // the post 6 was given up and is rejected, 7 is not
  ack.rejected_sequence = 6;
  sut.take(ack);
  EXPECT_EQ(sut.report_since(base, 7).rejected, 0U);
  EXPECT_EQ(sut.report_since(base, 7).rejected_code, ErrorCode::ok);
  EXPECT_EQ(sut.report_since(base, 6).rejected, 1U);
}

TEST(AckAccount, KeepsARejectionOfTheLedgerBefore) {
  AckAccount sut;
  sut.take(ack_of(1, 0, 5));
  const auto base = sut.sums();
  sut.take(ack_of(1, 0, 5, 1));
  sut.take(ack_of(2, 6, 2));
  EXPECT_EQ(sut.report_since(base, 6).rejected, 1U);
}

TEST(AckAccount, GoesOnWithTheNextServerOfTheSameLedger) {
  AckAccount sut;
  sut.take(ack_of(1, 0, 5));
  const auto base = sut.sums();
  sut.take(ack_of(2, 0, 6));
  EXPECT_EQ(sut.report_since(base, 1).accepted, 1U);
}

TEST(AckAccount, AddsWhatALedgerThatBeganAnewCounts) {
  AckAccount sut;
  sut.take(ack_of(1, 0, 90, 10));
  const auto base = sut.sums();
  sut.take(ack_of(2, 100, 3));
  EXPECT_EQ(sut.report_since(base, 1).accepted, 3U) << "and not 2^64 - 87";
  EXPECT_EQ(sut.report_since(base, 1).rejected, 0U);
  sut.take(ack_of(2, 100, 4));
  EXPECT_EQ(sut.report_since(base, 1).accepted, 4U);
  EXPECT_EQ(sut.sums().accepted, 94U);
}

TEST(AckAccount, SeesThatALedgerBeganAnewAlsoIfItHasCountedMoreSince) {
  AckAccount sut;
  sut.take(ack_of(1, 0, 2));
  const auto base = sut.sums();
  sut.take(ack_of(2, 2, 32));
  EXPECT_EQ(sut.report_since(base, 1).accepted, 32U);
}

TEST(AckAccount, KeepsWhyAPostWasRejectedOverALedgerThatBeganAnew) {
  AckAccount sut;
  const auto base = sut.sums();
  sut.take(ack_of(1, 0, 0, 1));
  sut.take(ack_of(2, 1, 1));
  const PostReport report = sut.report_since(base, 1);
  EXPECT_EQ(report.rejected, 1U);
  EXPECT_EQ(report.rejected_text, "no such event");
}

}  // namespace
}  // namespace plchost
