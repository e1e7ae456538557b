#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "shm/base/time.hpp"
#include "shm/pages/host_page.hpp"

namespace plchost {

/// A copy of all that the manager has written to its page. A part that cannot be read at the moment stays as
/// it was read last. That the manager is just writing an instance does not mean that there is no such
/// instance. One thread.
class HostPageCopy {
 public:
  explicit HostPageCopy(std::string pool) : pool_(std::move(pool)) {}

  /// Waits until each part was read once; from then on host() is never null. unavailable: not by `deadline`.
  [[nodiscard]] Result<void> wait(TimePoint deadline);
  /// Reads the parts that were written since. Opens the page if it is not open, or was cut short. False: a
  /// part could not be read, and is as it was before.
  bool refresh();
  /// False: there is no page at the moment, so that refresh() could read no part of it.
  [[nodiscard]] bool is_open() const noexcept { return page_.has_value(); }

  /// Null until each part was read once. Valid until refresh() is called.
  [[nodiscard]] const HostStatus* host() const noexcept { return host_ ? &*host_ : nullptr; }
  /// The instances that there are; none while host() is null. Valid until refresh() is called.
  [[nodiscard]] std::vector<const InstanceStatus*> instances() const;

 private:
  template <class Status>
  struct Part {
    std::optional<Status> status;  // nothing: not read yet
    std::uint64_t sequence = 1;    // of the page, before it was read; odd: to be read again
  };
  template <class Status, class Read>
  static bool update(Part<Status>& part, std::uint64_t sequence, Read read);

  std::string pool_;
  std::optional<HostPageReader> page_;
  std::optional<HostStatus> host_;
  Part<HostStatus> newest_host_;  // host_, or the next one, of which an instance is not known yet
  std::vector<Part<InstanceStatus>> places_;
};

}  // namespace plchost
