#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "manager/system/child_process.hpp"
#include "shm/pages/host_page.hpp"
#include "shm/pages/instance_page.hpp"
#include "shm/sockets/control_message.hpp"
#include "shm/sockets/packet_socket.hpp"

namespace plchost {

/// A host in a temporary folder: real managers, real instances, a pool of its own. Cleans up whatever
/// happens.
class Plant {
 public:
  Plant();
  ~Plant();
  Plant(const Plant&) = delete;
  Plant& operator=(const Plant&) = delete;

  /// Another [[instance]]; `application` is a name in the build's folder of applications.
  void add(const std::string& name, const std::string& application, const std::string& more_keys = "");
  /// More keys of [host], in place of those before.
  void set_host_keys(std::string keys) { host_keys_ = std::move(keys); }
  /// In the folder of the configuration.
  void write_file(const std::string& name, const std::string& text) const;
  [[nodiscard]] std::string text_of(const std::string& name) const;
  [[nodiscard]] std::vector<std::string> lines_of(const std::string& name) const;
  /// A shell script in place of plchost-dds.
  void use_api_server(const std::string& script);
  /// The configuration as it is with all add() so far.
  void write_configuration() const;
  /// In its place, whatever that is.
  void write_configuration(const std::string& text) const { write_file("cell.toml", text); }
  [[nodiscard]] std::string configuration() const;
  /// A signal to the manager.
  void signal_manager(int signal) const { (void)signal_process(manager_, signal); }
  /// Writes the configuration and starts a manager. `output_fd`: where it says what it says, instead of
  /// log().
  void start_manager(int output_fd = -1);
  /// SIGTERM, and how it ended.
  ExitStatus stop_manager();
  void kill_manager();
  /// All that are there, as the kernel does when memory is short.
  void kill_instances();
  /// The losses of a power cut, when all processes have ended: shared memory and the run directory.
  void lose_memory() const;
  /// Takes back each add().
  void clear_instances() { instances_.clear(); }
  /// A second one with the same configuration, and what it said before it ended.
  std::string start_refused_manager();

  ControlReply ask(ControlVerb verb, const std::string& instance, const std::string& argument = "");
  PacketSocket connect();

  InstanceStatus status(const std::string& instance);
  bool wait_for(const std::string& instance, InstanceState state);
  /// Cycles of all tasks so far.
  std::uint64_t cycles(const std::string& instance) { return counters(instance).cycles; }
  /// Cycles and lost cycles of all tasks so far.
  TaskCounters counters(const std::string& instance);
  std::uint64_t cycles_of(const std::string& instance, std::string_view task);
  bool wait_for_cycles(const std::string& instance, std::uint64_t more = 5);
  static bool eventually(const std::function<bool()>& condition);
  static bool within(Duration limit, const std::function<bool()>& condition);
  /// The processes whose command lines have this text.
  static int processes_about(const std::string& text);
  [[nodiscard]] int manager_pid() const noexcept { return manager_.pid; }
  static std::string application(const std::string& name);

  /// Names of ours in /dev/shm and in the run directory.
  std::vector<std::string> leftovers() const;
  [[nodiscard]] std::string log() const { return text_of("log"); }
  [[nodiscard]] std::string state_directory() const { return folder_ / "state"; }
  [[nodiscard]] std::string run_directory() const { return folder_ / "run"; }
  [[nodiscard]] const std::string& pool() const { return pool_; }

 private:
  static void kill_processes_about(const std::string& text);
  ExitStatus wait_for_end(ChildProcess& process, Duration limit);
  std::filesystem::path folder_;
  std::string pool_;
  std::string host_keys_;
  std::string instances_;
  std::vector<std::string> names_;
  bool api_server_ = false;
  ChildProcess manager_;
};

}  // namespace plchost
