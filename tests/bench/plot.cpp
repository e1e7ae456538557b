#include "tests/bench/plot.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>

#include <fmt/format.h>

#include "tests/bench/picture.hpp"

namespace plchost::bench {

namespace {

/// No more points than can be seen.
constexpr double kLeastStep = 0.7;
constexpr double kBetweenPanels = 28;
constexpr Axis kLatency{
    .first = 1, .last = 8, .from = Picture::kLeft, .to = Picture::kRight};  // 10 ns to 100 ms
constexpr Axis kShare{
    .first = 0, .last = 5, .from = Picture::kTop, .to = Picture::kBottom};  // 100 % to 0.001 %
constexpr Axis kMagnitude{
    .first = 0, .last = 6, .from = Picture::kBottom, .to = Picture::kTop};  // 1 ns to 1 ms

/// Powers of ten of nanoseconds.
std::string decade_name(int decade) {
  constexpr std::array kUnits = {"ns", "µs", "ms", "s"};
  constexpr std::array kSteps = {"1", "10", "100"};
  return fmt::format("{} {}", kSteps[static_cast<std::size_t>(decade % 3)],
                     kUnits[static_cast<std::size_t>(decade / 3)]);
}

std::vector<Spot> shares(const Samples& samples) {
  std::vector<Duration> sorted = samples.values();
  std::ranges::sort(sorted);
  std::vector<Spot> spots;
  for (std::size_t i = 0; i < sorted.size(); ++i) {
    const double x = kLatency.at(std::log10(std::max(static_cast<double>(sorted[i].count()), 1.0)));
    if (!spots.empty() && x - spots.back().x < kLeastStep && i + 1 != sorted.size()) continue;
    const double above = static_cast<double>(sorted.size() - i) / static_cast<double>(sorted.size());
    spots.push_back({x, kShare.at(-std::log10(above))});
  }
  return spots;
}

void add_share_axes(Picture& picture) {
  for (int decade = 1; decade <= 8; ++decade) picture.vertical(kLatency.at(decade), decade_name(decade));
  constexpr std::array kShares = {"100 %", "10 %", "1 %", "0.1 %", "0.01 %", "0.001 %"};
  for (std::size_t i = 0; i < kShares.size(); ++i)
    picture.horizontal(kShare.at(static_cast<double>(i)), kShares[i]);
}

std::string shares_to_svg(const Drawing& drawing, std::string_view condition, const std::vector<Row>& rows) {
  Picture picture(drawing, condition);
  add_share_axes(picture);
  const bool shared = rows.size() > 1 && std::ranges::all_of(rows, [&](const Row& row) {
                        return row.floor.values() == rows.front().floor.values();
                      });
  for (std::size_t i = 0; i < rows.size(); ++i) {
    picture.curve(shares(rows[i].ours), {.number = i});
    picture.legend({.number = i}, rows[i].name);
    if (shared) continue;
    picture.curve(shares(rows[i].floor), {.number = i, .floor = true});
    picture.legend({.number = i, .floor = true}, fmt::format("its floor: {}", drawing.floor));
  }
  if (shared) {
    picture.curve(shares(rows.front().floor), {.number = 0, .floor = true, .shared = true});
    picture.legend({.number = 0, .floor = true, .shared = true}, fmt::format("floor: {}", drawing.floor));
  }
  return picture.take();
}

/// A round step that divides the time into 3 to 8 parts.
double round_step(double end) {
  double step = std::pow(10, std::floor(std::log10(end)) - 1);
  for (const double factor : {2.0, 2.5, 2.0, 2.0, 2.5, 2.0}) {
    if (end / step <= 8) break;
    step *= factor;
  }
  return step;
}

/// The series of one panel.
struct Panel {
  std::string name;
  std::vector<const Series*> series;
  double end = 1e-3;  // s
};

std::vector<Panel> panels_of(const std::vector<Series>& all) {
  std::vector<Panel> panels;
  for (const Series& series : all) {
    auto panel = std::ranges::find(panels, series.panel, &Panel::name);
    if (panel == panels.end()) panel = panels.insert(panel, {.name = series.panel, .series = {}});
    panel->series.push_back(&series);
    for (const auto& [seconds, ns] : series.points) panel->end = std::max(panel->end, seconds);
  }
  return panels;
}

/// Of points that would lie on one another the greatest is drawn.
std::vector<Spot> magnitudes(const Series& series, const Axis& time) {
  std::vector<Spot> spots;
  for (const auto& [seconds, ns] : series.points) {
    const Spot spot{time.at(seconds), kMagnitude.at(std::log10(std::max(std::abs(ns), 1.0)))};
    if (spots.empty() || spot.x - spots.back().x >= kLeastStep)
      spots.push_back(spot);
    else
      spots.back().y = std::min(spots.back().y, spot.y);
  }
  return spots;
}

std::string series_to_svg(const Drawing& drawing, std::string_view condition,
                          const std::vector<Series>& all) {
  Picture picture(drawing, condition);
  const std::vector<Panel> panels = panels_of(all);
  const auto count = static_cast<double>(panels.size());
  const double width = (Picture::kWidth - kBetweenPanels * (count - 1)) / count;
  std::vector<std::string> names;
  double from = Picture::kLeft;
  for (const Panel& panel : panels) {
    const Axis time{.first = 0, .last = panel.end, .from = from, .to = from + width};
    const bool leftmost = &panel == &panels.front();
    for (int decade = 0; decade <= 6; ++decade)
      picture.horizontal(kMagnitude.at(decade), leftmost ? decade_name(decade) : "", from, from + width);
    const double step = round_step(panel.end);
    for (double tick = 0; tick <= panel.end * 1.001; tick += step)
      picture.vertical(time.at(tick), fmt::format("{:g}", tick));
    picture.panel(panel.name, from, from + width);
    for (const Series* const series : panel.series) {
      const auto known = std::ranges::find(names, series->name);
      const auto number = static_cast<std::size_t>(known - names.begin());
      const Look look{.number = number, .thin = true};
      if (known == names.end()) {
        names.push_back(series->name);
        picture.legend(look, series->name);
      }
      picture.curve(magnitudes(*series, time), look);
    }
    from += width + kBetweenPanels;
  }
  return picture.take();
}

}  // namespace

std::string to_svg(const Drawing& drawing, std::string_view condition, const std::vector<Row>& rows) {
  std::vector<Series> series;
  for (const Row& row : rows) series.insert(series.end(), row.series.begin(), row.series.end());
  return series.empty() ? shares_to_svg(drawing, condition, rows) : series_to_svg(drawing, condition, series);
}

}  // namespace plchost::bench
