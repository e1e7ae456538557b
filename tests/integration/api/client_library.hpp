#pragma once

#include <chrono>

#include <gtest/gtest.h>

#include "api/plchost_client.hpp"
#include "tests/integration/api/test_host.hpp"

namespace plchost {

/// The client library beside a host with one instance, line1, and its event.
class ClientLibrary : public testing::Test {
 protected:
  ClientLibrary() {
    event_ = host_.add_event("line1", "ready");
    event_.set_bound_tasks(1);
    host_.write_instance(0, "line1", InstanceState::running, 4711);
    host_.write_count(1);
    host_.start_server();
  }

  [[nodiscard]] Client::Options options(std::chrono::milliseconds timeout = std::chrono::seconds(20)) const {
    Client::Options options;
    options.domain = domain_.number();
    options.timeout = timeout;
    return options;
  }

  template <class Call>
  static ClientError error_of(Call call) {
    try {
      call();
    } catch (const ClientError& error) {
      return error;
    }
    return {0, "nothing was thrown"};
  }

  OwnDomain domain_;
  TestHost host_{domain_, "hosta"};
  PoolEvent event_;
};

}  // namespace plchost
