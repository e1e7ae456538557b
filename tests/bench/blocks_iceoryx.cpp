#include "tests/bench/blocks_pipe.hpp"

#if PLCHOST_ICEORYX

#include <chrono>
#include <cstring>
#include <thread>

#include <iceoryx_hoofs/log/logmanager.hpp>
#include <iceoryx_posh/popo/untyped_publisher.hpp>
#include <iceoryx_posh/popo/untyped_subscriber.hpp>
#include <iceoryx_posh/runtime/posh_runtime.hpp>

namespace plchost::bench {

namespace {

iox::capro::IdString_t text(const std::string& from) {
  return {iox::cxx::TruncateToCapacity, from.c_str()};
}

iox::popo::PublisherOptions lossless_publisher() {
  iox::popo::PublisherOptions options;
  options.subscriberTooSlowPolicy = iox::popo::ConsumerTooSlowPolicy::WAIT_FOR_CONSUMER;
  return options;
}

iox::popo::SubscriberOptions lossless_subscriber() {
  iox::popo::SubscriberOptions options;
  options.queueFullPolicy = iox::popo::QueueFullPolicy::BLOCK_PRODUCER;
  options.queueCapacity = 64;  // of RouDi's 200 chunks of that size; the default of 256 would take them all
  return options;
}

class IceoryxPipe : public BlocksPipe {
 public:
  IceoryxPipe(const std::string& pool, BlocksSide side)
      : publisher_({text("plchost"), text(pool), text(side == BlocksSide::bench ? "ping" : "pong")},
                   lossless_publisher()),
        subscriber_({text("plchost"), text(pool), text(side == BlocksSide::bench ? "pong" : "ping")},
                    lossless_subscriber()) {
    while (!publisher_.hasSubscribers() ||
           subscriber_.getSubscriptionState() != iox::SubscribeState::SUBSCRIBED) {
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
  }
  bool send(const void* data, std::size_t size) override {
    auto loaned = publisher_.loan(static_cast<std::uint32_t>(size));
    if (loaned.has_error()) return false;
    std::memcpy(loaned.value(), data, size);
    publisher_.publish(loaned.value());
    return true;
  }
  std::size_t receive(void* buffer, std::size_t size) override {
    auto taken = subscriber_.take();
    if (taken.has_error()) return 0;
    const void* const payload = taken.value();
    const std::size_t got = iox::mepoo::ChunkHeader::fromUserPayload(payload)->userPayloadSize();
    std::memcpy(buffer, payload, std::min(got, size));
    subscriber_.release(payload);
    return got;
  }

 private:
  iox::popo::UntypedPublisher publisher_;
  iox::popo::UntypedSubscriber subscriber_;
};

}  // namespace

std::unique_ptr<BlocksPipe> make_iceoryx_pipe(const std::string& pool, BlocksSide side) {
  iox::log::LogManager::GetLogManager().SetDefaultLogLevel(iox::log::LogLevel::kOff);
  const std::string name = pool + (side == BlocksSide::bench ? "-bench" : "-peer");
  iox::runtime::PoshRuntime::initRuntime({iox::cxx::TruncateToCapacity, name.c_str()});
  return std::make_unique<IceoryxPipe>(pool, side);
}

bool has_iceoryx() noexcept {
  return true;
}

}  // namespace plchost::bench

#else

namespace plchost::bench {

std::unique_ptr<BlocksPipe> make_iceoryx_pipe(const std::string&, BlocksSide) {
  return nullptr;
}

bool has_iceoryx() noexcept {
  return false;
}

}  // namespace plchost::bench

#endif
