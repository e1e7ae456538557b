#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include <sys/types.h>

#include "shm/base/result.hpp"

namespace plchost {

/// The manager's order to its helper about the kept applications of one instance. The helper may wait for a
/// disk and read foreign files, the manager must not. One of two things: keep a file that was sent, or, if
/// `boot` is not empty, make that path the boot application.
struct StoreOrder {
  pid_t parent = 0;    ///< the manager that waits for the answer
  std::string folder;  ///< of the instance, see api/control/application_versions.hpp; made if it is missing
  std::string boot;    ///< absolute path
  std::string
      configured;      ///< that of the configuration: as `boot` it takes back what was the boot application
  std::string source;  ///< the file that was sent; the sender may still write to it
  std::uint64_t size = 0;  ///< that it must have
  std::string digest;      ///< and its SHA-256
  std::string name;        ///< how it is called
  std::string by;
  std::string from;
  std::string before;              ///< path of what is loaded now; empty: nothing
  std::string earlier;             ///< path of what is started again if that does not come up; empty: nothing
  std::uint32_t keep = 0;          ///< so many versions stay, and these two and the boot application
  std::vector<std::string> trial;  ///< command line that tries it, its path is added; see trial_arguments()
  std::string trial_group;         ///< the control group in that command line; empty: none
};

/// In one argument of a command line, and back. corrupt: it is none.
[[nodiscard]] std::string encode(const StoreOrder& order);
[[nodiscard]] Result<StoreOrder> decode_store_order(std::string_view text);

}  // namespace plchost
