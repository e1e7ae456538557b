#include "api/library/connection.hpp"

#include <csignal>

namespace plchost {

Result<ControlClient*> Connection::client() {
  if (!client_) {
    PLCHOST_TRY_ASSIGN(auto participant, participant_->get());
    PLCHOST_TRY_ASSIGN(client_, ControlClient::connect(std::move(participant), only_));
  }
  return client_.get();
}

dds::DomainOptions domain_options(const Client::Options& options) {
  return {.domain = options.domain,
          .interfaces = options.interfaces,
          .peers = options.peers,
          .identity = options.identity};
}

std::thread quiet_thread(std::function<void()> body) {
  sigset_t all;
  sigset_t before;
  sigfillset(&all);
  pthread_sigmask(SIG_SETMASK, &all, &before);
  std::thread thread(std::move(body));
  pthread_sigmask(SIG_SETMASK, &before, nullptr);
  return thread;
}

}  // namespace plchost
