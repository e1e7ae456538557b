// Two gateways in this process. Their clock may stand still: then no beat comes.
#include <atomic>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <thread>
#include <vector>

#include <gmock/gmock.h>
#include <unistd.h>

#include "api/dds/text.hpp"
#include "api/dds/topics.hpp"
#include "api/gateway/block_gateway.hpp"
#include "shm/block_driver/block_channel.hpp"
#include "tests/integration/api/test_host.hpp"
#include "tests/support/own_name.hpp"

namespace plchost {
namespace {

using std::chrono::milliseconds;

/// A host with a gateway and one node.
class GatewayEnd {
 public:
  GatewayEnd(const OwnDomain& domain, const std::string& host, std::uint16_t number)
      : number_(number),
        pool_name_(own_name(host)),
        pool_(ObjectPool::create(pool_name_, {.max_objects = 64}).value()),
        participant_(dds_create_participant(domain.number(), nullptr, nullptr)),
        wait_set_(WaitSet::create(participant_.get()).value()),
        gateway_(BlockGateway::create(participant_.get(),
                                      {.pool = pool_name_,
                                       .base = NodeOptions{}.base,
                                       .host = host,
                                       .number = number,
                                       .since_ns = number,
                                       .epoch = number},
                                      wait_set_)
                     .value()),
        node_(BlockNode::join({.pool = pool_name_, .entry = {.name = "node"}}).value()),
        router_(BlockRouter::create(*node_).value()),
        thread_([this] { router_->run(stop_); }),
        channel_(BlockChannel::open(*node_, "test").value()) {}
  GatewayEnd(const GatewayEnd&) = delete;
  GatewayEnd& operator=(const GatewayEnd&) = delete;
  ~GatewayEnd() {
    stop_.store(true);
    router_->wake();
    thread_.join();
    gateway_.reset();
    NodeDirectory::remove(pool_name_);
    ObjectPool::remove(pool_name_);
  }

  void serve(TimePoint now) { (void)gateway_->serve(now); }
  [[nodiscard]] NodeAddress address() { return {.host = number_, .node = node_->address().node}; }
  [[nodiscard]] SendResult send(NodeAddress to, std::span<const std::byte> contents) {
    return channel_.send(to, contents);
  }
  /// Takes all that is there; returns how many blocks that were.
  std::size_t drain() {
    std::size_t taken = 0;
    while (channel_.receive(buffer_, received_) == TakeResult::taken) ++taken;
    return taken;
  }

 private:
  std::uint16_t number_;
  std::string pool_name_;
  ObjectPool pool_;
  dds::Entity participant_;
  WaitSet wait_set_;
  std::unique_ptr<BlockGateway> gateway_;
  std::unique_ptr<BlockNode> node_;
  std::unique_ptr<BlockRouter> router_;
  std::atomic<bool> stop_{false};
  std::thread thread_;
  BlockChannel channel_;
  std::vector<std::byte> buffer_ = std::vector<std::byte>(kMaxBlockSize);
  Received received_;
};

class TwoGateways : public testing::Test {
 protected:
  /// Whether a send has this result within `patience`. Both ends serve meanwhile: at `now`, or at the real
  /// time.
  bool sends(SendResult wanted, std::span<const std::byte> contents, std::optional<TimePoint> now,
             Duration patience = kPatience) {
    for (const TimePoint end = MonotonicClock::now() + patience; MonotonicClock::now() < end;
         ::usleep(1000)) {
      const SendResult result = north_.send(south_.address(), contents);
      for (GatewayEnd* const one : {&north_, &south_}) one->serve(now.value_or(MonotonicClock::now()));
      if (result == wanted) return true;
    }
    return false;
  }

  OwnDomain domain_;
  std::unique_ptr<ControlClient> client_ = connect(domain_);  // opens the domain for this machine only
  GatewayEnd north_{domain_, "north", 1};
  GatewayEnd south_{domain_, "south", 2};
};

using FullNode = TwoGateways;

TEST_F(FullNode, ThatHasRoomAgainIsToldWithoutWaitingForTheNextBeat) {
  const std::vector<std::byte> large(60000);
  ASSERT_TRUE(sends(SendResult::sent, large, std::nullopt));
  const TimePoint frozen = MonotonicClock::now();
  // Nobody takes blocks there. It is full when nothing can be sent any more.
  while (sends(SendResult::sent, large, frozen, milliseconds(200))) {
  }
  // All blocks that have left the other host.
  for (int quiet = 0; quiet < 100; ++quiet, ::usleep(1000)) {
    south_.serve(frozen);
    if (south_.drain() > 0) quiet = 0;
  }

  bool has_come = false;
  for (const TimePoint end = soon(); !has_come && MonotonicClock::now() < end;) {
    (void)sends(SendResult::sent, large, frozen, milliseconds(10));
    has_come = south_.drain() > 0;
  }
  EXPECT_TRUE(has_come);
}

/// A stranger speaks for the first host, by a writer whose partition is another one's. In a domain without
/// security nobody keeps it from that.
class StrangersClaim : public TwoGateways {
 protected:
  [[nodiscard]] dds_entity_t writer() const { return writer_->get(); }
  [[nodiscard]] static plc_BlockHostStatus claim() {
    plc_BlockHostStatus claim{};
    dds::copy_text(claim.host, "north");
    claim.epoch = 99;
    claim.host_number = 3;
    claim.since_unix_ns = 1;
    return claim;
  }

 private:
  const dds::Entity stranger_{dds_create_participant(domain_.number(), nullptr, nullptr)};
  const Result<dds::Entity> topic_ = dds::make_topic(stranger_.get(), dds::kBlockHostStatus);
  const Result<dds::Entity> publisher_ = dds::make_publisher(stranger_.get(), dds::status_partition("west"));
  const Result<dds::Entity> writer_ =
      dds::make_writer(publisher_->get(), topic_->get(), dds::qos_of(dds::kBlockHostStatus));
};

TEST_F(StrangersClaim, InTheNameOfAHostDoesNotHideThatHost) {
  north_.serve(MonotonicClock::now());  // It tells of itself and its node, and no more for 2 s.
  const plc_BlockHostStatus sample = claim();
  ASSERT_EQ(dds_write(writer(), &sample), DDS_RETCODE_OK);
  ASSERT_EQ(dds_dispose(writer(), &sample), DDS_RETCODE_OK);
  EXPECT_TRUE(sends(SendResult::sent, std::vector<std::byte>(100), std::nullopt));
}

// The reader keeps 8 samples of one name, and has taken none so far.
TEST_F(StrangersClaim, ThatPushesTheHostsOwnOutOfAReaderIsFollowedByAnotherOne) {
  north_.serve(MonotonicClock::now());
  dds_publication_matched_status_t met{};
  for (const TimePoint end = soon(); met.current_count < 2 && MonotonicClock::now() < end; ::usleep(1000)) {
    ASSERT_EQ(dds_get_publication_matched_status(writer(), &met), DDS_RETCODE_OK);
  }
  ASSERT_EQ(met.current_count, 2U);
  plc_BlockHostStatus sample = claim();
  for (; sample.epoch < 200; ++sample.epoch) ASSERT_EQ(dds_write(writer(), &sample), DDS_RETCODE_OK);
  ASSERT_EQ(dds_wait_for_acks(writer(), kPatience.count()), DDS_RETCODE_OK);
  EXPECT_TRUE(sends(SendResult::sent, std::vector<std::byte>(100), std::nullopt));
}

}  // namespace
}  // namespace plchost
