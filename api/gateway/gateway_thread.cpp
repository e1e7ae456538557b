#include "api/gateway/gateway_thread.hpp"

#include "shm/log/log.hpp"

namespace plchost {

namespace {

constexpr Duration kNextAttempt = std::chrono::seconds(1);

}  // namespace

Result<std::unique_ptr<GatewayThread>> GatewayThread::start(dds_entity_t participant,
                                                            GatewayOptions options) {
  std::unique_ptr<GatewayThread> gateway(new GatewayThread(participant, std::move(options)));
  auto thread = Thread::start("gateway", {}, [gateway = gateway.get()] { gateway->run(); });
  if (!thread) return failure_in("gateway", std::move(thread).error());
  gateway->thread_ = *std::move(thread);
  return gateway;
}

GatewayThread::~GatewayThread() {
  stop_.store(true, std::memory_order_release);
  wake_.nudge();
  thread_.join();
}

std::unique_ptr<BlockGateway> GatewayThread::make() {
  auto made = BlockGateway::create(participant_, options_, wake_);
  if (made) {
    last_problem_.clear();
    spdlog::info("blocks: this host has number {}", options_.number);
    return *std::move(made);
  }
  std::string problem = made.error().describe();
  if (problem != last_problem_) spdlog::error("no blocks between hosts: {}", problem);
  last_problem_ = std::move(problem);
  return nullptr;
}

void GatewayThread::run() {
  std::unique_ptr<BlockGateway> gateway;
  while (!stop_.load(std::memory_order_acquire)) {
    const CountedEvent::Snapshot seen = wake_.snapshot();
    if (gateway && gateway->lost()) gateway.reset();
    if (!gateway) gateway = make();
    const TimePoint now = MonotonicClock::now();
    const TimePoint next = gateway ? gateway->serve(now) : now + kNextAttempt;
    if (stop_.load(std::memory_order_acquire)) return;
    wake_.wait(seen, next);
  }
}

}  // namespace plchost
