#pragma once

#include <cstdint>
#include <string>

#include <gmock/gmock.h>

#include "api/dds/text.hpp"
#include "api/server/posts/event_intake.hpp"
#include "tests/support/own_name.hpp"

namespace plchost {

/// An intake of "hosta", whose pool has the event line1/ready with a task.
class EventIntakeTest : public testing::Test {
 protected:
  EventIntakeTest() {
    event_ = pool_.create_event("line1/ready").value();
    event_.set_registered(true);
    event_.set_bound_tasks(1);
  }
  ~EventIntakeTest() override {
    MemoryFile::remove(PostLedger::file_name(name_));
    ObjectPool::remove(name_);
  }

  /// As a server leaves it that was killed when so many events of it were posted.
  void leave_first_batch_at(std::uint32_t posted) const {
    PostLedger ledger = PostLedger::open(pool_).value();
    dds::Guid source;
    source.bytes[0] = 9;
    ledger.set(ledger.entry_for(source, 1), {.batch = 1, .batch_done = posted});
  }
  [[nodiscard]] EventIntake make() const {
    return {"hosta", pool_, PostLedger::open(pool_).value(), 7, guard_};
  }

  static plc_EventPost make_post(std::uint64_t sequence, std::uint64_t base = 1, std::uint8_t source = 1) {
    plc_EventPost post{};
    post.source[0] = source;
    post.sequence_number = sequence;
    post.base_sequence = base;
    dds::copy_text(post.host, "hosta");
    dds::copy_text(post.instance, "line1");
    dds::copy_text(post.event, "ready");
    return post;
  }
  static plc_EventAck only_ack(EventIntake& sut) {
    const auto acks = sut.collect_acks();
    EXPECT_EQ(acks.size(), 1U);
    return acks.empty() ? plc_EventAck{} : acks.front();
  }

  std::string name_ = own_name("intake");
  ObjectPool pool_ = ObjectPool::create(name_, {.max_objects = 64}).value();
  AccessGuard guard_;
  PoolEvent event_;
};

}  // namespace plchost
