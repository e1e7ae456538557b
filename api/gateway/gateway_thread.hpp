#pragma once

#include <atomic>
#include <memory>
#include <string>

#include "api/gateway/block_gateway.hpp"

namespace plchost {

/// Keeps the gateway of a host: in a thread of its own, and made again for as long as it cannot be made. A
/// failure here disturbs nothing else.
class GatewayThread {
 public:
  /// `participant` outlives it.
  [[nodiscard]] static Result<std::unique_ptr<GatewayThread>> start(dds_entity_t participant,
                                                                    GatewayOptions options);
  ~GatewayThread();
  GatewayThread(const GatewayThread&) = delete;
  GatewayThread& operator=(const GatewayThread&) = delete;

 private:
  GatewayThread(dds_entity_t participant, GatewayOptions options, WaitSet wait_set) noexcept
      : participant_(participant), options_(std::move(options)), wait_set_(std::move(wait_set)) {}
  void run();
  [[nodiscard]] std::unique_ptr<BlockGateway> make();

  const dds_entity_t participant_;
  const GatewayOptions options_;
  const WaitSet wait_set_;
  std::atomic<bool> stop_{false};
  std::string last_problem_;
  Thread thread_;
};

}  // namespace plchost
