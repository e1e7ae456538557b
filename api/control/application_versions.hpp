#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "shm/base/result.hpp"

namespace plchost {

// The applications sent to an instance lie in one folder, STATE_DIRECTORY/applications.HOST/INSTANCE:
//   000003.so    a version
//   000003.json  what is known of it; a version without is none (yet)
//   boot         the path that the instance starts with, instead of the configuration's; may be missing
// The manager's helper alone writes there. Everybody may read at any time: each file is put in place as a
// whole.

/// An application that was sent and is kept.
struct ApplicationVersion {
  std::uint32_t number = 0;         ///< from 1; greater is younger
  std::string path;                 ///< where it lies
  std::string name;                 ///< of the file that was sent
  std::string digest;               ///< SHA-256, hexadecimal
  std::uint64_t size = 0;           ///< bytes
  std::int64_t stored_unix_ns = 0;  ///< when it came
  std::string by;                   ///< role and name of its sender; empty: not secured
  std::string from;                 ///< his client
  std::string before;               ///< path of what was loaded before it; empty: nothing
};

/// All that an instance's folder holds.
struct ApplicationVersions {
  std::vector<ApplicationVersion> kept;  ///< ascending
  std::string boot;                      ///< path; empty: none was chosen
};

[[nodiscard]] std::string applications_folder(std::string_view state_directory, std::string_view host);
/// Of one instance.
[[nodiscard]] std::string versions_folder(std::string_view applications_folder, std::string_view instance);
[[nodiscard]] std::string version_path(std::string_view folder, std::uint32_t number);
/// Of what is known of the version at `path`.
[[nodiscard]] std::string description_path(std::string_view path);
[[nodiscard]] std::string boot_path(std::string_view folder);

/// The versions that are there; one with a damaged description is left out. Soft threads: reads files.
[[nodiscard]] ApplicationVersions read_versions(const std::string& folder);
/// The version that lies at `path`; nothing: it is none of this folder.
[[nodiscard]] std::optional<ApplicationVersion> version_at(const std::string& folder,
                                                           const std::string& path);
/// The path that was chosen with --boot; empty: none.
[[nodiscard]] std::string read_boot(const std::string& folder);

/// The contents of a description; the number and the path are in its name.
[[nodiscard]] std::string encode(const ApplicationVersion& version);
/// corrupt: it is none.
[[nodiscard]] Result<ApplicationVersion> decode_version(std::string_view text);

}  // namespace plchost
