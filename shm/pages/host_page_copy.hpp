#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "shm/base/time.hpp"
#include "shm/pages/host_page.hpp"

namespace plchost {

/// A copy of all that the manager has written to its page. A part that cannot be read at the moment stays as
/// it was read last: that the manager is just writing an instance does not mean that there is no such
/// instance. One thread.
class HostPageCopy {
 public:
  explicit HostPageCopy(std::string pool) : pool_(std::move(pool)) {}

  /// Waits until each part was read once; from then on host() is never null. unavailable: not by `deadline`.
  [[nodiscard]] Result<void> wait(TimePoint deadline);
  /// Reads all parts again. Opens the page if it is not open, or was cut short. False: a part could not be
  /// read, and is as it was before.
  bool refresh();

  /// Null until each part was read once. Valid until refresh() is called.
  [[nodiscard]] const HostStatus* host() const noexcept { return host_ ? &*host_ : nullptr; }
  /// The instances that there are; none while host() is null. Valid until refresh() is called.
  [[nodiscard]] std::vector<const InstanceStatus*> instances() const;

 private:
  std::string pool_;
  std::optional<HostPageReader> page_;
  std::optional<HostStatus> host_;
  std::vector<std::optional<InstanceStatus>> places_;  // nothing: not read yet
};

}  // namespace plchost
