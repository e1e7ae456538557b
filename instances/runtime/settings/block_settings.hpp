#pragma once

#include <chrono>
#include <cstdint>
#include <string>
#include <vector>

#include "shm/base/time.hpp"
#include "shm/block_driver/node_directory.hpp"

namespace plchost {

/// [CmpBlkDrvShm] and [CmpRouter]: the instance as a node that talks to others.
struct BlockSettings {
  bool enable = false;  ///< a node from the start, also without a channel
  std::string base =
      std::string(kDefaultBlockBase);  ///< nodes of the same base name in the same pool see each other
  std::uint16_t forced_address = 0;    ///< 0: any
  std::uint32_t queue_slots = 1024;    ///< of each queue of the links that it makes
  Duration hold = std::chrono::seconds(1);
  std::vector<std::string> neighbours;  ///< empty: all
  bool forward = true;
  std::uint8_t hop_limit = 8;
  bool operator==(const BlockSettings&) const = default;
};

}  // namespace plchost
