// Which hosts are there for the API server of a host. Here a participant of Cyclone says that it is of one.
#include <chrono>
#include <memory>
#include <thread>

#include <gtest/gtest.h>

#include "api/dds/domain.hpp"
#include "api/dds/gate/host_mark.hpp"
#include "api/dds/guid.hpp"
#include "api/dds/qos.hpp"
#include "api/dds/samples.hpp"
#include "tests/integration/api/test_host.hpp"

namespace plchost {
namespace {

class OtherHosts : public testing::Test {
 protected:
  void SetUp() override {
    dds::DomainOptions options;
    options.domain = own_.number();
    domain_ = dds::open_domain(dds::Role::client, options).value();
  }

  /// The announcements go to all ports of this machine, each 200 ms, with these words from now on.
  void announce(const dds::HostMark& mark) {
    dds::Qos qos;
    qos.user_data(dds::words_of(mark));
    if (participant_.get() > 0) {
      ASSERT_EQ(dds_set_qos(participant_.get(), qos.get()), DDS_RETCODE_OK);
      return;
    }
    participant_ = dds::Entity(dds_create_participant(own_.number(), qos.get(), nullptr));
    ASSERT_GT(participant_.get(), 0);
    met_ = dds::Entity(
        dds_create_reader(participant_.get(), DDS_BUILTIN_TOPIC_DCPSPARTICIPANT, nullptr, nullptr));
  }
  /// Whether the server has answered, which it does to participants that are there for it.
  bool is_met() {
    dds::take_all<dds_builtintopic_participant_t>(met_.get(), [&](const auto& participant, const auto& info) {
      const auto guid = dds::Guid::from(participant.key.v);
      if (guid == dds::guid_of(participant_.get())) return;
      is_there_ = info.instance_state == DDS_IST_ALIVE;
    });
    return is_there_;
  }
  bool is_met_soon() {
    const TimePoint end = soon();
    while (!is_met() && MonotonicClock::now() < end) std::this_thread::sleep_for(kLook);
    return is_met();
  }
  /// Through some ten announcements.
  bool is_met_in_a_while() {
    std::this_thread::sleep_for(std::chrono::seconds(2));
    return is_met();
  }

  static constexpr Duration kLook = std::chrono::milliseconds(10);
  OwnDomain own_;
  std::shared_ptr<dds::Entity> domain_;
  TestHost host_{own_, "hosta"};
  dds::Entity participant_;
  dds::Entity met_;
  bool is_there_ = false;
};

TEST_F(OtherHosts, AreThereIfTheyHaveTheSameName) {
  host_.start_server();
  announce({.name = "hostb"});
  EXPECT_FALSE(is_met_in_a_while());
  announce({.name = "hosta"});
  EXPECT_TRUE(is_met_soon());
}

TEST_F(OtherHosts, AreThereIfBothSendBlocks) {
  host_.start_server({"--host-number", "1"});
  announce({.name = "hostb"});
  EXPECT_FALSE(is_met_in_a_while());
  announce({.name = "hostb", .sends_blocks = true});
  EXPECT_TRUE(is_met_soon());
}

}  // namespace
}  // namespace plchost
