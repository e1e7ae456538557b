#include "tests/bench/plot.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include <fmt/format.h>

namespace plchost::bench {

namespace {

constexpr double kLeft = 80;
constexpr double kTop = 50;
constexpr double kWidth = 760;
constexpr double kHeight = 360;
constexpr std::array kColours = {"#2563eb", "#ea580c", "#16a34a", "#9333ea", "#dc2626"};
constexpr std::string_view kSharedFloor = "#64748b";
constexpr std::string_view kSolid = "stroke-width=\"2\"";
constexpr std::string_view kDashed = "stroke-width=\"1\" stroke-dasharray=\"5 4\"";
/// No more points than can be seen.
constexpr double kLeastStep = 0.7;

/// Maps a range of values to a stretch of the picture.
struct Axis {
  double first;
  double last;
  double from;
  double to;
  [[nodiscard]] double at(double value) const {
    return from + (to - from) * (std::clamp(value, first, last) - first) / (last - first);
  }
};

/// Powers of ten of nanoseconds.
std::string decade_name(int decade) {
  constexpr std::array kUnits = {"ns", "us", "ms", "s"};
  constexpr std::array kSteps = {"1", "10", "100"};
  if (decade < 0) return fmt::format("{:.1f} ns", std::pow(10, decade));
  return fmt::format("{} {}", kSteps[static_cast<std::size_t>(decade % 3)],
                     kUnits[static_cast<std::size_t>(decade / 3)]);
}

std::string vertical(double x, const std::string& label) {
  return fmt::format(
      "<line x1=\"{0:.1f}\" y1=\"{1}\" x2=\"{0:.1f}\" y2=\"{2}\" stroke=\"#e2e8f0\"/>\n"
      "<text x=\"{0:.1f}\" y=\"{3}\" text-anchor=\"middle\">{4}</text>\n",
      x, kTop, kTop + kHeight, kTop + kHeight + 20, label);
}

std::string horizontal(double y, const std::string& label) {
  return fmt::format(
      "<line x1=\"{1}\" y1=\"{0:.1f}\" x2=\"{2}\" y2=\"{0:.1f}\" stroke=\"#e2e8f0\"/>\n"
      "<text x=\"{3}\" y=\"{4:.1f}\" text-anchor=\"end\">{5}</text>\n",
      y, kLeft, kLeft + kWidth, kLeft - 8, y + 4, label);
}

/// The picture's head, its lines of legend, its end.
class Picture {
 public:
  explicit Picture(const std::string& title) {
    text_ = fmt::format(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 1120 480\" font-family=\"Helvetica, Arial, "
        "sans-serif\" font-size=\"13\">\n<rect width=\"1120\" height=\"480\" fill=\"#ffffff\"/>\n"
        "<text x=\"{}\" y=\"28\" font-size=\"16\" font-weight=\"bold\">{}</text>\n",
        kLeft, title);
  }
  void add(const std::string& text) { text_ += text; }
  void legend(std::string_view colour, std::string_view name) {
    const double y = kTop + 20 + 24 * lines_++;
    text_ += fmt::format(
        "<line x1=\"858\" y1=\"{0}\" x2=\"882\" y2=\"{0}\" stroke=\"{1}\" stroke-width=\"3\"/>"
        "<text x=\"890\" y=\"{2}\">{3}</text>\n",
        y, colour, y + 4, name);
  }
  void curve(const std::string& points, std::string_view colour, std::string_view style) {
    text_ += fmt::format("<polyline points=\"{}\" fill=\"none\" stroke=\"{}\" {}/>\n", points, colour, style);
  }
  [[nodiscard]] std::string take() { return std::move(text_) + "</svg>\n"; }

 private:
  std::string text_;
  double lines_ = 0;
};

constexpr Axis kLatency{.first = 1, .last = 8, .from = kLeft, .to = kLeft + kWidth};  // 10 ns to 100 ms
constexpr Axis kShare{.first = 0, .last = 5, .from = kTop, .to = kTop + kHeight};     // 100 % to 0.001 %

std::string shares(const Samples& samples) {
  std::vector<Duration> sorted = samples.values();
  std::ranges::sort(sorted);
  std::string points;
  double drawn = -1;
  for (std::size_t i = 0; i < sorted.size(); ++i) {
    const double x = kLatency.at(std::log10(std::max(static_cast<double>(sorted[i].count()), 1.0)));
    if (x - drawn < kLeastStep && i + 1 != sorted.size()) continue;
    drawn = x;
    const double above = static_cast<double>(sorted.size() - i) / static_cast<double>(sorted.size());
    points += fmt::format("{:.1f},{:.1f} ", x, kShare.at(-std::log10(above)));
  }
  return points;
}

std::string shares_to_svg(const std::string& title, const std::vector<Row>& rows) {
  Picture picture(title);
  for (int decade = 1; decade <= 8; ++decade) picture.add(vertical(kLatency.at(decade), decade_name(decade)));
  constexpr std::array kShares = {"100 %", "10 %", "1 %", "0.1 %", "0.01 %", "0.001 %"};
  for (std::size_t i = 0; i < kShares.size(); ++i)
    picture.add(horizontal(kShare.at(static_cast<double>(i)), kShares[i]));
  const bool shared = rows.size() > 1 && std::ranges::all_of(rows, [&](const Row& row) {
                        return row.floor.values() == rows.front().floor.values();
                      });
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const auto* const colour = kColours[i % kColours.size()];
    picture.curve(shares(rows[i].ours), colour, kSolid);
    if (!shared) picture.curve(shares(rows[i].floor), colour, kDashed);
    picture.legend(colour, rows[i].name);
  }
  if (shared) picture.curve(shares(rows.front().floor), kSharedFloor, kDashed);
  picture.legend(shared ? kSharedFloor : "#ffffff",
                 shared ? "dashed: the floor" : "dashed: the floor of each");
  return picture.take();
}

std::string series_to_svg(const std::string& title, const std::vector<Series>& all) {
  double end = 0;
  for (const Series& series : all) {
    if (!series.points.empty()) end = std::max(end, series.points.back().first);
  }
  const Axis time{.first = 0, .last = std::max(end, 1e-3), .from = kLeft, .to = kLeft + kWidth};
  const Axis magnitude{.first = 0, .last = 6, .from = kTop + kHeight, .to = kTop};  // 1 ns to 1 ms
  Picture picture(title);
  for (int decade = 0; decade <= 6; ++decade)
    picture.add(horizontal(magnitude.at(decade), decade_name(decade)));
  for (int tick = 0; tick <= 6; ++tick)
    picture.add(vertical(time.at(end * tick / 6), fmt::format("{:.1f} s", end * tick / 6)));
  for (std::size_t i = 0; i < all.size(); ++i) {
    std::string points;
    double drawn = -1;
    for (const auto& [seconds, ns] : all[i].points) {
      const double x = time.at(seconds);
      if (x - drawn < kLeastStep) continue;
      drawn = x;
      points += fmt::format("{:.1f},{:.1f} ", x, magnitude.at(std::log10(std::max(std::abs(ns), 1.0))));
    }
    const auto* const colour = kColours[i % kColours.size()];
    picture.curve(points, colour, kDashed.substr(0, kDashed.find(' ')));
    picture.legend(colour, all[i].name);
  }
  return picture.take();
}

}  // namespace

std::string to_svg(const std::string& title, const std::vector<Row>& rows) {
  std::vector<Series> series;
  for (const Row& row : rows) series.insert(series.end(), row.series.begin(), row.series.end());
  return series.empty() ? shares_to_svg(title, rows) : series_to_svg(title, series);
}

}  // namespace plchost::bench
