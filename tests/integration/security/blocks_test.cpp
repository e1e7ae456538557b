// Hosts of one plant exchange blocks, others do not.
#include "tests/integration/api/gateway_side.hpp"
#include "tests/integration/security/secured_host.hpp"

namespace plchost {
namespace {

class SecuredBlocks : public SecuredHost {
 protected:
  static bool goes(Side& from, Side& to, NodeAddress address, Duration within) {
    const std::vector<std::byte> contents(1000, std::byte{7});
    for (const TimePoint end = MonotonicClock::now() + within; MonotonicClock::now() < end; ::usleep(1000)) {
      if (from.channel.send(address, contents) == SendResult::sent) return to.next() == contents;
    }
    return false;
  }
};

TEST_F(SecuredBlocks, GoBetweenHostsOfAPlant) {
  ASSERT_TRUE(plant().add(security::Role::host, "north"));
  ASSERT_TRUE(plant().add(security::Role::host, "south"));
  Side north(domain_, "north", 1, "press", {"--identity", folder("north")});
  Side south(domain_, "south", 2, "packer", {"--identity", folder("south")});
  EXPECT_TRUE(reach(north, south.address_at(2), south));
  EXPECT_TRUE(reach(south, north.address_at(1), north));
}

TEST_F(SecuredBlocks, DoNotGoToAHostOfAnotherPlant) {
  const std::string other = base_ + "/other";
  ASSERT_TRUE(security::SecurityFolder::init(other, "south"));
  ASSERT_TRUE(plant().add(security::Role::host, "north"));
  Side north(domain_, "north", 1, "press", {"--identity", folder("north")});
  Side south(domain_, "south", 2, "packer", {"--identity", other + "/south"});
  EXPECT_FALSE(goes(north, south, south.address_at(2), std::chrono::seconds(3)));
}

}  // namespace
}  // namespace plchost
