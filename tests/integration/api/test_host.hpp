#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "api/client/control_client.hpp"
#include "api/control/host_finding.hpp"
#include "shm/base/unique_fd.hpp"
#include "shm/pages/host_page.hpp"
#include "shm/pages/instance_page.hpp"
#include "shm/pool/object_pool.hpp"
#include "shm/sockets/control_message.hpp"
#include "shm/sockets/packet_socket.hpp"
#include "tests/integration/api/child.hpp"

namespace plchost {

/// A DDS domain that no other test on this machine uses while this object lives.
class OwnDomain {
 public:
  OwnDomain();
  [[nodiscard]] std::uint32_t number() const { return number_; }

 private:
  UniqueFd claim_;
  std::uint32_t number_ = 0;
};

/// A host without PLCs: a pool, the pages that a manager and an instance write, the manager's end of the
/// control socket, and a real plchost-dds.
class TestHost {
 public:
  TestHost(const OwnDomain& domain, std::string name, std::uint32_t max_objects = 64);
  TestHost(const TestHost&) = delete;
  TestHost& operator=(const TestHost&) = delete;
  ~TestHost();

  [[nodiscard]] const std::string& name() const { return name_; }
  [[nodiscard]] const std::string& pool_name() const { return pool_name_; }
  [[nodiscard]] const std::string& run_directory() const { return run_directory_; }
  /// Makes and registers "instance/event".
  PoolEvent add_event(const std::string& instance, const std::string& event);
  void write_instance(std::uint32_t index, const std::string& name, InstanceState state,
                      std::int32_t pid = 0);
  void write_count(std::uint32_t count);
  /// The manager loses its processor while it writes this instance, until write_instance() is called.
  void interrupt_instance(std::uint32_t index);
  /// An instance page with one task, as the process `pid` would write it.
  InstancePage make_page(const std::string& instance, const std::string& task, std::int32_t pid);

  /// `more`: arguments, also of those that replace it.
  void start_server(std::vector<std::string> more = {});
  /// Where servers that are started from now on log: to this file with ".errors" behind it.
  void log_to(std::string file) { log_file_ = std::move(file); }
  /// kill -9, and a new one, as the manager does it.
  void replace_server();
  [[nodiscard]] Child& server() { return *server_; }

  /// The requests that came to the manager so far.
  [[nodiscard]] std::vector<ControlRequest> requests();
  /// The manager's answer: ok with this text, after this delay.
  void answer_with(ControlReply reply) {
    const std::lock_guard lock(mutex_);
    answer_ = std::move(reply);
  }
  /// The manager's findings at the host from the next check on.
  void find(std::vector<HostFinding> findings) {
    const std::lock_guard lock(mutex_);
    findings_ = std::move(findings);
  }
  /// How often it was asked to look.
  [[nodiscard]] std::uint64_t checks() {
    const std::lock_guard lock(mutex_);
    return checks_;
  }
  std::atomic<bool> forwards{false};     ///< the instance's own process answers for the manager
  std::atomic<std::size_t> answered{0};  ///< of requests(), by the manager
  std::atomic<bool> silent{false};       ///< the manager answers nothing
  std::atomic<bool> hold{false};         ///< the manager answers "stop" once this is false again
  std::atomic<bool> close_peer{false};   ///< the manager hangs up

 private:
  void serve(PacketListener& listener, const std::stop_token& stop);
  ControlReply check_host(const std::string& argument);
  [[nodiscard]] ControlReply forward(const ControlRequest& request) const;

  std::uint32_t domain_;
  std::string name_;
  std::string pool_name_;
  std::string run_directory_;
  ObjectPool pool_;
  HostPageWriter page_;  // guarded by page_mutex_: it has one writer
  std::mutex page_mutex_;
  std::vector<std::string> instances_;
  std::vector<std::string> more_arguments_;
  std::string log_file_;  // empty: where the test's output goes
  ControlReply answer_;   // guarded by mutex_
  std::mutex mutex_;
  std::vector<HostFinding> findings_;
  std::uint64_t checks_ = 0;
  std::vector<ControlRequest> requests_;
  std::unique_ptr<Child> server_;
  std::jthread manager_;
};

/// How long a test waits for what will happen anyway.
inline constexpr Duration kPatience = std::chrono::seconds(20);
[[nodiscard]] inline TimePoint soon() {
  return MonotonicClock::now() + kPatience;
}

/// A client in that domain.
[[nodiscard]] std::unique_ptr<ControlClient> connect(const OwnDomain& domain);

}  // namespace plchost
