#include "api/recording/nested_spans.hpp"

#include <algorithm>
#include <numeric>
#include <utility>

namespace plchost {

std::vector<NestedStep> nested(std::span<const TimeSpan> spans) {
  std::vector<std::size_t> order(spans.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  // Of those that begin at one time, the longest is around the others.
  std::ranges::stable_sort(order, {}, [&](std::size_t i) { return std::pair(spans[i].from, -spans[i].to); });
  std::vector<NestedStep> steps;
  steps.reserve(2 * spans.size());
  std::vector<std::size_t> open;
  const auto end = [&](std::size_t place) {
    const std::int64_t time = spans[open[place]].to;
    for (std::size_t i = open.size(); i-- > place;) steps.push_back({time, open[i], false, false});
    open.erase(open.begin() + static_cast<std::ptrdiff_t>(place));
    for (std::size_t i = place; i < open.size(); ++i) steps.push_back({time, open[i], true, true});
  };
  // The one on top of those that end first: then none above it has to begin again.
  const auto end_until = [&](std::int64_t time) {
    while (!open.empty()) {
      std::size_t next = open.size() - 1;
      for (std::size_t i = next; i-- > 0;) {
        if (spans[open[i]].to < spans[open[next]].to) next = i;
      }
      if (spans[open[next]].to > time) return;
      end(next);
    }
  };
  for (const std::size_t i : order) {
    end_until(spans[i].from);
    steps.push_back({spans[i].from, i, true, false});
    open.push_back(i);
  }
  end_until(INT64_MAX);
  return steps;
}

}  // namespace plchost
