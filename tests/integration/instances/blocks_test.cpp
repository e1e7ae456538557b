// Real instances send each other blocks in the cycles of their applications.
#include <csignal>
#include <optional>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "instances/launch/launch_contract.hpp"
#include "shm/block_driver/node_directory.hpp"
#include "tests/integration/instances/instance_process.hpp"

namespace plchost::testing {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

class BlocksBetweenInstances : public ::testing::Test {
 protected:
  using Line = std::unique_ptr<InstanceProcess>;

  /// An instance that sends blocks to `peer`; empty: it only answers.
  Line talker(const std::string& name, const std::string& peer, const std::string& settings = {},
              bool calls = false) {
    std::vector<std::string> environment;
    if (!peer.empty()) environment.push_back("TALKER_PEER=" + peer);
    if (calls) environment.emplace_back("TALKER_CALL=1");
    return start(name, settings, {"--application", application("talker")}, environment);
  }
  Line start(const std::string& name, const std::string& settings, std::vector<std::string> arguments = {},
             const std::vector<std::string>& environment = {}) {
    arguments.insert(arguments.end(),
                     {"--name", name, "--settings", sandbox_.write(name + ".cfg", settings)});
    return std::make_unique<InstanceProcess>(sandbox_, arguments, environment);
  }
  [[nodiscard]] static bool says(const Line& line, const std::string& text) {
    return eventually([&] { return line->log().find(text) != std::string::npos; });
  }
  [[nodiscard]] std::optional<std::uint16_t> address(const std::string& name) const {
    const auto directory = NodeDirectory::open_to_read(sandbox_.pool());
    return directory ? directory->find(name) : std::nullopt;
  }

  Sandbox sandbox_;
};

TEST_F(BlocksBetweenInstances, TwoAskEachOtherInTheirCycles) {
  const Line one = talker("line1", "line2");
  const Line two = talker("line2", "line1");
  EXPECT_TRUE(says(one, "300 replies")) << one->log();
  EXPECT_TRUE(says(two, "300 replies")) << two->log();
  EXPECT_THAT(one->log() + two->log(), Not(HasSubstr("wrong")));
}

TEST_F(BlocksBetweenInstances, TwoThatAreNoNeighboursTalkThroughTheOneBetween) {
  const Line between = start("line2", "[CmpBlkDrvShm]\nEnable=1\n[CmpRouter]\nForward=1\n");
  const Line one = talker("line1", "line3", "[CmpRouter]\nNeighbours=line2\n");
  const Line three = talker("line3", "line1", "[CmpRouter]\nNeighbours=line2\n");
  EXPECT_TRUE(says(one, "100 replies")) << one->log();
  EXPECT_TRUE(says(three, "100 replies")) << three->log();
  EXPECT_THAT(one->log() + three->log(), Not(HasSubstr("wrong")));
  const auto directory = NodeDirectory::open_to_read(sandbox_.pool());
  ASSERT_TRUE(directory);
  EXPECT_GE(directory->slot(*address("line2")).counters.forwarded.load(), 400U);
}

TEST_F(BlocksBetweenInstances, WhoIsKilledIsReachedAgainWhenItIsBack) {
  const Line one = talker("line1", "line2", "[CmpBlkDrvShm]\nForcedAddress=7\n");
  Line two = talker("line2", "line1");
  EXPECT_TRUE(says(one, "100 replies")) << one->log();
  EXPECT_EQ(address("line1"), 7);
  const auto before = address("line2");
  for (int i = 0; i < 3; ++i) {
    EXPECT_EQ(two->end(SIGKILL), -SIGKILL);
    EXPECT_TRUE(eventually([&] { return !address("line2"); })) << "its death was not seen";
    two = talker("line2", "line1");
    EXPECT_TRUE(says(two, "100 replies")) << two->log();
    EXPECT_EQ(address("line2"), before);
  }
  EXPECT_TRUE(says(one, "200 replies")) << one->log();
  EXPECT_THAT(one->log() + two->log(), Not(HasSubstr("wrong")));
}

TEST_F(BlocksBetweenInstances, ACallToAllIsHeardByAllOthers) {
  const Line one = talker("line1", "", "[CmpBlkDrvShm]\nForcedAddress=1\n", true);
  const Line two = talker("line2", "");
  const Line three = talker("line3", "");
  EXPECT_TRUE(says(two, "called by 1")) << two->log();
  EXPECT_TRUE(says(three, "called by 1")) << three->log();
  EXPECT_THAT(one->log(), Not(HasSubstr("called by")));
}

TEST_F(BlocksBetweenInstances, AForcedAddressThatIsTakenEndsTheStartAndSaysByWhom) {
  const Line one = talker("line1", "", "[CmpBlkDrvShm]\nForcedAddress=9\n");
  EXPECT_TRUE(says(one, "talks from address 9"));
  const Line two = talker("line2", "", "[CmpBlkDrvShm]\nForcedAddress=9\n");
  EXPECT_EQ(two->end(), kExitSetupFailed);
  EXPECT_THAT(two->log(), HasSubstr("node address 9 is taken: node 'line1'"));
  EXPECT_THAT(two->log(), HasSubstr("[CmpBlkDrvShm]"));
}

TEST_F(BlocksBetweenInstances, OthersOfAnotherBaseNameAreNotSeen) {
  const Line one = talker("line1", "line2", "[CmpBlkDrvShm]\nBaseName=a\n");
  const Line two = talker("line2", "line1", "[CmpBlkDrvShm]\nBaseName=b\n");
  EXPECT_TRUE(says(one, "talks from address"));
  EXPECT_TRUE(says(two, "talks from address"));
  const auto first = NodeDirectory::open_to_read(sandbox_.pool(), "a");
  ASSERT_TRUE(first);
  EXPECT_TRUE(first->find("line1"));
  EXPECT_FALSE(first->find("line2"));
}

TEST_F(BlocksBetweenInstances, AnInstanceThatHasNothingToDoWithItIsNoNode) {
  InstanceProcess one(sandbox_, {"--application", application("all_kinds")});
  one.wait_until_up();
  EXPECT_EQ(NodeDirectory::open_to_read(sandbox_.pool()).error().code, ErrorCode::not_found);
}

}  // namespace
}  // namespace plchost::testing
