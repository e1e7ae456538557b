#pragma once

namespace plchost {

/// The range of a value; both ends belong to it.
template <class Value>
struct Bounds {
  Value lowest;
  Value highest;
};

}  // namespace plchost
