#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <string_view>

#include "shm/base/result.hpp"
#include "shm/sockets/control_message.hpp"

namespace plchost {

/// Option of what loads an application, beside kBootOption: it takes over from what is loaded, in the same
/// process, while the tasks run; or is refused.
inline constexpr std::string_view kOnlineOption = "online";

/// Options of ControlVerb::download_application, beside kBootOption. Those of the API server's own name the
/// file in shared memory and its sender.
inline constexpr std::string_view kSizeOption = "size";      ///< bytes
inline constexpr std::string_view kDigestOption = "sha256";  ///< 64 lower-case hexadecimal digits
inline constexpr std::string_view kSourceOption = "source";  ///< number of the file, see download_file_name()
inline constexpr std::string_view kByOption = "by";          ///< role and name of its sender; may be empty
inline constexpr std::string_view kFromOption = "from";      ///< the sender's client

/// An application that was sent, as the options of the command say it.
struct ApplicationOrder {
  std::uint64_t size = 0;
  std::string digest;  ///< SHA-256
  std::uint64_t source = 0;
  std::string by;
  std::string from;
  bool boot = false;  ///< it becomes the boot application

  /// invalid_argument: the size is no number from 1, or the digest is none.
  [[nodiscard]] static Result<ApplicationOrder> from_options(
      const std::map<std::string, std::string>& options);
};

/// The name of an application's file, as it is shown: 1 to kMaxFileName bytes of printable UTF-8 without '/'.
inline constexpr std::size_t kMaxFileName = 95;
[[nodiscard]] Result<void> check_file_name(std::string_view name);

/// A download to an instance of the pool's host lies in the shared memory of that name.
[[nodiscard]] std::string download_file_name(std::string_view pool, std::uint64_t number);
/// Removes those that are there. Set-up.
void remove_downloads(std::string_view pool) noexcept;

}  // namespace plchost
