// The memory that clients leave behind in the API server.
#include <chrono>
#include <memory>
#include <optional>
#include <thread>

#include <gtest/gtest.h>

#include "api/client/poster.hpp"
#include "api/dds/instances.hpp"
#include "api/dds/text.hpp"
#include "api/dds/topics.hpp"
#include "tests/integration/api/memory_growth.hpp"
#include "tests/integration/api/test_host.hpp"

namespace plchost {
namespace {

/// A domain with a host and a client that stays, whose participant makes those of the others cheap.
class Memory : public testing::Test {
 protected:
  Memory() {
    host_.write_instance(0, "line1", InstanceState::running);
    host_.write_count(1);
    (void)host_.add_event("line1", "ready");
    server_.emplace(host_, std::vector<std::string>{"--audit-folder", host_.run_directory() + "/audit"});
    staying_ = connect(domain_);
  }
  template <class Use>
  void expect_bounded(int first, int then, Use use) {
    expect_bounded_memory(*server_, {.first = first, .then = then, .at_once = 8, .rounds = 3}, use);
  }

  OwnDomain domain_;
  TestHost host_{domain_, "hosta"};

 private:
  std::optional<MeasuredServer> server_;
  std::unique_ptr<ControlClient> staying_;
};

TEST_F(Memory, ClientsThatComeAndGoLeaveNothingBehind) {
  if (kSanitized) GTEST_SKIP() << "a sanitizer keeps what was freed";
  expect_bounded(1100, 1500, [this] {
    const auto client = connect(domain_);
    ASSERT_TRUE(client->instances("hosta", soon()));
    const auto reply = client->call({"hosta", plc_OPERATION_STOP, "line1", ""}, soon());
    ASSERT_TRUE(reply) << reply.error().describe();
    const auto posted = client->post_event({"hosta", "line1", "ready"}, 1, {}, kPatience);
    ASSERT_TRUE(posted) << posted.error().describe();
  });
}

TEST_F(Memory, WritersOfOneClientThatPostOnceLeaveNothingBehind) {
  if (kSanitized) GTEST_SKIP() << "a sanitizer keeps what was freed";
  const dds::Entity participant(dds_create_participant(domain_.number(), nullptr, nullptr));
  const auto events = dds::make_topic(participant.get(), dds::kEventPost).value();
  expect_bounded(1200, 6000, [&] {
    auto poster = EventPoster::create(participant.get(), events.get(), "hosta").value();
    for (const TimePoint end = soon(); !poster.matched();) {
      ASSERT_LT(MonotonicClock::now(), end);
      std::this_thread::sleep_for(std::chrono::microseconds(200));
    }
    ASSERT_TRUE(poster.post_once("line1", "ready", {}));
  });
}

class Instances : public testing::Test {
 protected:
  [[nodiscard]] dds::Entity make_writer() const {
    return dds::make_writer(participant_.get(), topic_.get(), dds::qos_of(dds::kEventAck)).value();
  }
  static plc_EventAck sample(std::uint8_t source) {
    plc_EventAck result{};
    result.source[0] = source;
    dds::copy_text(result.host, "hosta");
    return result;
  }
  static bool is_known(const dds::Entity& writer, const plc_EventAck& instance) {
    return dds_lookup_instance(writer.get(), &instance) != DDS_HANDLE_NIL;
  }

  OwnDomain number_;
  std::shared_ptr<dds::Entity> domain_ = [this] {
    dds::DomainOptions options;
    options.domain = number_.number();
    return dds::open_domain(dds::Role::client, options).value();
  }();
  dds::Entity participant_{dds_create_participant(number_.number(), nullptr, nullptr)};
  dds::Entity topic_ = dds::make_topic(participant_.get(), dds::kEventAck).value();
};

TEST_F(Instances, AreForgottenWhenTheyAreUnregistered) {
  const dds::Entity writer = make_writer();
  const plc_EventAck one = sample(1);
  const plc_EventAck other = sample(2);
  for (const auto* instance : {&one, &other}) ASSERT_EQ(dds_write(writer.get(), instance), DDS_RETCODE_OK);
  dds::unregister_instance(writer.get(), &one);
  EXPECT_FALSE(is_known(writer, one));
  EXPECT_TRUE(is_known(writer, other));
}

TEST_F(Instances, OfTwoWritersAreKeptUntilBothHaveUnregisteredThem) {
  const dds::Entity writer = make_writer();
  const dds::Entity another = make_writer();
  const plc_EventAck instance = sample(1);
  for (const auto* one : {&writer, &another}) ASSERT_EQ(dds_write(one->get(), &instance), DDS_RETCODE_OK);
  dds::unregister_instance(writer.get(), &instance);
  EXPECT_TRUE(is_known(another, instance));
  ASSERT_EQ(dds_write(another.get(), &instance), DDS_RETCODE_OK);
  ASSERT_EQ(dds_write(writer.get(), &instance), DDS_RETCODE_OK);
  dds::unregister_instance(another.get(), &instance);
  EXPECT_TRUE(is_known(writer, instance));
  dds::unregister_instance(writer.get(), &instance);
  EXPECT_FALSE(is_known(writer, instance));
}

TEST_F(Instances, ThatWereNeverWrittenCannotBeUnregistered) {
  const dds::Entity writer = make_writer();
  const plc_EventAck instance = sample(1);
  dds::unregister_instance(writer.get(), &instance);
  ASSERT_EQ(dds_write(writer.get(), &instance), DDS_RETCODE_OK);
  EXPECT_TRUE(is_known(writer, instance));
}

}  // namespace
}  // namespace plchost
