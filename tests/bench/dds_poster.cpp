#include "tests/bench/dds_poster.hpp"

#include <thread>

#include "api/client/control_client.hpp"
#include "api/dds/domain.hpp"
#include "api/dds/error.hpp"
#include "api/dds/topics.hpp"

namespace plchost::bench {

namespace {

/// The writer of the floor: nothing but DDS.
class BareWriter {
 public:
  Result<void> open(std::uint32_t domain) {
    dds::DomainOptions options;
    options.domain = domain;
    PLCHOST_TRY_ASSIGN(domain_, dds::open_domain(dds::Role::client, options));
    auto participant =
        dds::check_entity(dds_create_participant(domain, nullptr, nullptr), "make a participant");
    if (!participant) return std::unexpected(participant.error());
    participant_ = std::move(*participant);
    PLCHOST_TRY_ASSIGN(topic_, dds::make_topic(participant_.get(), dds::kEventPost));
    PLCHOST_TRY_ASSIGN(writer_,
                       dds::make_writer(participant_.get(), topic_.get(), dds::qos_of(dds::kEventPost)));
    std::string_view(kBenchHost).copy(sample_.host, sizeof sample_.host - 1);
    std::string_view("probe").copy(sample_.instance, sizeof sample_.instance - 1);
    std::string_view("ping").copy(sample_.event, sizeof sample_.event - 1);
    return {};
  }
  [[nodiscard]] bool matched() const {
    dds_publication_matched_status_t status{};
    return dds_get_publication_matched_status(writer_.get(), &status) == 0 && status.current_count > 0;
  }
  void post() {
    ++sample_.sequence_number;
    (void)dds_write(writer_.get(), &sample_);
  }

 private:
  std::shared_ptr<dds::Entity> domain_;
  dds::Entity participant_;
  dds::Entity topic_;
  dds::Entity writer_;
  plc_EventPost sample_{};
};

/// One slice: each post when the one before has arrived.
template <class Post>
void post_slice(const Plan& plan, DdsBoard& board, Post post) {
  for (std::uint32_t i = 0; i < board.posts.load(); ++i) {
    const std::uint32_t before = board.arrived.load();
    std::this_thread::sleep_for(plan.post_gap);
    board.posted_ns.store(MonotonicClock::now().time_since_epoch().count());
    post();
    for (int waited = 0; board.arrived.load() == before && waited < 1000; ++waited) {
      std::this_thread::sleep_for(plan.post_gap);
    }
  }
}

}  // namespace

int run_dds_poster(const Plan& plan, const DdsDomains& domains, DdsBoard& board) {
  BareWriter bare;
  const TimePoint patience = MonotonicClock::now() + std::chrono::seconds(20);
  bool ready = bind_thread({plan.poster_core}).has_value() && bare.open(domains.bare).has_value();
  dds::DomainOptions options;
  options.domain = domains.plchost;
  auto client = ControlClient::connect(options);
  ready = ready && client && (*client)->prepare_posts(kBenchHost, patience);
  while (ready && !bare.matched()) {
    if (MonotonicClock::now() > patience) ready = false;
    std::this_thread::sleep_for(plan.post_gap);
  }
  board.poster_ready.store(ready ? 1 : 2);
  for (;;) {
    switch (static_cast<Order>(board.order.load())) {
      case Order::wait:
        std::this_thread::sleep_for(plan.post_gap);
        continue;
      case Order::end:
        return 0;
      case Order::post_bare:
        post_slice(plan, board, [&] { bare.post(); });
        break;
      case Order::post_event:
        post_slice(plan, board, [&] { (void)(*client)->post_one(kBenchHost, "probe", "ping"); });
        break;
    }
    board.order.store(static_cast<std::uint32_t>(Order::wait));
  }
}

}  // namespace plchost::bench
