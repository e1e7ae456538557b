#pragma once

#include <cstddef>

namespace plchost {

/// Bytes of a block.
struct ByteRange {
  std::size_t offset = 0;
  std::size_t bytes = 0;
};

}  // namespace plchost
