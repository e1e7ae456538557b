#pragma once

#include <string>
#include <utility>

#include "manager/system/child_process.hpp"
#include "shm/base/time.hpp"

namespace plchost {

/// How long an application may take to be tried.
inline constexpr Duration kTrialLimit = std::chrono::seconds(10);

/// A process that tries an application, so that nothing else is at stake: `plc-instance --check-application`.
class ApplicationTrial {
 public:
  [[nodiscard]] static Result<ApplicationTrial> start(const std::string& plc_instance,
                                                      const std::string& path);

  /// Readable when it has ended.
  [[nodiscard]] int fd() const noexcept { return process_.pidfd.get(); }
  /// It took too long: ends it.
  void give_up();
  /// Of one that has ended: ok, or why the application is not valid, in its trial's words. What the
  /// application has left in the trial's session ends, too.
  [[nodiscard]] Result<void> verdict();

 private:
  ApplicationTrial(ChildProcess process, UniqueFd output) noexcept
      : process_(std::move(process)), output_(std::move(output)) {}

  ChildProcess process_;
  UniqueFd output_;
  bool gave_up_ = false;
};

}  // namespace plchost
