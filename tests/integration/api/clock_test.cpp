// A host whose clock was set back: the epoch of its next plchost-dds is below that of the one before.
#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <future>
#include <memory>
#include <vector>

#include <gtest/gtest.h>
#include <sys/syscall.h>
#include <time.h>
#include <unistd.h>

#include "api/client/file_sender.hpp"
#include "api/client/poster.hpp"
#include "api/client/transition_log.hpp"
#include "api/dds/domain.hpp"
#include "api/dds/text.hpp"
#include "api/dds/topics.hpp"
#include "tests/integration/api/test_host.hpp"

namespace {
std::atomic<std::int64_t> wall_clock_ahead_s{0};
}

// In place of the C library's, for the whole program, Cyclone included. A time by this clock comes late, as
// when somebody sets the clock on the wall back while a thread waits for it.
extern "C" int clock_gettime(clockid_t clock, timespec* time) noexcept {
  const auto result = ::syscall(SYS_clock_gettime, clock, time);
  if (clock == CLOCK_REALTIME && result == 0) time->tv_sec += wall_clock_ahead_s.load();
  return static_cast<int>(result);
}

namespace plchost {
namespace {

class ClockSetBack : public testing::Test {
 protected:
  [[nodiscard]] dds::DomainOptions options() const {
    dds::DomainOptions options;
    options.domain = domain_.number();
    return options;
  }
  [[nodiscard]] static plc_EventAck ack(const dds::Guid& source, std::uint64_t epoch, std::uint64_t number) {
    plc_EventAck ack{};
    source.copy_to(ack.source);
    ack.epoch = epoch;
    ack.sequence_number = number;
    ack.accepted = number;
    ack.credits = EventPoster::kWindow;
    return ack;
  }

  static constexpr std::uint64_t kNewer = 9;
  static constexpr std::uint64_t kOlder = 7;
  OwnDomain domain_;
  std::shared_ptr<dds::Entity> opened_ = dds::open_domain(dds::Role::client, options()).value();
  dds::Entity participant_{dds_create_participant(domain_.number(), nullptr, nullptr)};
  TimePoint now_ = MonotonicClock::now();
};

TEST_F(ClockSetBack, LetsPostsBeAcknowledgedAgain) {
  const auto topic = dds::make_topic(participant_.get(), dds::kEventPost).value();
  auto sut = EventPoster::create(participant_.get(), topic.get(), "hosta").value();
  sut.post(EventId{"line1", "ready"}, now_);
  EXPECT_TRUE(sut.on_ack(ack(sut.source(), kNewer, 1), now_));

  sut.post(EventId{"line1", "ready"}, now_);
  EXPECT_FALSE(sut.on_ack(ack(sut.source(), kOlder, 2), now_)) << "it may be a late last word";
  EXPECT_EQ(sut.unacknowledged(), 1U);
  EXPECT_TRUE(sut.on_ack(ack(sut.source(), kOlder, 2), now_ + 2 * kServerGone));
  EXPECT_EQ(sut.unacknowledged(), 0U);
  EXPECT_EQ(sut.report().accepted, 2U);
}

TEST_F(ClockSetBack, LetsBatchesBeAcknowledgedAgain) {
  const auto topic = dds::make_topic(participant_.get(), dds::kEventBatch).value();
  auto sut = BatchPoster::create(participant_.get(), topic.get(), "hosta").value();
  const std::vector<EventId> batch{{"line1", "ready"}};
  sut.post(batch, now_);
  sut.on_ack(ack(sut.source(), kNewer, 1), now_);
  EXPECT_EQ(sut.unacknowledged(), 0U);

  sut.post(batch, now_);
  sut.on_ack(ack(sut.source(), kOlder, 2), now_);
  EXPECT_EQ(sut.unacknowledged(), 1U);
  sut.on_ack(ack(sut.source(), kOlder, 2), now_ + 2 * kServerGone);
  EXPECT_EQ(sut.unacknowledged(), 0U);
}

TEST_F(ClockSetBack, LetsChangesOfStateBeToldAgain) {
  TransitionLog sut;
  const auto transition = [](std::uint64_t epoch, std::uint64_t stream, std::uint64_t number) {
    plc_Transition sample{};
    dds::copy_text(sample.host, "hosta");
    dds::copy_text(sample.instance, "line1");
    sample.epoch = epoch;
    sample.stream = stream;
    sample.sequence_number = number;
    return sample;
  };
  std::uint64_t missed = 0;
  EXPECT_TRUE(sut.is_news(transition(kNewer, kNewer, 5), now_, missed));
  EXPECT_FALSE(sut.is_news(transition(kNewer, kNewer, 5), now_, missed));
  EXPECT_FALSE(sut.is_news(transition(kOlder, kOlder, 1), now_, missed)) << "it may be a late last word";
  now_ += 2 * kServerGone;
  EXPECT_TRUE(sut.is_news(transition(kOlder, kOlder, 1), now_, missed));
  EXPECT_EQ(missed, 0U);
  EXPECT_TRUE(sut.is_news(transition(kOlder, kOlder, 3), now_, missed));
  EXPECT_EQ(missed, 1U);
  EXPECT_TRUE(sut.is_news(transition(kOlder, kOlder - 1, 1), now_, missed)) << "its numbers began anew";
  plc_InstanceStatus status{};
  dds::copy_text(status.host, "hosta");
  dds::copy_text(status.instance, "line1");
  status.epoch = kOlder;
  status.transitions = 1;
  EXPECT_TRUE(sut.has_all(status));
}

TEST_F(ClockSetBack, ProlongsNoWaitOfDds) {
  const dds::Entity guard{dds_create_guardcondition(participant_.get())};
  const dds::Entity waitset{dds_create_waitset(participant_.get())};
  ASSERT_EQ(dds_waitset_attach(waitset.get(), guard.get(), 0), DDS_RETCODE_OK);
  wall_clock_ahead_s = 3600;
  auto waited = std::async(std::launch::async,
                           [&] { return dds_waitset_wait(waitset.get(), nullptr, 0, DDS_MSECS(50)); });
  const auto seen = waited.wait_for(std::chrono::seconds(20));
  wall_clock_ahead_s = 0;
  if (seen != std::future_status::ready) dds_set_guardcondition(guard.get(), true);
  EXPECT_EQ(seen, std::future_status::ready) << "it waits for an hour";
}

TEST_F(ClockSetBack, LetsADownloadBeginAnew) {
  const auto topic = dds::make_topic(participant_.get(), dds::kDownloadChunk).value();
  const std::vector<std::byte> contents(1000);
  auto sut = FileSender::create(participant_.get(), topic.get(), "hosta", contents).value();
  plc_DownloadAck ack{};
  dds::copy_text(ack.host, "hosta");
  ack.epoch = kNewer;
  ack.received = 500;
  sut.on_ack(ack, ack.download, now_);
  EXPECT_EQ(sut.received(), 500U);

  ack.epoch = kOlder;
  ack.received = 0;
  sut.on_ack(ack, ack.download, now_);
  EXPECT_EQ(sut.received(), 500U);
  sut.on_ack(ack, ack.download, now_ + 2 * kServerGone);
  EXPECT_EQ(sut.received(), 0U);
}

}  // namespace
}  // namespace plchost
