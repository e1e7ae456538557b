#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "manager/system/child_process.hpp"
#include "manager/system/reactor.hpp"

namespace plchost {

/// How a helper ended.
struct HelperEnd {
  ExitStatus status;    ///< not known: it has not ended
  bool in_time = true;  ///< false: it was killed at its limit
  std::string output;
};

/// Done elsewhere, within a limit: a program that does one thing for the manager, which must wait neither for
/// a disk nor for a trial. At the limit it is killed. A process that a disk keeps even then is left behind.
class HelperProcess {
 public:
  using Done = std::function<void(const HelperEnd& end)>;

  /// A killed process ends so long later at most, or waits for a disk.
  static constexpr Duration kKillLimit = std::chrono::seconds(1);

  explicit HelperProcess(Reactor& reactor) : reactor_(reactor), timer_(reactor, [this] { on_limit(); }) {}

  /// `done` is called once, after kKillLimit and the limit at most. busy: the one before has not ended.
  /// `most_output`: so many bytes of standard output and error are kept.
  [[nodiscard]] Result<void> start(const std::vector<std::string>& arguments, Duration limit,
                                   std::size_t most_output, Done done);
  /// Kills it; `done` is not called. The end of the manager.
  void give_up();

 private:
  void on_limit();
  void ended();

  Reactor& reactor_;
  Reactor::Timer timer_;
  std::optional<ChildProcess> process_;
  Reactor::Watch watch_;
  UniqueFd output_;
  std::size_t most_output_ = 0;
  bool in_time_ = true;
  Done done_;  // null: nobody waits for it
};

}  // namespace plchost
