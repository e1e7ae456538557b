#pragma once

#include <string>
#include <utility>
#include <vector>

#include "instances/launch/launch_contract.hpp"
#include "manager/system/child_process.hpp"
#include "manager/system/control_groups.hpp"
#include "shm/base/time.hpp"
#include "shm/process/work_limit.hpp"

namespace plchost {

/// How long a trial may take, without the time in which other programs have the processor (WorkLimit). It
/// ends by itself after kSetUpLimit and says so; this is for one that cannot.
inline constexpr Duration kTrialLimit = kSetUpLimit + std::chrono::seconds(2);

/// The command line that tries an application as `options` would start it; its path comes last and is
/// missing. The application of `options` itself does not count.
[[nodiscard]] std::vector<std::string> trial_arguments(const std::string& plc_instance,
                                                       LaunchOptions options);

/// A process that tries an application, so that nothing else is at stake: `plc-instance --check-application`,
/// with all that the process of its instance is started with.
class ApplicationTrial {
 public:
  /// `arguments`: see trial_arguments(). `path`: of the application. `group`: the control group that they
  /// name; empty: none.
  [[nodiscard]] static Result<ApplicationTrial> start(std::vector<std::string> arguments,
                                                      const std::string& path, const std::string& group);
  [[nodiscard]] static Result<ApplicationTrial> start(const std::string& plc_instance,
                                                      const LaunchOptions& options) {
    return start(trial_arguments(plc_instance, options), options.application, options.control_group);
  }

  /// Readable when it has ended.
  [[nodiscard]] int fd() const noexcept { return process_.pidfd.get(); }
  /// The rest of kTrialLimit; zero: it takes too long.
  [[nodiscard]] Duration time_left() const;
  /// Waits until it has ended. One that takes too long is given up.
  void await_end();
  /// It took too long: ends it.
  void give_up();
  /// Of one that has ended: ok, or why the application is not valid, in its trial's words, without the
  /// file's name in front. Processes that the application has left in the trial's session end, too.
  [[nodiscard]] Result<void> verdict();

 private:
  struct Group {
    std::string folder;  // empty: it has none
    GroupCounts before;
  };
  ApplicationTrial(std::string path, Group group, ChildProcess process, UniqueFd output) noexcept
      : path_(std::move(path)),
        group_(std::move(group)),
        process_(std::move(process)),
        output_(std::move(output)) {}
  /// The limits of its group that the trial has met, as the end of a sentence.
  [[nodiscard]] std::string met_limits() const;

  std::string path_;
  Group group_;
  ChildProcess process_;
  UniqueFd output_;
  WorkLimit limit_{kTrialLimit, MonotonicClock::now()};
  bool gave_up_ = false;
};

}  // namespace plchost
