// A controller against another one whose identity it does not have: with a patched plugin that lets it try.
#include <limits>
#include <optional>
#include <thread>

#include <sys/wait.h>

#include "api/dds/samples.hpp"
#include "api/dds/text.hpp"
#include "tests/integration/security/secured_host.hpp"

namespace plchost {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using testing::HasSubstr;
using testing::SizeIs;

class StolenHost : public SecuredHost {
 protected:
  StolenHost() {
    EXPECT_TRUE(plant().add(security::Role::host, "south"));
    start();
    EXPECT_TRUE(sees_host(folder("operator")));
  }
  /// A call of an operator that the manager does not answer.
  [[nodiscard]] Child waiting_operator() {
    host_.silent = true;
    Child client(PLCCTL_PROGRAM, {"--domain", std::to_string(domain_.number()), "--identity",
                                  folder("operator"), "--timeout", "60", "stop", "instance", "line1"});
    for (const TimePoint end = soon(); host_.requests().empty() && MonotonicClock::now() < end;)
      std::this_thread::sleep_for(milliseconds(5));
    EXPECT_THAT(host_.requests(), SizeIs(1));
    return client;
  }
  /// The writer of requests that a participant can see.
  static std::optional<dds::Guid> requests_of_operator(const RawClient& client) {
    const dds::Entity reader(
        dds_create_reader(client.participant(), DDS_BUILTIN_TOPIC_DCPSPUBLICATION, nullptr, nullptr));
    std::optional<dds::Guid> found;
    for (const TimePoint end = soon(); !found && MonotonicClock::now() < end;) {
      dds::take_valid<dds_builtintopic_endpoint_t>(reader.get(), [&](const auto& writer, const auto&) {
        if (std::string_view(writer.topic_name) == dds::kOperatorRequest.name)
          found = dds::Guid::from(writer.key.v);
      });
      std::this_thread::sleep_for(milliseconds(5));
    }
    return found;
  }
  static plc_NameClaim oldest_claim() {
    plc_NameClaim claim{};
    dds::copy_text(claim.host, "cell");
    dds::copy_text(claim.place, "elsewhere");
    claim.serving = true;
    claim.since_unix_ns = 0;
    return claim;
  }
};

// So that it is known what the others below fail for.
TEST_F(StolenHost, ItsOwnServerIsEndedByAnOlderOne) {
  RawClient twin(domain_, folder("cell"), /*patched=*/true, dds::Role::server);
  const auto writer = twin.write(dds::kNameClaim, "n.cell", dds::qos_of(dds::kNameClaim));
  ASSERT_TRUE(RawClient::meets_reader(writer));
  plc_NameClaim claim = oldest_claim();
  twin.guid().copy_to(claim.server);
  ASSERT_EQ(dds_write(writer, &claim), DDS_RETCODE_OK);
  EXPECT_NE(host_.server().wait(), 0);
}

TEST_F(StolenHost, EndsNoServerOfAnother) {
  RawClient south(domain_, folder("south"), /*patched=*/true, dds::Role::server);
  ASSERT_TRUE(south.is_in_domain());
  const auto writer = south.write(dds::kNameClaim, "n.cell", dds::qos_of(dds::kNameClaim));
  ASSERT_GT(writer, 0) << "it is not patched enough";
  plc_NameClaim claim = oldest_claim();
  south.guid().copy_to(claim.server);
  ASSERT_EQ(dds_write(writer, &claim), DDS_RETCODE_OK);
  EXPECT_FALSE(RawClient::meets_reader(writer, seconds(2)));
  EXPECT_TRUE(sees_host(folder("operator")));
}

TEST_F(StolenHost, ReadsNoRequestsAndPostsOfAnother) {
  RawClient south(domain_, folder("south"), /*patched=*/true, dds::Role::server);
  const auto requests = south.read(dds::kOperatorRequest, "h.cell", dds::qos_of(dds::kOperatorRequest));
  const auto all_requests = south.read(dds::kOperatorRequest, "h.*", dds::qos_of(dds::kOperatorRequest));
  const auto posts = south.read(dds::kEventPost, "h.cell", dds::qos_of(dds::kEventPost));
  ASSERT_TRUE(requests > 0 && all_requests > 0 && posts > 0);
  Child poster(PLCCTL_PROGRAM,
               {"--domain", std::to_string(domain_.number()), "--identity", folder("operator"), "--timeout",
                "60", "post", "event", "line1/ready", "--count", "200", "--interval-us", "10000"});
  Child client = waiting_operator();
  EXPECT_TRUE(requests_of_operator(south)) << "it sees that there is a writer";
  EXPECT_FALSE(RawClient::meets_writer(requests, seconds(1)));
  EXPECT_FALSE(RawClient::meets_writer(all_requests, seconds(0)));
  EXPECT_FALSE(RawClient::meets_writer(posts, seconds(0)));
  EXPECT_EQ(poster.wait(), 0);
  EXPECT_EQ(event_.counted().count(), 200U);
}

TEST_F(StolenHost, AnswersForNobodyElse) {
  RawClient south(domain_, folder("south"), /*patched=*/true, dds::Role::server);
  Child client = waiting_operator();
  const auto asked_by = requests_of_operator(south);
  ASSERT_TRUE(asked_by);
  const std::string guid = asked_by->participant().hex();
  const auto as_cell =
      south.write(dds::kReply, dds::client_partition(guid, "cell"), dds::qos_of(dds::kReply));
  const auto as_south =
      south.write(dds::kReply, dds::client_partition(guid, "south"), dds::qos_of(dds::kReply));
  EXPECT_TRUE(RawClient::meets_reader(as_south)) << "as itself it may answer";
  EXPECT_FALSE(RawClient::meets_reader(as_cell, seconds(1)));
  plc_Reply reply{};
  asked_by->copy_to(reply.header.related_identity.writer_guid);
  dds::copy_text(reply.host, "cell");
  for (int i = 1; i < 20; ++i) {
    reply.header.related_identity.sequence_number = i;
    (void)dds_write(as_cell, &reply);
    (void)dds_write(as_south, &reply);
  }
  std::this_thread::sleep_for(seconds(2));
  EXPECT_EQ(::waitpid(client.pid(), nullptr, WNOHANG), 0) << "it has believed that it is done";
}

TEST_F(StolenHost, HidesNobodyElse) {
  RawClient south(domain_, folder("south"), /*patched=*/true, dds::Role::server);
  const auto as_cell = south.write(dds::kPresence, "s.cell", dds::qos_of(dds::kPresence));
  const auto as_south = south.write(dds::kPresence, "s.south", dds::qos_of(dds::kPresence));
  const auto of_all = south.write(dds::kPresence, "s.*", dds::qos_of(dds::kPresence));
  plc_Presence presence{};
  dds::copy_text(presence.host, "cell");
  presence.epoch = std::numeric_limits<std::uint64_t>::max();
  std::jthread liar([&](const std::stop_token& stop) {
    while (!stop.stop_requested()) {
      for (const dds_entity_t writer : {as_cell, as_south, of_all}) (void)dds_write(writer, &presence);
      std::this_thread::sleep_for(milliseconds(25));
    }
  });
  const auto listed = run("operator", {"list", "hosts", "--json"});
  EXPECT_EQ(listed.code, 0) << listed.errors;
  EXPECT_THAT(listed.output, HasSubstr("alive"));
  const auto stopped = run("operator", {"stop", "instance", "line1"});
  EXPECT_EQ(stopped.code, 0) << stopped.errors;
}

TEST_F(StolenHost, ServesUnderNoOtherName) {
  const std::vector<std::string> arguments{
      "--host",     "cell2",           "--domain",        std::to_string(domain_.number()),
      "--pool",     host_.pool_name(), "--run-directory", host_.run_directory(),
      "--identity", folder("south")};
  const auto refused = run_program(PLCHOST_DDS_PROGRAM, arguments);
  EXPECT_EQ(refused.code, 1);
  EXPECT_THAT(refused.errors, HasSubstr("that of another host than 'cell2'"));
}

}  // namespace
}  // namespace plchost
