#pragma once

#include <cstdint>
#include <string>

#include "manager/config/manager_config.hpp"
#include "manager/host_check/host_files.hpp"

namespace plchost {

enum class FixMode : std::uint8_t { print, apply, revert };

struct FixOrder {
  FixMode mode = FixMode::print;
  std::string root;  ///< empty: this host; else a folder, for images: nothing is run there
};

/// refused: this user may not write in the host's /etc.
[[nodiscard]] Result<void> may_fix_host(const FixOrder& order);

/// Sets this host up for its instances, by files in /etc, or takes these files away. Each step goes to the
/// standard output, the reason of a failure to the standard error. FixMode::revert does not look at `config`.
/// False: a step was refused or has failed; each file is whole or as it was before.
[[nodiscard]] bool fix_host(const FixOrder& order, const ManagerConfig& config);

/// The files in which the kernel tells about itself: those of the image, if it has them, else of this host.
[[nodiscard]] HostFiles facts_below(const std::string& root);

}  // namespace plchost
