// Posts whose runs are awaited: those that come again, and those to an instance that is starting.
#include <gmock/gmock.h>

#include "shm/pages/host_page.hpp"
#include "tests/support/interrupted_write.hpp"
#include "tests/unit/api/event_intake_fixture.hpp"

namespace plchost {
namespace {

class AwaitedPostAgain : public EventIntakeTest {
 protected:
  static plc_EventPost make_awaited(std::uint64_t sequence, const char* event = "ready") {
    plc_EventPost post = make_post(sequence);
    dds::copy_text(post.event, event);
    post.wait_run = true;
    return post;
  }
  static AwaitedPost only_awaited(EventIntake& sut) {
    auto awaited = sut.collect_awaited();
    EXPECT_EQ(awaited.size(), 1U);
    return awaited.empty() ? AwaitedPost{} : awaited.front();
  }
};

TEST_F(AwaitedPostAgain, IsToldWhyItWasRejected) {
  EventIntake sut = make();
  sut.process(make_awaited(1, "other"));
  EXPECT_TRUE(sut.collect_awaited().empty()) << "the acknowledgement tells it";
  const std::string text(dds::text_of(only_ack(sut).rejected_text));
  EXPECT_THAT(text, testing::HasSubstr("line1/other"));

  sut.process(make_awaited(1, "other"));

  const AwaitedPost again = only_awaited(sut);
  ASSERT_TRUE(again.unrun);
  EXPECT_EQ(again.unrun->code, ErrorCode::not_found);
  EXPECT_EQ(again.unrun->message, text);
}

TEST_F(AwaitedPostAgain, IsAwaitedAgain) {
  EventIntake sut = make();
  sut.process(make_awaited(1));
  (void)sut.collect_awaited();
  sut.process(make_awaited(1));
  const AwaitedPost again = only_awaited(sut);
  EXPECT_FALSE(again.unrun);
  ASSERT_EQ(again.targets.size(), 1U);
  EXPECT_TRUE(again.targets[0].exact);
}

class PostToAStartingInstance : public AwaitedPostAgain {
 protected:
  PostToAStartingInstance() { show(InstanceState::starting); }
  ~PostToAStartingInstance() override { HostPageWriter::remove(name_); }

  void show(InstanceState state) {
    InstanceStatus instance;
    instance.name.assign("line1");
    instance.state = state;
    page_.write_instance(0, instance);
    HostStatus host;
    host.name.assign("hosta");
    host.instance_count = 1;
    page_.write_host(host);
  }
  [[nodiscard]] static ErrorCode code(const plc_EventAck& ack) {
    return static_cast<ErrorCode>(ack.rejected_code);
  }

  HostPageWriter page_ = HostPageWriter::create(name_).value();
};

TEST_F(PostToAStartingInstance, IsToldToComeAgainUntilItsEventIsRegistered) {
  EventIntake sut = make();
  auto post = make_post(1);
  dds::copy_text(post.event, "other");
  sut.process(post);
  EXPECT_EQ(code(only_ack(sut)), ErrorCode::unavailable);
  show(InstanceState::waiting);
  post.sequence_number = 2;
  sut.process(post);
  EXPECT_EQ(code(only_ack(sut)), ErrorCode::unavailable);
  show(InstanceState::running);
  post.sequence_number = 3;
  sut.process(post);
  EXPECT_EQ(code(only_ack(sut)), ErrorCode::not_found);
}

TEST_F(PostToAStartingInstance, IsToldToComeAgainWhileTheInstancesStateIsBeingWritten) {
  show(InstanceState::running);
  EventIntake sut = make();
  auto post = make_post(1);
  dds::copy_text(post.event, "other");
  sut.process(post);
  ASSERT_EQ(code(only_ack(sut)), ErrorCode::not_found);
  const auto memory =
      MemoryFile::open(host_page_name(name_), sizeof(HostPageLayout), MemoryFile::Access::read_write).value();
  interrupt_write(reinterpret_cast<HostPageLayout*>(memory.bytes().data())->instances[0]);
  post.sequence_number = 2;
  sut.process(post);
  EXPECT_EQ(code(only_ack(sut)), ErrorCode::unavailable);
}

TEST_F(PostToAStartingInstance, IsToldToComeAgainAlsoIfTheFirstLookFindsItsStateBeingWritten) {
  const auto memory =
      MemoryFile::open(host_page_name(name_), sizeof(HostPageLayout), MemoryFile::Access::read_write).value();
  interrupt_write(reinterpret_cast<HostPageLayout*>(memory.bytes().data())->instances[0]);
  EventIntake sut = make();
  auto post = make_post(1);
  dds::copy_text(post.event, "other");
  sut.process(post);
  EXPECT_EQ(code(only_ack(sut)), ErrorCode::unavailable);
}

TEST_F(PostToAStartingInstance, IsAwaitedOnceTasksTakePosts) {
  event_.set_bound_tasks(0);
  EventIntake sut = make();
  sut.process(make_awaited(1));
  EXPECT_EQ(code(only_ack(sut)), ErrorCode::unavailable);
  EXPECT_EQ(event_.counted().count(), 0U);
  event_.set_bound_tasks(1);
  sut.process(make_awaited(2));
  EXPECT_EQ(only_ack(sut).accepted, 1U);
  EXPECT_TRUE(only_awaited(sut).targets.at(0).taken);
}

TEST_F(PostToAStartingInstance, IsCountedIfNobodyAwaitsItsRun) {
  event_.set_bound_tasks(0);
  EventIntake sut = make();
  sut.process(make_post(1));
  EXPECT_EQ(only_ack(sut).no_task, 1U);
}

}  // namespace
}  // namespace plchost
