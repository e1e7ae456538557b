// The table of topics that the build makes from control.idl, and the permissions that are written by hand.
#include <set>
#include <string>
#include <vector>

#include <fnmatch.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "api/dds/topics.hpp"
#include "api/security/policy.hpp"
#include "tests/support/text_between.hpp"

namespace plchost {
namespace {

using dds::Partition;
using security::Role;

constexpr security::GuidPrefix kPrefix{1, 2, 3};

/// The topics in the grants of `what`, "publish" or "subscribe".
std::vector<std::string> granted(Role role, const std::string& what) {
  const std::string text = security::permissions_text({.role = role, .name = "cell"}, "CN=cell", kPrefix, {});
  std::vector<std::string> topics;
  for (const std::string& grant : texts_between(text, "<" + what + ">", "</" + what + ">")) {
    for (const std::string& topic : texts_between(grant, "<topic>", "</topic>")) topics.push_back(topic);
  }
  return topics;
}

bool may(Role role, const std::string& what, const dds::TopicInfo& topic) {
  const auto patterns = granted(role, what);
  return std::ranges::any_of(patterns,
                             [&](const std::string& p) { return ::fnmatch(p.c_str(), topic.name, 0) == 0; });
}

TEST(TopicTable, HasTheQosThatTheContractSays) {
  EXPECT_EQ(dds::kPresence.qos.deadline, std::chrono::milliseconds(75));
  EXPECT_FALSE(dds::kPresence.qos.autodispose);
  EXPECT_EQ(dds::kTransition.qos.depth, 64);
  EXPECT_EQ(dds::kEventPost.qos.depth, 0);
  EXPECT_EQ(dds::kEventPost.qos.reader_holds, 4096);
  EXPECT_FALSE(dds::kEventPost.qos.transient_local);
  EXPECT_EQ(dds::kOperatorRequest.qos.blocking, std::chrono::milliseconds(100));
  EXPECT_EQ(dds::kNodePage.qos.depth, dds::kObjectPage.qos.depth) << "'as ObjectPage'";
  EXPECT_STREQ(dds::kTopicOf<plc_LogPage>.name, "plc/v1/log");
}

TEST(TopicTable, EachTopicHasANameOfItsOwnAndTheTypeOfItsName) {
  std::set<std::string> names;
  for (const dds::TopicInfo& topic : dds::kTopics) {
    EXPECT_TRUE(names.insert(topic.name).second) << topic.name;
    EXPECT_EQ(std::string(topic.type->m_typename).substr(0, 5), "plc::") << topic.name;
  }
}

TEST(TopicTable, NoWriterOfAHostWaitsLongerThanAMillisecond) {
  for (const dds::TopicInfo& topic : dds::kTopics) {
    if (topic.partition == Partition::host) continue;
    EXPECT_LE(topic.qos.blocking, std::chrono::milliseconds(1)) << topic.name;
  }
}

TEST(TopicTable, EachTopicIsGrantedToThoseWhoseItIs) {
  for (const dds::TopicInfo& topic : dds::kTopics) {
    SCOPED_TRACE(topic.name);
    const bool asked = topic.partition == Partition::host;
    EXPECT_EQ(may(Role::host, "publish", topic), !asked);
    EXPECT_EQ(may(Role::engineer, "publish", topic), asked);
    const bool of_all = topic.name == std::string(dds::kViewerRequest.name);
    EXPECT_EQ(may(Role::viewer, "publish", topic), of_all);
    const bool shown = topic.partition == Partition::status;
    const bool answer = topic.partition == Partition::client;
    EXPECT_EQ(may(Role::viewer, "subscribe", topic), shown || answer);
    EXPECT_EQ(may(Role::operating, "subscribe", topic), shown || answer);
    EXPECT_TRUE(!asked || may(Role::host, "subscribe", topic));
  }
}

}  // namespace
}  // namespace plchost
