// The announcements of a secured host: its own name, in its own partitions, under its own identity.
#include <string>
#include <string_view>
#include <vector>

#include <fnmatch.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "api/dds/host_writers.hpp"
#include "api/dds/topics.hpp"
#include "api/security/identity.hpp"
#include "api/security/policy.hpp"
#include "tests/support/text_between.hpp"

namespace plchost {
namespace {

using dds::Partition;
using security::Role;
using testing::HasSubstr;

constexpr std::string_view kClient = "010203040506070809101112";

/// The partition into which `host` writes that topic, for the client or host that reads it.
std::string partition_of(const dds::TopicInfo& topic, const std::string& host) {
  switch (topic.partition) {
    case Partition::status:
      return dds::status_partition(host);
    case Partition::client:
      return dds::client_partition(kClient, host);
    case Partition::name:
      return dds::name_partition(host);
    case Partition::blocks:
      return dds::block_partition("other", host);
    case Partition::host:
      break;
  }
  return dds::host_partition(host);
}

class HostAnnouncement : public testing::Test {
 protected:
  /// As DDS Security decides it: by the topic and by the partition of the writer or reader.
  [[nodiscard]] bool may(std::string_view what, const dds::TopicInfo& topic,
                         const std::string& partition) const {
    const auto fits = [](const std::vector<std::string>& patterns, const std::string& text) {
      return std::ranges::any_of(patterns, [&](const std::string& pattern) {
        return ::fnmatch(pattern.c_str(), text.c_str(), 0) == 0;
      });
    };
    const std::string begin = "<" + std::string(what) + ">";
    const std::string end = "</" + std::string(what) + ">";
    return std::ranges::any_of(texts_between(permissions_, begin, end), [&](const std::string& grant) {
      auto partitions = texts_between(grant, "<partition>", "</partition>");
      if (partitions.empty()) partitions.emplace_back("");  // the default partition
      return fits(texts_between(grant, "<topic>", "</topic>"), topic.name) && fits(partitions, partition);
    });
  }

  const security::Subject cell_{.role = Role::host, .name = "cell"};
  const std::string permissions_ = security::permissions_text(cell_, "CN=cell", {1, 2, 3}, {});
  /// Of other hosts, some of which a careless pattern takes for this one; and what names all hosts.
  const std::vector<std::string> others_{"south", "cell2", "cel", "acell", "cell.b",
                                         "Cell",  "*",     "c*",  "?ell"};
};

TEST_F(HostAnnouncement, IsOfItsOwnNameOnly) {
  for (const dds::TopicInfo& topic : dds::kTopics) {
    if (topic.partition == Partition::host) continue;
    SCOPED_TRACE(topic.name);
    const std::string own = partition_of(topic, "cell");
    EXPECT_TRUE(may("publish", topic, own)) << own;
    EXPECT_EQ(dds::host_in_partition(own), "cell") << "a reader finds the host by the partition";
    for (const std::string& other : others_) {
      EXPECT_FALSE(may("publish", topic, partition_of(topic, other))) << other;
    }
    EXPECT_FALSE(may("publish", topic, "")) << "a partition that names no host";
  }
}

// Its requests, posts and the claims of its name are for the host that they name.
TEST_F(HostAnnouncement, LetsItReadWhatIsForItsOwnNameOnly) {
  for (const dds::TopicInfo& topic : dds::kTopics) {
    const bool asked = topic.partition == Partition::host || topic.partition == Partition::name;
    if (!asked) continue;
    SCOPED_TRACE(topic.name);
    EXPECT_TRUE(may("subscribe", topic, partition_of(topic, "cell")));
    for (const std::string& other : others_) {
      EXPECT_FALSE(may("subscribe", topic, partition_of(topic, other))) << other;
    }
  }
  EXPECT_TRUE(may("subscribe", dds::kBlock, dds::block_partition("cell", "south")));
  EXPECT_FALSE(may("subscribe", dds::kBlock, dds::block_partition("south", "other")));
  EXPECT_FALSE(may("subscribe", dds::kReply, dds::client_partition(kClient, "cell")));
}

TEST_F(HostAnnouncement, IsMadeWithTheIdentityOfThatHostOnly) {
  EXPECT_TRUE(security::check_host_identity(cell_, "cell"));
  for (const std::string& other : others_) {
    const auto refused = security::check_host_identity(cell_, other);
    ASSERT_FALSE(refused) << other;
    EXPECT_EQ(refused.error().code, ErrorCode::refused);
    EXPECT_THAT(refused.error().message, HasSubstr("that of another host than '" + other + "'"));
  }
  for (const Role role : {Role::viewer, Role::operating, Role::engineer, Role::admin}) {
    EXPECT_FALSE(security::check_host_identity({.role = role, .name = "cell"}, "cell")) << to_string(role);
  }
}

TEST_F(HostAnnouncement, IsMadeByNoClient) {
  for (const Role role : {Role::viewer, Role::operating, Role::engineer, Role::admin}) {
    const std::string client = security::permissions_text({.role = role, .name = "cell"}, "CN=cell", {}, {});
    for (const std::string& grant : texts_between(client, "<publish>", "</publish>")) {
      EXPECT_EQ(texts_between(grant, "<partition>", "</partition>"), std::vector<std::string>{"h.*"});
    }
  }
}

}  // namespace
}  // namespace plchost
