#include "api/server/access/request_audit.hpp"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <optional>
#include <vector>

#include <gmock/gmock.h>
#include <unistd.h>

#include "api/audit/audit_check.hpp"
#include "api/dds/text.hpp"

namespace plchost {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

class RequestAuditTest : public testing::Test {
 protected:
  RequestAuditTest() {
    std::string pattern = testing::TempDir() + "plchost-audit-XXXXXX";
    folder_ = ::mkdtemp(pattern.data());
  }
  ~RequestAuditTest() override { std::filesystem::remove_all(folder_); }

  [[nodiscard]] std::unique_ptr<RequestAudit> make(const RequestAudit::Recorded& recorded = {}) const {
    return std::make_unique<RequestAudit>(
        folder_, [](const dds::Guid& client, AuditRecord& record) { record.from = client.hex(); }, [] {},
        recorded);
  }
  [[nodiscard]] static std::string contents(const std::string& folder) {
    std::ifstream file(folder + "/audit.0000000001.log");
    return {std::istreambuf_iterator<char>(file), {}};
  }
  /// Of what was done, and of what was refused.
  [[nodiscard]] std::string records() const { return contents(folder_); }
  [[nodiscard]] std::string refusals() const { return contents(folder_ + "/refused"); }
  static dds::Guid client(std::uint8_t number) {
    dds::Guid guid;
    guid.bytes[0] = number;
    return guid;
  }
  /// Of the writer `of`, which need not be who writes it.
  static plc_Request load(std::uint8_t of) {
    plc_Request request{};
    client(of).copy_to(request.header.request_identity.writer_guid);
    request.header.request_identity.sequence_number = 1;
    request.operation = plc_OPERATION_LOAD_APPLICATION;
    dds::copy_text(request.instance, "line1");
    return request;
  }

