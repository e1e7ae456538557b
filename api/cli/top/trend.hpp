#pragma once

#include <cstddef>
#include <deque>
#include <string>

namespace plchost {

/// The last values of a figure, the oldest first.
class Trend {
 public:
  static constexpr std::size_t kMost = 120;

  void add(double value);
  /// The last `width` values as one character each, the last at the right: eight steps from 0 to `top`, or to
  /// the greatest of them if `top` is 0. Without `unicode` by the signs of ASCII from '.' to '#'. Values that
  /// are not there yet are blank. NaN: nothing was measured then; a gap.
  [[nodiscard]] std::string line(std::size_t width, bool unicode, double top = 0) const;

 private:
  std::deque<double> values_;
};

}  // namespace plchost
