// How often a wait of a client ends.
#include "api/client/wait_set.hpp"

#include <gtest/gtest.h>

#include "api/dds/text.hpp"
#include "api/dds/topics.hpp"
#include "tests/integration/api/test_host.hpp"

namespace plchost {
namespace {

/// A reader of acknowledgements that wakes, and its writer.
class WakingReader : public testing::Test {
 protected:
  WakingReader() { EXPECT_TRUE(sut_.add(reader_.get(), DDS_DATA_AVAILABLE_STATUS)); }
  void write(std::uint8_t source) const {
    plc_EventAck ack{};
    ack.source[0] = source;
    dds::copy_text(ack.host, "hosta");
    ASSERT_EQ(dds_write(writer_.get(), &ack), DDS_RETCODE_OK);
  }
  /// The waits until then.
  [[nodiscard]] int waits_until(TimePoint end) const {
    int waits = 0;
    for (; MonotonicClock::now() < end; ++waits) sut_.wait(end);
    return waits;
  }

  OwnDomain number_;
  std::shared_ptr<dds::Entity> domain_ = [this] {
    dds::DomainOptions options;
    options.domain = number_.number();
    return dds::open_domain(dds::Role::client, options).value();
  }();
  dds::Entity participant_{dds_create_participant(number_.number(), nullptr, nullptr)};
  dds::Entity topic_ = dds::make_topic(participant_.get(), dds::kEventAck).value();
  dds::Entity writer_ =
      dds::make_writer(participant_.get(), topic_.get(), dds::qos_of(dds::kEventAck)).value();
  dds::Entity reader_ =
      dds::make_reader(participant_.get(), topic_.get(), dds::qos_of(dds::kEventAck)).value();
  WaitSet sut_ = WaitSet::create(participant_.get()).value();
};

TEST_F(WakingReader, EndsOneWaitWithASampleThatNobodyTakes) {
  write(1);
  constexpr int kFew = 5;  // one is right; a wait that does not wait makes thousands
  EXPECT_LE(waits_until(MonotonicClock::now() + std::chrono::milliseconds(300)), kFew);
}

TEST_F(WakingReader, EndsTheNextWaitWithTheNextSample) {
  for (std::uint8_t source = 1; source <= 3; ++source) {
    write(source);
    const TimePoint end = soon();
    sut_.wait(end);
    EXPECT_LT(MonotonicClock::now(), end);
  }
}

}  // namespace
}  // namespace plchost
