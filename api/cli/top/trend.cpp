#include "api/cli/top/trend.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <string_view>

namespace plchost {

namespace {

constexpr std::array<std::string_view, 8> kBlocks = {"▁", "▂", "▃", "▄", "▅", "▆", "▇", "█"};
constexpr std::array<std::string_view, 8> kSigns = {".", ":", "-", "=", "+", "*", "%", "#"};

std::size_t step_of(double value, double top) {
  if (!(top > 0)) return 0;
  const double step = std::floor(std::clamp(value / top, 0.0, 1.0) * static_cast<double>(kBlocks.size()));
  return std::min(static_cast<std::size_t>(step), kBlocks.size() - 1);
}

}  // namespace

void Trend::add(double value) {
  values_.push_back(value);
  if (values_.size() > kMost) values_.pop_front();
}

std::string Trend::line(std::size_t width, bool unicode, double top) const {
  const std::size_t count = std::min(width, values_.size());
  const auto begin = values_.end() - static_cast<std::ptrdiff_t>(count);
  if (top <= 0) {
    for (auto value = begin; value != values_.end(); ++value) {
      if (*value > top) top = *value;
    }
  }
  std::string line(width - count, ' ');
  for (auto value = begin; value != values_.end(); ++value) {
    if (std::isnan(*value)) {
      line += ' ';
    } else {
      line += (unicode ? kBlocks : kSigns).at(step_of(*value, top));
    }
  }
  return line;
}

}  // namespace plchost
