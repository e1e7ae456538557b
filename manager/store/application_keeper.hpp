#pragma once

#include <functional>
#include <optional>
#include <string>

#include "api/control/application_order.hpp"
#include "api/control/application_versions.hpp"
#include "instances/launch/launch_contract.hpp"
#include "shm/base/result.hpp"

namespace plchost {

/// The applications that were sent to one instance and are kept for it. Nothing in it waits; the end of a
/// longer action is told by `done`, never from inside the call. One thing at a time.
class ApplicationKeeper {
 public:
  /// The applications that an instance has or may go back to, as paths; empty: none.
  struct Loaded {
    std::string now;      ///< the one that is loaded
    std::string earlier;  ///< the one that is started again if `now` does not come up
  };
  using Done = std::function<void(const Result<std::string>& path)>;

  virtual ~ApplicationKeeper() = default;
  /// Checks what was sent as `launch` would start it, keeps it and gives its path. Those of `loaded` stay,
  /// too.
  [[nodiscard]] virtual Result<void> keep(const ApplicationOrder& order, const std::string& name,
                                          const Loaded& loaded, const LaunchOptions& launch, Done done) = 0;
  /// The instance starts with the application at that path from now on, or as the configuration says, if that
  /// names the same one.
  [[nodiscard]] virtual Result<void> set_boot(const std::string& path, const std::string& configured,
                                              Done done) = 0;
  /// Its path; empty: as the configuration says.
  [[nodiscard]] virtual std::string boot() = 0;
  /// The version that lies there; nothing: it is none of this instance.
  [[nodiscard]] virtual std::optional<ApplicationVersion> version_at(const std::string& path) = 0;
};

}  // namespace plchost
