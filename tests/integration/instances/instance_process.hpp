#pragma once

#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <sys/types.h>

#include "shm/pages/instance_page.hpp"
#include "shm/pages/transition_ring.hpp"
#include "shm/pool/object_pool.hpp"
#include "shm/sockets/control_message.hpp"
#include "shm/sockets/packet_socket.hpp"

namespace plchost::testing {

/// The path of an application that the build has made.
[[nodiscard]] std::string application(const std::string& name);

/// A pool name and a folder of its own for one test; both are gone when it ends.
class Sandbox {
 public:
  Sandbox();
  ~Sandbox();
  Sandbox(const Sandbox&) = delete;
  Sandbox& operator=(const Sandbox&) = delete;

  [[nodiscard]] const std::string& pool() const { return pool_; }
  [[nodiscard]] const std::string& folder() const { return folder_; }
  /// Writes a file into the folder and returns its path.
  [[nodiscard]] std::string write(const std::string& name, const std::string& text) const;

 private:
  std::string pool_;
  std::string folder_;
};

/// A real plc-instance, named "line1", that is killed and reaped if it is still there at the end.
class InstanceProcess {
 public:
  /// Starts it with these arguments, and with the sandbox's --pool and --run-directory unless they are among
  /// them. `environment`: "NAME=value", beside what the test has.
  InstanceProcess(const Sandbox& sandbox, const std::vector<std::string>& arguments,
                  const std::vector<std::string>& environment = {});
  ~InstanceProcess();
  InstanceProcess(const InstanceProcess&) = delete;
  InstanceProcess& operator=(const InstanceProcess&) = delete;

  [[nodiscard]] pid_t pid() const { return pid_; }
  /// Waits until its status page says that it runs (or is set up and stopped).
  void wait_until_up(bool running = true);
  /// Sends the signal; 0: none. Then waits for the end: the exit code, or minus the signal that ended it.
  int end(int signal = 0);
  /// Its output so far.
  [[nodiscard]] std::string log() const;
  /// Of the log, from the last `begin` to the end of its line; empty: that line is not there, or not whole.
  [[nodiscard]] std::string last_line_from(std::string_view begin) const;
  /// Nothing: it has no such task.
  [[nodiscard]] std::optional<TaskSnapshot> task(const std::string& name) const;
  /// Its report in its page.
  [[nodiscard]] InstanceRuntime runtime() const;
  [[nodiscard]] ControlReply ask(ControlVerb verb, const std::string& argument = {}) const;
  [[nodiscard]] PacketSocket connect() const;
  [[nodiscard]] PoolEvent event(const std::string& name);
  /// Posts "report" and waits for the figures: {ticks, edges, works, loops}.
  struct Figures {
    unsigned ticks, edges, works, loops;
  };
  [[nodiscard]] Figures figures();

 private:
  const Sandbox& sandbox_;
  std::string log_file_;
  pid_t pid_ = -1;
  ObjectPool pool_;
};

/// Looks again and again until it holds, or gives up after a time that only a fault takes.
[[nodiscard]] bool eventually(const std::function<bool()>& condition);

}  // namespace plchost::testing
