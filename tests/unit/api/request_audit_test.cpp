#include "api/server/access/request_audit.hpp"

#include <filesystem>
#include <fstream>
#include <iterator>

#include <gmock/gmock.h>
#include <unistd.h>

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

  [[nodiscard]] std::unique_ptr<RequestAudit> make() const {
    return std::make_unique<RequestAudit>(
        AuditLog::open({.folder = folder_}).value(), PendingRecords::open(folder_ + "/under_way").value(),
        [](const dds::Guid& client, AuditRecord& record) { record.from = client.hex(); });
  }
  [[nodiscard]] std::string records() const {
    std::ifstream file(folder_ + "/audit.0000000001.log");
    return {std::istreambuf_iterator<char>(file), {}};
  }
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

  std::string folder_;
};

TEST_F(RequestAuditTest, ARequestThatPretendsToBeAnothersLeavesThatOneItsRecord) {
  const auto sut = make();
  const plc_Request request = load(1);
  sut->asked(client(1), request);
  sut->refused(client(2), request,
               {.code = ErrorCode::refused, .system_errno = 0, .message = "not its writer"});
  sut->answered(request.header.request_identity, ErrorCode::ok, "");
  EXPECT_THAT(records(),
              AllOf(HasSubstr("not its writer"), HasSubstr(client(2).hex()), HasSubstr(client(1).hex())));
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
    sut->answered(request.header.request_identity, ErrorCode::ok, "");
  }
  EXPECT_TRUE(make());
  EXPECT_THAT(records(), AllOf(HasSubstr("line1"), Not(HasSubstr("unknown"))));
}

TEST_F(RequestAuditTest, PostsOfASourceAreToldAtItsFirstAndThenOnceInAPeriod) {
  const auto sut = make();
  const TimePoint start{std::chrono::hours(1)};
  plc_EventAck ack{};
  client(1).copy_to(ack.source);
  ack.accepted = 5;
  sut->posted(ack, start);
  sut->tick(start);
  EXPECT_THAT(records(), HasSubstr("5 taken and 0 refused"));
  ack.accepted = 7;
  sut->posted(ack, start + std::chrono::seconds(1));
  sut->tick(start + RequestAudit::kPostPeriod - std::chrono::milliseconds(1));
  EXPECT_THAT(records(), Not(HasSubstr("7 taken")));
  sut->tick(start + RequestAudit::kPostPeriod);
  EXPECT_THAT(records(), HasSubstr("7 taken and 0 refused"));
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
