#pragma once

#include <cstddef>
#include <string>
#include <string_view>

#include "shm/base/result.hpp"

namespace plchost {

/// Of so many instances the disk has exceptions, also of those that the configuration does not have any more.
inline constexpr std::size_t kMostExceptionFiles = 128;

/// The folder of the exceptions that outlive a power cut: "STATE_DIRECTORY/exceptions.HOST".
[[nodiscard]] std::string exceptions_folder(std::string_view state_directory, std::string_view host);
/// The file of an instance there: "INSTANCE.exceptions", as read_exceptions() reads it.
[[nodiscard]] std::string kept_exceptions_path(std::string_view folder, std::string_view instance);

/// Adds the exceptions in the file `from`, which an instance has written, to those in `path`, for good: a
/// power cut leaves the file before or the new one. The folder is made if it is missing, for this user only.
/// If it has more files than kMostExceptionFiles then, those that were written longest ago are removed. A
/// file that cannot be read is begun anew. system: why the disk does not take it. May wait for the disk.
[[nodiscard]] Result<void> keep_exceptions_on_disk(const std::string& path, const std::string& from);

/// Puts what the disk has into the file `to` of the run directory, if that is not there: a power cut empties
/// that folder. One that appears while the disk is read stays as it is. system: the run directory does not
/// take it. May wait for the disk.
[[nodiscard]] Result<void> restore_exceptions(const std::string& path, const std::string& to);

}  // namespace plchost
