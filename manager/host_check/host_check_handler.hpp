#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "api/control/control_handler.hpp"
#include "api/control/host_finding.hpp"

namespace plchost {

/// Answers what is asked of the host as a whole, and passes what is for an instance on.
class HostCheckHandler : public ControlHandler {
 public:
  /// `instances` outlives it.
  HostCheckHandler(ControlHandler& instances, std::function<std::vector<HostFinding>()> look)
      : instances_(instances), look_(std::move(look)) {}

  void handle(const ControlRequest& request, ControlReplyFunction reply) override;

 private:
  [[nodiscard]] Result<std::string> part(const ControlRequest& request);

  ControlHandler& instances_;
  std::function<std::vector<HostFinding>()> look_;
  std::uint64_t check_ = 0;
  std::vector<HostFinding> findings_;  // of that check
};

}  // namespace plchost
