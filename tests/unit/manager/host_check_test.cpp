#include "manager/host_check/host_check.hpp"

#include <set>

#include <gmock/gmock.h>

#include "manager/host_check/host_check_handler.hpp"
#include "tests/unit/manager/fake_tree.hpp"

namespace plchost {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;
using testing::SizeIs;

void expect_complete(const std::vector<HostFinding>& findings) {
  EXPECT_THAT(findings, SizeIs(host_checks().size()));
  std::set<std::string> ids;
  for (const HostFinding& finding : findings) {
    EXPECT_TRUE(ids.insert(finding.id).second) << finding.id << " is there twice";
    EXPECT_LE(finding.id.size(), kMaxFindingId);
    EXPECT_LE(finding.why.size(), kMaxFindingWhy) << finding.id;
    EXPECT_LE(finding.advice.size(), kMaxFindingAdvice) << finding.id;
    for (const std::string* text : {&finding.id, &finding.subject, &finding.found, &finding.why}) {
      EXPECT_THAT(*text, Not(IsEmpty())) << finding.id;
    }
    const bool known = finding.level != FindingLevel::ok && !finding.found.starts_with("not known");
    if (known) {
      EXPECT_THAT(finding.advice, Not(IsEmpty())) << finding.id;
    }
  }
}

TEST(HostCheck, SaysOfEachCheckWhatCannotBeKnownOfAnEmptyHost) {
  FakeTree tree;
  tree.remove("/sys");
  const auto findings = check_host(tree.host);
  expect_complete(findings);
  for (const HostFinding& finding : findings) {
    EXPECT_NE(finding.level, FindingLevel::problem) << finding.id << ": " << finding.found;
  }
}

TEST(HostCheck, LooksAtThisHost) {
  ManagerConfig config;
  config.instances.resize(2);
  config.instances[0].core = 0;
  config.instances[1].name = "line2";
  config.instances[1].core = 1;
  const auto host = this_host(config);
  ASSERT_THAT(host.instances, SizeIs(2));
  EXPECT_EQ(host.instances[1].name, "line2");
  expect_complete(check_host(host));
}

/// Settings for an instance end here.
class Instances : public ControlHandler {
 public:
  void handle(const ControlRequest& request, ControlReplyFunction reply) override {
    reply({.number = request.number, .code = ErrorCode::wrong_state, .text = "an instance"});
  }
};

class HostCheckHandlerTest : public testing::Test {
 protected:
  ControlReply ask(ControlVerb verb, const std::string& instance, const std::string& argument) {
    ControlReply answer;
    sut_.handle({.number = 5, .verb = verb, .instance = instance, .argument = argument},
                [&](ControlReply reply) { answer = std::move(reply); });
    EXPECT_EQ(answer.number, 5U);
    return answer;
  }

  int looks_ = 0;
  Instances instances_;
  HostCheckHandler sut_{instances_, [this] {
                          ++looks_;
                          const std::string text(500, 'x');
                          return std::vector<HostFinding>(40,
                                                          {"a", FindingLevel::note, "s", text, "w", text});
                        }};
};

TEST_F(HostCheckHandlerTest, LooksAnewForEachRequestAndTellsItInParts) {
  std::size_t received = 0;
  std::string argument;
  while (received < 40) {
    const auto reply = ask(ControlVerb::check_host, "", argument);
    ASSERT_EQ(reply.code, ErrorCode::ok) << reply.text;
    const auto part = decode_part(reply.text);
    ASSERT_TRUE(part);
    EXPECT_EQ(part->check, 1U);
    received += part->findings.size();
    argument = fmt::format("{}", received);
  }
  EXPECT_EQ(looks_, 1);
  EXPECT_EQ(decode_part(ask(ControlVerb::check_host, "", "").text)->check, 2U);
  EXPECT_EQ(looks_, 2);
}

TEST_F(HostCheckHandlerTest, RefusesAPartThatIsNotThere) {
  EXPECT_EQ(ask(ControlVerb::check_host, "", "0").code, ErrorCode::not_found) << "nothing was looked at yet";
  (void)ask(ControlVerb::check_host, "", "");
  EXPECT_EQ(ask(ControlVerb::check_host, "", "40").code, ErrorCode::ok);
  EXPECT_THAT(ask(ControlVerb::check_host, "", "41").text, HasSubstr("there are 40"));
  EXPECT_EQ(ask(ControlVerb::check_host, "", "x").code, ErrorCode::invalid_argument);
}

TEST_F(HostCheckHandlerTest, PassesOnWhatIsForAnInstance) {
  EXPECT_EQ(ask(ControlVerb::stop, "line1", "").text, "an instance");
  EXPECT_EQ(ask(ControlVerb::check_host, "line1", "").text, "an instance");
  EXPECT_EQ(looks_, 0);
}

}  // namespace
}  // namespace plchost
