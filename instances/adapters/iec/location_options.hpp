#pragma once

#include <map>

#include "instances/adapters/iec/place.hpp"
#include "instances/adapters/iec/source_place.hpp"

namespace plchost::iec {

/// The locations of a configuration, as its task file places them.
struct LocationOptions {
  struct Given {
    Location location;       ///< a direct one of the same area and width
    SourcePlace place = {};  ///< of its line in the task file
  };
  Widths widths = Widths::shared;
  std::map<Location, Given> given = {};
};

}  // namespace plchost::iec
