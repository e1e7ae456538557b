#pragma once

#include <string>
#include <string_view>

#include "instances/runtime/settings/settings.hpp"
#include "instances/runtime/settings/settings_source.hpp"
#include "shm/base/result.hpp"

namespace plchost {

/// `file` is how errors call it: "FILE:LINE: the fault, and the allowed values". Follows no references.
[[nodiscard]] Result<InstanceSettings> parse_settings(std::string_view text, std::string_view file);

/// With the files of its [CmpSettings] FileReference.N. Relative paths in it are made absolute. not_found: no
/// such file. Set-up.
[[nodiscard]] Result<InstanceSettings> read_settings(const std::string& file);
/// The same from `source`, or read through it.
[[nodiscard]] Result<InstanceSettings> read_settings(const std::string& file, SettingsSource& source);

}  // namespace plchost
