#include <stop_token>
#include <string>
#include <thread>
#include <vector>

#include <gmock/gmock.h>

#include "api/client/control_client.hpp"
#include "api/dds/text.hpp"
#include "tests/integration/api/test_host.hpp"

namespace plchost {
namespace {

using testing::ElementsAre;

// A host that clients have discovered before it shows anything.
class LateHost {
 public:
  LateHost(const OwnDomain& domain, std::string name)
      : name_(std::move(name)),
        participant_(dds::make_participant(domain.number(), nullptr, "a late host").value()),
        presence_topic_(dds::make_topic(participant_.get(), dds::kPresence).value()),
        status_topic_(dds::make_topic(participant_.get(), dds::kHostStatus).value()),
        presence_(open(presence_topic_, dds::kPresence)),
        status_(open(status_topic_, dds::kHostStatus)) {}

  /// From then on, as long as this object lives.
  void show_after(Duration time) {
    shows_ = std::jthread([this, time](const std::stop_token& stop) {
      std::this_thread::sleep_for(time);
      while (!stop.stop_requested()) {
        show();
        std::this_thread::sleep_for(dds::kPresencePeriod);
      }
    });
  }

 private:
  [[nodiscard]] dds::PartitionWriter open(const dds::Entity& topic, const dds::TopicInfo& info) const {
    return dds::open_writer(participant_.get(), dds::status_partition(name_), topic.get(), dds::qos_of(info))
        .value();
  }
  void show() const {
    plc_HostStatus status{};
    dds::copy_text(status.host, name_);
    status.epoch = 1;
    (void)dds_write(status_.writer.get(), &status);
    plc_Presence presence{};
    dds::copy_text(presence.host, name_);
    presence.epoch = 1;
    (void)dds_write(presence_.writer.get(), &presence);
  }

  std::string name_;
  dds::Entity participant_;
  dds::Entity presence_topic_;
  dds::Entity status_topic_;
  dds::PartitionWriter presence_;
  dds::PartitionWriter status_;
  std::jthread shows_;
};

class LateHosts : public testing::Test {
 protected:
  LateHosts() {
    host_.start_server();
    EXPECT_TRUE(sut_->host("hosta", soon()));
  }
  [[nodiscard]] std::vector<std::string> names_of_hosts(TimePoint deadline) {
    std::vector<std::string> names;
    for (const HostView& host : sut_->hosts(deadline)) names.push_back(host.name);
    return names;
  }

  OwnDomain domain_;
  TestHost host_{domain_, "hosta"};
  std::unique_ptr<ControlClient> sut_ = connect(domain_);
};

TEST_F(LateHosts, AreHostsIfDdsHasDiscoveredThem) {
  LateHost late(domain_, "hostb");
  late.show_after(3 * ControlClient::kQuiet);
  EXPECT_THAT(names_of_hosts(soon()), ElementsAre("hosta", "hostb"));
}

TEST_F(LateHosts, HoldUpNobodyForEver) {
  const LateHost never(domain_, "hostb");
  const TimePoint deadline = MonotonicClock::now() + std::chrono::minutes(5);
  EXPECT_THAT(names_of_hosts(deadline), ElementsAre("hosta"));
  EXPECT_LT(MonotonicClock::now(), deadline);
}

}  // namespace
}  // namespace plchost
