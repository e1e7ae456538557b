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
constexpr int kFirstDecade = -2;  // 0.01 us
constexpr int kLastDecade = 4;    // 10 ms
constexpr int kShareDecades = 5;  // 1 down to 0.001 %

double x_of(double us) {
  const double exponent =
      std::clamp(std::log10(std::max(us, 1e-9)), double{kFirstDecade}, double{kLastDecade});
  return kLeft + kWidth * (exponent - kFirstDecade) / (kLastDecade - kFirstDecade);
}

double y_of(double share) {
  const double exponent = std::clamp(-std::log10(std::max(share, 1e-12)), 0.0, double{kShareDecades});
  return kTop + kHeight * exponent / kShareDecades;
}

std::string curve(const Samples& samples, std::string_view colour, std::string_view style) {
  std::vector<Duration> sorted = samples.values();
  std::ranges::sort(sorted);
  std::string points;
  double drawn = -1;
  for (std::size_t i = 0; i < sorted.size(); ++i) {
    const double x = x_of(static_cast<double>(sorted[i].count()) / 1e3);
    if (x - drawn < 0.7 && i + 1 != sorted.size()) continue;  // no more points than can be seen
    drawn = x;
    const double above = static_cast<double>(sorted.size() - i) / static_cast<double>(sorted.size());
    points += fmt::format("{:.1f},{:.1f} ", x, y_of(above));
  }
  return fmt::format("<polyline points=\"{}\" fill=\"none\" stroke=\"{}\" {}/>\n", points, colour, style);
}

std::string axes() {
  std::string text;
  constexpr std::array kTicks = {"10 ns", "100 ns", "1 us", "10 us", "100 us", "1 ms", "10 ms"};
  for (int decade = kFirstDecade; decade <= kLastDecade; ++decade) {
    const double x = x_of(std::pow(10.0, decade));
    text += fmt::format("<line x1=\"{0:.1f}\" y1=\"{1}\" x2=\"{0:.1f}\" y2=\"{2}\" stroke=\"#e2e8f0\"/>\n", x,
                        kTop, kTop + kHeight);
    text += fmt::format("<text x=\"{:.1f}\" y=\"{}\" text-anchor=\"middle\">{}</text>\n", x,
                        kTop + kHeight + 20, kTicks[static_cast<std::size_t>(decade - kFirstDecade)]);
  }
  constexpr std::array kShares = {"100 %", "10 %", "1 %", "0.1 %", "0.01 %", "0.001 %"};
  for (int decade = 0; decade <= kShareDecades; ++decade) {
    const double y = y_of(std::pow(10.0, -decade));
    text += fmt::format("<line x1=\"{1}\" y1=\"{0:.1f}\" x2=\"{2}\" y2=\"{0:.1f}\" stroke=\"#e2e8f0\"/>\n", y,
                        kLeft, kLeft + kWidth);
    text += fmt::format("<text x=\"{}\" y=\"{:.1f}\" text-anchor=\"end\">{}</text>\n", kLeft - 8, y + 4,
                        kShares[static_cast<std::size_t>(decade)]);
  }
  return text;
}

}  // namespace

std::string to_svg(const std::string& title, const std::vector<Row>& rows) {
  constexpr std::array kColours = {"#2563eb", "#ea580c", "#16a34a", "#9333ea", "#dc2626"};
  std::string text = fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 1120 480\" font-family=\"Helvetica, Arial, "
      "sans-serif\" font-size=\"13\">\n<rect width=\"1120\" height=\"480\" fill=\"#ffffff\"/>\n"
      "<text x=\"{}\" y=\"28\" font-size=\"16\" font-weight=\"bold\">{}</text>\n",
      kLeft, title);
  text += axes();
  const auto legend = [&](double line, std::string_view colour, std::string_view name) {
    const double y = kTop + 20 + 24 * line;
    text += fmt::format(
        "<line x1=\"858\" y1=\"{0}\" x2=\"882\" y2=\"{0}\" stroke=\"{1}\" stroke-width=\"3\"/>"
        "<text x=\"890\" y=\"{2}\">{3}</text>\n",
        y, colour, y + 4, name);
  };
  constexpr std::string_view kSolid = "stroke-width=\"2\"";
  constexpr std::string_view kDashed = "stroke-width=\"1\" stroke-dasharray=\"5 4\"";
  legend(static_cast<double>(rows.size()), "#ffffff", "dashed: the floor of each");
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const auto* const colour = kColours[i % kColours.size()];
    text += curve(rows[i].ours, colour, kSolid) + curve(rows[i].floor, colour, kDashed);
    legend(static_cast<double>(i), colour, rows[i].name);
  }
  return text + "</svg>\n";
}

}  // namespace plchost::bench
