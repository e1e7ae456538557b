#pragma once

#include <functional>
#include <memory>
#include <string>
#include <thread>
#include <utility>

#include "api/client/control_client.hpp"
#include "api/dds/domain.hpp"
#include "api/plchost_client.hpp"
#include "shm/base/result.hpp"

namespace plchost {

/// A ControlClient that is made when it is first wanted, and again as long as that fails: a network interface
/// may come later. One thread.
class Connection {
 public:
  /// `only`: as for ControlClient.
  Connection(std::shared_ptr<ParticipantSource> participant, std::string only)
      : participant_(std::move(participant)), only_(std::move(only)) {}
  [[nodiscard]] Result<ControlClient*> client();

 private:
  std::shared_ptr<ParticipantSource> participant_;
  std::string only_;
  std::unique_ptr<ControlClient> client_;
};

[[nodiscard]] dds::DomainOptions domain_options(const Client::Options& options);

/// A thread that takes no signal of the program that it runs in; neither do the threads of DDS that it
/// makes.
[[nodiscard]] std::thread quiet_thread(std::function<void()> body);

}  // namespace plchost
