#include "tests/bench/bare_ends.hpp"

#include <string_view>

#include <pthread.h>

#include "api/dds/domain.hpp"
#include "api/dds/samples.hpp"
#include "api/dds/topics.hpp"
#include "shm/base/futex.hpp"
#include "tests/bench/cell.hpp"

namespace plchost::bench {

Result<void> BareEnd::open(std::uint32_t number, bool receives, int fifo) {
  dds::DomainOptions options;
  options.domain = number;
  options.receive_fifo = fifo;
  PLCHOST_TRY_ASSIGN(domain, dds::open_domain(receives ? dds::Role::server : dds::Role::client, options));
  participant = dds::Entity(dds_create_participant(number, nullptr, nullptr));
  auto events = dds::make_topic(participant.get(), dds::kEventPost);
  auto acks = dds::make_topic(participant.get(), dds::kEventAck);
  if (!events || !acks) return failure(ErrorCode::unavailable, "the topics of the floor cannot be made");
  event_topic = std::move(*events);
  ack_topic = std::move(*acks);
  dds::Qos event_qos = dds::qos_of(dds::kEventPost);
  if (receives) event_qos.max_samples(dds::kEventPost.qos.reader_holds);
  auto from = receives ? dds::make_reader(participant.get(), event_topic.get(), event_qos)
                       : dds::make_reader(participant.get(), ack_topic.get(), dds::qos_of(dds::kEventAck));
  auto to = receives ? dds::make_writer(participant.get(), ack_topic.get(), dds::qos_of(dds::kEventAck))
                     : dds::make_writer(participant.get(), event_topic.get(), event_qos);
  if (!from || !to) return failure(ErrorCode::unavailable, "the ends of the floor cannot be made");
  reader = std::move(*from);
  writer = std::move(*to);
  wait_set = dds::Entity(dds_create_waitset(participant.get()));
  dds_set_status_mask(reader.get(), DDS_DATA_AVAILABLE_STATUS);
  dds_waitset_attach(wait_set.get(), reader.get(), 0);
  return {};
}

void BareEnd::wait() const {
  dds_attach_t reason = 0;
  (void)dds_waitset_wait(wait_set.get(), &reason, 1, DDS_SECS(1));
}

bool BareEnd::matched() const {
  dds_publication_matched_status_t out{};
  dds_subscription_matched_status_t in{};
  return dds_get_publication_matched_status(writer.get(), &out) == 0 && out.current_count > 0 &&
         dds_get_subscription_matched_status(reader.get(), &in) == 0 && in.current_count > 0;
}

namespace {

constexpr int kServerFifo = 20;  // plchost-dds receives with it

/// As a task that is bound to an event.
class WokenThread {
 public:
  Result<void> start(int core) {
    PLCHOST_TRY_ASSIGN(thread_, Thread::start("bare-task", kPriority, [this, core] {
                         if (bind_thread({core})) run();
                       }));
    return {};
  }
  void wake() {
    word_.fetch_add(1);
    if (waits_.load()) futex_wake(&word_);
  }

 private:
  void run() {
    for (std::uint32_t done = 0;; ++done) {
      while (word_.load() == done) {
        waits_.store(true);
        futex_wait(&word_, done);
        waits_.store(false);
      }
      last_run_.store(MonotonicClock::now(), std::memory_order_relaxed);
    }
  }
  std::atomic<std::uint32_t> word_{0};
  std::atomic<bool> waits_{false};
  std::atomic<TimePoint> last_run_{};
  Thread thread_;
};

}  // namespace

void run_bare_end(const Plan& plan, std::uint32_t domain, BareDuty duty, std::atomic<std::uint64_t>& taken) {
  WokenThread task;
  if (duty == BareDuty::wake && !task.start(plan.task_core)) return;
  const bool placed = duty == BareDuty::acknowledge;
  if (placed && !bind_thread({plan.poster_core})) return;
  BareEnd end;
  if (!end.open(domain, /*receives=*/true, placed ? kServerFifo : 0)) return;
  const sched_param priority{.sched_priority = kServerFifo + 1};
  if (placed && ::pthread_setschedparam(::pthread_self(), SCHED_FIFO, &priority) != 0) return;
  plc_EventAck ack{};
  for (;;) {
    end.wait();
    std::uint64_t count = 0;
    dds::take_valid<plc_EventPost>(end.reader.get(), [&](const plc_EventPost& post, const auto& /*info*/) {
      ack.sequence_number = post.sequence_number;
      ++count;
      if (duty == BareDuty::wake) task.wake();
    });
    if (count == 0) continue;
    taken.fetch_add(count);
    if (duty == BareDuty::acknowledge) (void)dds_write(end.writer.get(), &ack);
  }
}

Result<void> BareClient::open(std::uint32_t domain) {
  if (auto opened = end_.open(domain, /*receives=*/false, 0); !opened) return opened;
  std::string_view(kBenchHost).copy(sample_.host, sizeof sample_.host - 1);
  std::string_view("probe").copy(sample_.instance, sizeof sample_.instance - 1);
  std::string_view("ping").copy(sample_.event, sizeof sample_.event - 1);
  return wait_until([this] { return end_.matched(); }, "the meeting of the floor's ends");
}

bool BareClient::post() {
  sample_.sequence_number = ++last_;
  return dds_write(end_.writer.get(), &sample_) == DDS_RETCODE_OK;
}

void BareClient::round_trip() {
  (void)post();
  for (std::uint64_t acknowledged = 0; acknowledged < last_;) {
    end_.wait();
    dds::take_valid<plc_EventAck>(
        end_.reader.get(), [&](const plc_EventAck& ack, const auto&) { acknowledged = ack.sequence_number; });
  }
}

}  // namespace plchost::bench
