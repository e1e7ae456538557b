// Participants that write bare samples about variables, and keep to no rule of the clients.
#include <functional>
#include <optional>
#include <string>
#include <thread>

#include "api/dds/samples.hpp"
#include "api/dds/text.hpp"
#include "tests/integration/security/secured_host.hpp"

namespace plchost {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using testing::HasSubstr;
using testing::IsEmpty;

class BareVariables : public SecuredHost {
 protected:
  BareVariables() { start(); }
  /// The host's answer to a request of `client` that `forge` has altered.
  std::string told(
      RawClient& client, const dds::TopicInfo& topic, std::int32_t operation,
      const std::function<void(plc_Request&)>& forge = [](plc_Request& /*as it is*/) {}) {
    const auto writer = client.write(topic, "h.cell");
    const auto replies = client.read(dds::kReply, dds::client_partition(client.guid().hex(), dds::kAllHosts));
    const auto presence = client.read(dds::kPresence, "s.cell", dds::qos_of(dds::kPresence));
    EXPECT_TRUE(RawClient::meets_reader(writer) && RawClient::meets_writer(replies));
    plc_Request request{};
    dds::guid_of(writer).copy_to(request.header.request_identity.writer_guid);
    dds::copy_text(request.header.instance_name, "cell");
    dds::copy_text(request.instance, "line1");
    request.operation = operation;
    const bool lists = operation == plc_OPERATION_LIST_VARIABLES;
    dds::copy_text(request.argument, lists ? "" : "Main.speed=5");
    std::optional<std::string> text;
    for (const TimePoint end = soon(); !text && MonotonicClock::now() < end;) {
      dds::take_valid<plc_Presence>(presence, [&](const auto& seen, const auto& /*info*/) {
        request.limit = {.epoch = seen.epoch, .clock_ns = seen.clock_ns + Duration(seconds(30)).count()};
      });
      if (request.limit.epoch != 0) {
        ++request.header.request_identity.sequence_number;
        plc_Request forged = request;
        forge(forged);
        EXPECT_EQ(dds_write(writer, &forged), DDS_RETCODE_OK);
      }
      std::this_thread::sleep_for(milliseconds(50));
      dds::take_valid<plc_Reply>(
          replies, [&](const auto& reply, const auto& /*info*/) { text = dds::text_of(reply.text); });
    }
    EXPECT_TRUE(text) << "it is not answered";
    return text.value_or("");
  }
};

TEST_F(BareVariables, OfAnOperatorAreRefusedByItsRoleAndNotByWhatItSays) {
  for (const auto operation :
       {plc_OPERATION_WRITE_VARIABLE, plc_OPERATION_FORCE_VARIABLE, plc_OPERATION_UNFORCE_VARIABLE}) {
    RawClient client(domain_, folder("operator"));
    const bool names = operation == plc_OPERATION_UNFORCE_VARIABLE;
    EXPECT_THAT(told(client, dds::kOperatorRequest, operation,
                     [&](plc_Request& request) {
                       if (names) dds::copy_text(request.argument, "*");
                     }),
                HasSubstr("'operator' is operator; this takes the role engineer ([host] write_variables"));
  }
  RawClient reader(domain_, folder("operator"));
  EXPECT_THAT(told(reader, dds::kViewerRequest, plc_OPERATION_LIST_VARIABLES),
              HasSubstr("'operator' is operator; this takes the role engineer ([host] read_variables"));
  EXPECT_THAT(host_.requests(), IsEmpty());
}

TEST_F(BareVariables, OfAnEngineerAreRefusedByAnotherNameOfHostNumberOrTopic) {
  RawClient host(domain_, folder("engineer"));
  EXPECT_THAT(told(host, dds::kOperatorRequest, plc_OPERATION_FORCE_VARIABLE,
                   [](plc_Request& request) { dds::copy_text(request.header.instance_name, "south"); }),
              HasSubstr("this is host 'cell', not 'south'"));
  RawClient number(domain_, folder("engineer"));
  EXPECT_THAT(told(number, dds::kOperatorRequest, plc_OPERATION_FORCE_VARIABLE,
                   [](plc_Request& request) { request.header.request_identity.writer_guid[0] ^= 0x55; }),
              HasSubstr("the request's identity is not that of its writer"));
  RawClient topic(domain_, folder("engineer"));
  EXPECT_THAT(told(topic, dds::kViewerRequest, plc_OPERATION_WRITE_VARIABLE),
              HasSubstr("'write variable' does not belong to the topic"));
  EXPECT_THAT(host_.requests(), IsEmpty());
  RawClient good(domain_, folder("engineer"));
  (void)told(good, dds::kOperatorRequest, plc_OPERATION_WRITE_VARIABLE);
  EXPECT_FALSE(host_.requests().empty()) << "the others were refused for another reason than their forgery";
}

TEST_F(BareVariables, OfAPatchedViewerMeetNobody) {
  RawClient client(domain_, folder("viewer"), /*patched=*/true);
  const auto own = client.write(dds::kViewerRequest, "h.cell");
  const auto writes = client.write(dds::kOperatorRequest, "h.cell");
  const auto others = client.read(dds::kVariablePage, "c.*", dds::qos_of(dds::kVariablePage));
  const auto pages = client.read(dds::kVariablePage, "s.cell", dds::qos_of(dds::kVariablePage));
  ASSERT_TRUE(own > 0 && writes > 0 && others > 0 && pages > 0) << "it is not patched enough";
  EXPECT_TRUE(RawClient::meets_reader(own));
  // An engineer reads meanwhile, so there are pages of another.
  EXPECT_EQ(run("engineer", {"list", "variables", "line1"}).code, 1);
  EXPECT_FALSE(RawClient::meets_reader(writes, seconds(1)));
  EXPECT_FALSE(RawClient::meets_writer(others, seconds(0)));
  EXPECT_FALSE(RawClient::meets_writer(pages, seconds(0)));
}

}  // namespace
}  // namespace plchost