  static constexpr TimePoint kNow{std::chrono::hours(1)};
  static constexpr TimePoint kNoTime{};  // so early that the disk is never slow
  std::string folder_;
};

TEST_F(RequestAuditTest, ARequestThatPretendsToBeAnothersLeavesThatOneItsRecord) {
  const auto sut = make();
  const plc_Request request = load(1);
  sut->asked(client(1), request);
  sut->refused(client(2), request,
               {.code = ErrorCode::refused, .system_errno = 0, .message = "not its writer"}, kNow);
  (void)sut->answered(request.header.request_identity, ErrorCode::ok, "", kNow);
  sut->flush();
  EXPECT_THAT(refusals(), AllOf(HasSubstr("not its writer"), HasSubstr(client(2).hex())));
  EXPECT_THAT(records(), AllOf(HasSubstr(client(1).hex()), Not(HasSubstr(client(2).hex()))));
}

TEST_F(RequestAuditTest, WhatWasUnderWayWhenAServerWasKilledIsToldByTheNext) {
  const plc_Request request = load(1);
  {
    const auto killed = make();
    killed->asked(client(1), request);
    killed->handed_on(request.header.request_identity);
  }
  EXPECT_THAT(records(), Not(HasSubstr("line1")));
  EXPECT_TRUE(make());
  EXPECT_THAT(records(),
              AllOf(HasSubstr("line1"), HasSubstr("unknown"), HasSubstr("ended before the answer")));
  const std::string once = records();
  EXPECT_TRUE(make());
  EXPECT_EQ(records(), once) << "it is told once";
}

TEST_F(RequestAuditTest, WhatIsAnsweredIsNotUnderWayAnyMore) {
  const plc_Request request = load(1);
  {
    const auto sut = make();
    sut->asked(client(1), request);
    sut->handed_on(request.header.request_identity);
    (void)sut->answered(request.header.request_identity, ErrorCode::ok, "", kNow);
  }
  EXPECT_TRUE(make());
  EXPECT_THAT(records(), AllOf(HasSubstr("line1"), Not(HasSubstr("unknown"))));
}

TEST_F(RequestAuditTest, PostsOfASourceAreToldAtItsFirstAndThenOnceInAPeriod) {
  const auto sut = make();
  const TimePoint start = kNow;
  plc_EventAck ack{};
  client(1).copy_to(ack.source);
  ack.accepted = 5;
  sut->posted(ack, start);
  sut->tick(start);
  sut->flush();
  EXPECT_THAT(records(), HasSubstr("5 taken and 0 refused"));
  ack.accepted = 7;
  sut->posted(ack, start + std::chrono::seconds(1));
  sut->tick(start + RequestAudit::kPostPeriod - std::chrono::milliseconds(1));
  sut->flush();
  EXPECT_THAT(records(), Not(HasSubstr("7 taken")));
  sut->tick(start + RequestAudit::kPostPeriod);
  sut->flush();
  EXPECT_THAT(records(), HasSubstr("7 taken and 0 refused"));
}

TEST_F(RequestAuditTest, PostsThatAreOnTheDiskAreSaidToBeSoOnce) {
  std::vector<std::uint64_t> said;
  const auto sut = make([&](const dds::Guid& source, std::uint64_t accepted) {
    EXPECT_EQ(source, client(1));
    said.push_back(accepted);
  });
  plc_EventAck ack{};
  client(1).copy_to(ack.source);
  ack.accepted = 5;
  sut->posted(ack, kNow);
  sut->tick(kNow);
  sut->flush();
  sut->tick(kNow);
  sut->tick(kNow);
  EXPECT_THAT(said, testing::ElementsAre(5));
  ack.accepted = 7;
  sut->posted(ack, kNow);
  sut->tick(kNow);
  EXPECT_THAT(said, testing::ElementsAre(5)) << "not told yet";
}

TEST_F(RequestAuditTest, PostsNameTheirEvents) {
  PostedEvents events;
  for (int i = 0; i < 3; ++i) events.note(client(1), "line1", "ready");
  events.note(client(1), "line2", "fast");
  const auto sut = make();
  plc_EventAck ack{};
  client(1).copy_to(ack.source);
  ack.accepted = 4;
  sut->posted_to(events.take(), kNow);
  sut->posted(ack, kNow);
  sut->tick(kNow);
  sut->flush();
  EXPECT_THAT(records(), AllOf(HasSubstr("line1/ready 3, line2/fast 1"), HasSubstr("4 taken")));
  EXPECT_TRUE(events.take().empty());
}

TEST_F(RequestAuditTest, NamesOfEventsHaveABound) {
  PostedEvents events;
  for (std::uint32_t i = 0; i < 1000; ++i) events.note(client(1), "line1", std::to_string(i));
  for (std::uint32_t i = 0; i < 1000; ++i) {
    dds::Guid source;
    source.bytes[14] = static_cast<std::uint8_t>(i >> 8U);
    source.bytes[15] = static_cast<std::uint8_t>(i);
    events.note(source, "line1", "ready");
  }
  const auto taken = events.take();
  EXPECT_EQ(taken.size(), PostedEvents::kSources);
  const auto& posts = taken.at(client(1));
  EXPECT_EQ(posts.events.size(), PostedEvents::kEventsOfSource);
  EXPECT_EQ(posts.others, 1000 - PostedEvents::kEventsOfSource);
}

TEST_F(RequestAuditTest, RefusalsOfAClientAreSummedAndPushOutNothingThatWasDone) {
  const auto sut = make();
  const plc_Request done = load(1);
  sut->asked(client(1), done);
  (void)sut->answered(done.header.request_identity, ErrorCode::ok, "done", kNow);
  sut->flush();
  const std::string before = records();
  constexpr int kSeconds = 10;
  constexpr int kInSecond = 2000;
  plc_Request wrong = load(2);
  for (int i = 0; i < kSeconds * kInSecond; ++i) {
    const TimePoint now = kNow + i * std::chrono::microseconds(1'000'000 / kInSecond);
    ++wrong.header.request_identity.sequence_number;
    sut->asked(client(2), wrong);
    EXPECT_EQ(sut->answered(wrong.header.request_identity, ErrorCode::not_found, "no such file", now), 0U);
    sut->tick(now);
  }
  sut->flush();
  EXPECT_EQ(records(), before);
  const std::string refused = refusals();
  EXPECT_LE(std::ranges::count(refused, '\n'),
            2 + 2 * kSeconds + static_cast<std::ptrdiff_t>(RequestAudit::kRefusedAtOnce));
  EXPECT_THAT(refused, AllOf(HasSubstr("no such file"), HasSubstr("within 1 s")));
}

TEST_F(RequestAuditTest, TheFirstRefusalsOfAClientAreEachTold) {
  const auto sut = make();
  plc_Request wrong = load(2);
  for (std::size_t i = 1; i <= RequestAudit::kRefusedAtOnce; ++i) {
    ++wrong.header.request_identity.sequence_number;
    sut->refused(client(2), wrong,
                 {.code = ErrorCode::refused,
                  .system_errno = 0,
                  .message = "number " + std::to_string(i) + " is refused"},
                 kNow);
  }
  sut->flush();
  const std::string refused = refusals();
  for (std::size_t i = 1; i <= RequestAudit::kRefusedAtOnce; ++i)
    EXPECT_THAT(refused, HasSubstr("\"number " + std::to_string(i) + " is refused\""));
}

TEST_F(RequestAuditTest, WhatTimedOutMayHaveBeenDone) {
  const auto sut = make();
  const plc_Request request = load(1);
  sut->asked(client(1), request);
  EXPECT_NE(sut->answered(request.header.request_identity, ErrorCode::timed_out, "", kNow), 0U);
  sut->flush();
  EXPECT_THAT(records(), HasSubstr("line1"));
}

TEST_F(RequestAuditTest, ClientsThatAreRefusedHaveABound) {
  const auto sut = make();
  const Error error{.code = ErrorCode::refused, .system_errno = 0, .message = "no"};
  for (std::uint32_t i = 0; i < 5000; ++i) {
    dds::Guid stranger;
    stranger.bytes[0] = static_cast<std::uint8_t>(i);
    stranger.bytes[1] = static_cast<std::uint8_t>(i >> 8U);
    stranger.bytes[2] = 1;  // no client is called 0
    sut->refused(stranger, load(1), error, kNow);
  }
  sut->flush();
  const std::string refused = refusals();
  EXPECT_LE(std::ranges::count(refused, '\n'), 2 + static_cast<std::ptrdiff_t>(RequestAudit::kMostRefused));
}

TEST_F(RequestAuditTest, AFolderThatCannotBeOpenedDelaysNoAnswerAndGetsAllInOrderLater) {
  std::filesystem::remove_all(folder_);
  std::ofstream(folder_) << "a file where the folder should be";
  const auto sut = make();
  while (sut->problem().empty()) sut->tick(kNoTime);
  plc_Request request = load(1);
  for (int i = 1; i <= 3; ++i) {
    request.header.request_identity.sequence_number = i;
    sut->asked(client(1), request);
    sut->handed_on(request.header.request_identity);
    const auto ticket =
        sut->answered(request.header.request_identity, ErrorCode::ok, "answer " + std::to_string(i), kNow);
    EXPECT_TRUE(sut->is_written(ticket));
  }
  EXPECT_EQ(sut->head().number, 0U);
  EXPECT_EQ(sut->head().hash, "");
  std::filesystem::remove(folder_);
  while (!sut->problem().empty()) sut->tick(kNoTime);
  sut->flush();
  EXPECT_THAT(records(), testing::ContainsRegex("answer 1.*\n.*answer 2.*\n.*answer 3"));
  EXPECT_TRUE(std::filesystem::is_empty(folder_ + "/under_way"));
  EXPECT_TRUE(check_audit(folder_).value().problems.empty());
}

TEST_F(RequestAuditTest, ALogThatAnotherProcessStillWritesIsWaitedFor) {
  std::optional before(AuditLog::open({.folder = folder_}).value());
  const auto sut = make();
  while (sut->problem().empty()) sut->tick(kNoTime);
  EXPECT_THAT(sut->problem(), HasSubstr("has a writer already"));
  const plc_Request request = load(1);
  sut->asked(client(1), request);
  const auto ticket = sut->answered(request.header.request_identity, ErrorCode::ok, "done", kNow);
  EXPECT_FALSE(sut->is_written(ticket));
  before.reset();
  sut->flush();
  EXPECT_TRUE(sut->is_written(ticket));
  EXPECT_THAT(records(), HasSubstr("done"));
}

TEST_F(RequestAuditTest, JunkLeftUnderWayIsNoRecord) {
  EXPECT_TRUE(make());
  std::ofstream(folder_ + "/under_way/1") << "{\"who\": 5, ";
  std::ofstream(folder_ + "/under_way/2") << "[]";
  std::ofstream(folder_ + "/under_way/3") << R"({"who":"","from":"","what":"stop","on":7,"argument":""})";
  EXPECT_TRUE(make());
  EXPECT_THAT(records(), Not(HasSubstr("unknown")));
  EXPECT_TRUE(std::filesystem::is_empty(folder_ + "/under_way"));
}

}  // namespace
}  // namespace plchost
