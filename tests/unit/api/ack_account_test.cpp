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
  sut.begin(6);
  sut.take(ack_of(1, 0, 7, 1));
  const PostReport report = sut.report();
  EXPECT_EQ(report.accepted, 2U);
  EXPECT_EQ(report.rejected, 1U);
  EXPECT_EQ(report.rejected_code, ErrorCode::not_found);
  EXPECT_EQ(report.rejected_text, "no such event");
}

TEST(AckAccount, ChargesNoReportWithTheRejectionOfAnEarlierPost) {
  plc_EventAck ack = ack_of(1, 0, 6, 1);  // the post 6 was given up and is rejected, 7 is not
  ack.rejected_sequence = 6;
  for (const std::uint64_t first : {6U, 7U}) {
    AckAccount sut;
    sut.take(ack_of(1, 0, 5));
    sut.begin(first);
    sut.take(ack);
    EXPECT_EQ(sut.report().accepted, 1U);
    EXPECT_EQ(sut.report().rejected, first == 6 ? 1U : 0U);
    EXPECT_EQ(sut.report().rejected_code, first == 6 ? ErrorCode::not_found : ErrorCode::ok);
  }
}

TEST(AckAccount, CountsOneOfTwoRejectionsIfTheOtherOneIsOfAnEarlierPost) {
  AckAccount sut;
  sut.take(ack_of(1, 0, 5));
  sut.begin(7);                  // 6 was given up
  sut.take(ack_of(1, 0, 5, 2));  // both are rejected
  EXPECT_EQ(sut.report().rejected, 1U);
  EXPECT_EQ(sut.report().accepted, 0U);
}

TEST(AckAccount, ChargesNoReportWithPostsThatNobodyWaitedFor) {
  AckAccount sut;
  sut.take(ack_of(1, 0, 5));
  sut.begin(106);
  plc_EventAck ack = ack_of(1, 0, 106);
  ack.no_task = 100;
  sut.take(ack);
  EXPECT_EQ(sut.report().accepted, 1U);
  EXPECT_EQ(sut.report().no_task, 1U);
  AckAccount late;
  late.begin(101);
  late.take(ack_of(1, 0, 40));
  EXPECT_EQ(late.report().accepted, 0U) << "all of them are earlier ones";
  late.take(ack_of(1, 0, 102));
  EXPECT_EQ(late.report().accepted, 2U);
  late.take(ack_of(1, 0, 103));
  EXPECT_EQ(late.report().accepted, 3U);
}

TEST(AckAccount, CountsAMixtureOfBothByTheNumberOfPosts) {
  AckAccount sut;
  sut.begin(4);                  // 1, 2 and 3 were given up
  sut.take(ack_of(1, 0, 4, 2));  // 1 to 6, the last one of which is rejected
  EXPECT_EQ(sut.report().accepted, 2U);
  EXPECT_EQ(sut.report().rejected, 1U);
}

TEST(AckAccount, KeepsARejectionOfTheLedgerBefore) {
  AckAccount sut;
  sut.take(ack_of(1, 0, 5));
  sut.begin(6);
  sut.take(ack_of(1, 0, 5, 1));
  sut.take(ack_of(2, 6, 2));
  EXPECT_EQ(sut.report().rejected, 1U);
}

TEST(AckAccount, GoesOnWithTheNextServerOfTheSameLedger) {
  AckAccount sut;
  sut.take(ack_of(1, 0, 5));
  sut.begin(6);
  sut.take(ack_of(2, 0, 6));
  EXPECT_EQ(sut.report().accepted, 1U);
}

TEST(AckAccount, AddsWhatALedgerThatBeganAnewCounts) {
  AckAccount sut;
  sut.take(ack_of(1, 0, 90, 10));
  sut.begin(101);
  sut.take(ack_of(2, 100, 3));
  EXPECT_EQ(sut.report().accepted, 3U) << "and not 2^64 - 87";
  EXPECT_EQ(sut.report().rejected, 0U);
  sut.take(ack_of(2, 100, 4));
  EXPECT_EQ(sut.report().accepted, 4U);
  EXPECT_EQ(sut.sums().accepted, 94U);
}

TEST(AckAccount, SeesThatALedgerBeganAnewAlsoIfItHasCountedMoreSince) {
  AckAccount sut;
  sut.take(ack_of(1, 0, 2));
  sut.begin(3);
  sut.take(ack_of(2, 2, 32));
  EXPECT_EQ(sut.report().accepted, 32U);
}

TEST(AckAccount, KeepsWhyAPostWasRejectedOverALedgerThatBeganAnew) {
  AckAccount sut;
  sut.take(ack_of(1, 0, 0, 1));
  sut.take(ack_of(2, 1, 1));
  const PostReport report = sut.report();
  EXPECT_EQ(report.rejected, 1U);
  EXPECT_EQ(report.rejected_text, "no such event");
}

}  // namespace
}  // namespace plchost
