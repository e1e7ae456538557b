#include "api/gateway/gateway_thread.hpp"

#include "shm/log/log.hpp"

namespace plchost {

namespace {

constexpr Duration kNextAttempt = std::chrono::seconds(1);

}  // namespace

Result<std::unique_ptr<GatewayThread>> GatewayThread::start(dds_entity_t participant,
                                                            GatewayOptions options) {
  PLCHOST_TRY_ASSIGN(auto wait_set, in_step("gateway", WaitSet::create(participant)));
  std::unique_ptr<GatewayThread> gateway(
      new GatewayThread(participant, std::move(options), std::move(wait_set)));
  PLCHOST_TRY_ASSIGN(
      auto thread,
      in_step("gateway", Thread::start("gateway", {}, [gateway = gateway.get()] { gateway->run(); })));
  gateway->thread_ = std::move(thread);
  return gateway;
}

GatewayThread::~GatewayThread() {
  stop_.store(true, std::memory_order_release);
  wait_set_.wake();
  thread_.join();
}

std::unique_ptr<BlockGateway> GatewayThread::make() {
  auto made = BlockGateway::create(participant_, options_, wait_set_);
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
    if (gateway && gateway->lost()) gateway.reset();
    if (!gateway) gateway = make();
    const TimePoint now = MonotonicClock::now();
    const TimePoint next = gateway ? gateway->serve(now) : now + kNextAttempt;
    if (stop_.load(std::memory_order_acquire)) return;
    wait_set_.wait(next);
  }
}

}  // namespace plchost
