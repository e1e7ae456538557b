#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>

#include "manager/store/application_keeper.hpp"
#include "manager/store/store_order.hpp"
#include "manager/system/control_groups.hpp"
#include "manager/system/disk_thread.hpp"
#include "manager/system/helper_process.hpp"
#include "manager/system/reactor.hpp"

namespace plchost {

/// The real ApplicationKeeper: a helper process for each thing to do, which may wait for the disk.
class StoreProcess : public ApplicationKeeper {
 public:
  struct Settings {
    std::string pool;                     ///< the pool whose shared memory holds the sent file
    std::string folder;                   ///< of the versions of the instance
    std::function<std::uint32_t()> keep;  ///< so many versions
    std::string helper;                   ///< program: plchostd
    std::string plc_instance;             ///< program that tries an application
    TrialGroup trial_group = {};
  };

  /// `disk` outlives it.
  StoreProcess(Reactor& reactor, DiskThread& disk, Settings settings);

  [[nodiscard]] Result<void> keep(const ApplicationOrder& order, const std::string& name,
                                  const Loaded& loaded, const LaunchOptions& launch, Done done) override;
  [[nodiscard]] Result<void> set_boot(const std::string& path, const std::string& configured,
                                      Done done) override;
  [[nodiscard]] std::string boot() override;
  [[nodiscard]] std::optional<ApplicationVersion> version_at(const std::string& path) override;

 private:
  template <class Answer>
  [[nodiscard]] Answer look(std::function<Answer()> at_folder) const;
  [[nodiscard]] Result<void> start(StoreOrder order, Done done);
  void ended(const HelperEnd& end, const Done& done) const;

  DiskThread& disk_;
  Settings settings_;
  HelperProcess helper_;
};

/// How long the manager waits for the disk when it looks at what is kept.
inline constexpr Duration kStoreLookLimit = std::chrono::seconds(2);
/// The command line that makes plchostd the helper.
inline constexpr const char* kStoreOption = "--store";
/// How long the helper may take: a slow disk, and a trial.
inline constexpr Duration kStoreLimit = std::chrono::seconds(45);

}  // namespace plchost
