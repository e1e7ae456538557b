#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "tests/bench/plot.hpp"

namespace plchost::bench {

/// A point of a picture, in its own units.
struct Spot {
  double x;
  double y;
};

/// Maps a range of values to a stretch of the picture. A value outside of the range is drawn at its edge.
struct Axis {
  double first;
  double last;
  double from;
  double to;
  [[nodiscard]] double at(double value) const;
};

/// How a curve looks: its shape tells it from others without its colour, too.
struct Look {
  std::size_t number;   ///< of its colour and the shape of its marks
  bool floor = false;   ///< dashed, and its marks are hollow
  bool shared = false;  ///< a floor of all curves: grey
  bool thin = false;
};

/// An SVG picture with a title, axes, curves, a legend and notes below it.
class Picture {
 public:
  static constexpr double kLeft = 100;
  static constexpr double kTop = 52;
  static constexpr double kWidth = 828;
  static constexpr double kHeight = 320;
  static constexpr double kRight = kLeft + kWidth;
  static constexpr double kBottom = kTop + kHeight;

  Picture(const Drawing& drawing, std::string_view condition);

  /// A line of the grid with its label. `from` and `to`: of the panel.
  void vertical(double x, std::string_view label);
  void horizontal(double y, std::string_view label, double from = kLeft, double to = kRight);
  /// In the middle between `from` and `to`, above the panel.
  void panel(std::string_view name, double from, double to);
  void curve(const std::vector<Spot>& spots, const Look& look);
  void legend(const Look& look, std::string_view name);
  [[nodiscard]] std::string take();

 private:
  const Drawing& drawing_;
  std::string title_;
  std::string body_;
  std::string legend_;
  std::size_t legends_ = 0;
  std::size_t curves_ = 0;
};

}  // namespace plchost::bench
