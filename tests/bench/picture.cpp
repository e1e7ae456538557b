#include "tests/bench/picture.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include <fmt/format.h>

namespace plchost::bench {

namespace {

constexpr std::array kColours = {"#2563eb", "#c2410c", "#15803d", "#9333ea", "#be123c"};
constexpr std::string_view kSharedFloor = "#475569";
constexpr double kPictureWidth = 960;
constexpr double kLegendTop = Picture::kBottom + 72;
constexpr double kLegendRow = 24;
constexpr double kNoteRow = 20;
/// From one mark of a curve to its next, and from the first mark of a curve to that of the next curve.
constexpr double kMarkStep = 80;
constexpr double kMarkShift = 23;

std::string_view colour_of(const Look& look) {
  return look.shared ? kSharedFloor : kColours[look.number % kColours.size()];
}

std::string style_of(const Look& look) {
  if (look.floor) return "stroke-width=\"1.4\" stroke-dasharray=\"5 4\"";
  return look.thin ? "stroke-width=\"1.2\"" : "stroke-width=\"2.2\"";
}

/// Circle, square, triangle, diamond, triangle that stands on its tip.
std::string mark(const Look& look, Spot at) {
  static constexpr std::array kShapes = {"m-4,0 a4,4 0 1,0 8,0 a4,4 0 1,0 -8,0",
                                         "m-3.6,-3.6 h7.2 v7.2 h-7.2 z", "m0,-4.6 l4.4,7.6 h-8.8 z",
                                         "m0,-5 l4.2,5 l-4.2,5 l-4.2,-5 z", "m0,4.6 l4.4,-7.6 h-8.8 z"};
  const std::size_t shape = look.shared ? kShapes.size() - 1 : look.number % kShapes.size();
  return fmt::format("<path class=\"mark\" d=\"M{:.1f},{:.1f} {}\" fill=\"{}\" stroke=\"{}\"/>\n", at.x, at.y,
                     kShapes[shape], look.floor ? "#ffffff" : colour_of(look), colour_of(look));
}

/// Marks along the way of a curve.
std::string marks(const std::vector<Spot>& spots, const Look& look, double first) {
  std::string all;
  double left = first;
  for (std::size_t i = 1; i < spots.size(); ++i) {
    const double length = std::hypot(spots[i].x - spots[i - 1].x, spots[i].y - spots[i - 1].y);
    left -= length;
    if (left > 0) continue;
    all += mark(look, spots[i]);
    left = kMarkStep;
  }
  return all;
}

std::string text(double x, double y, std::string_view anchor, std::string_view more, std::string_view what) {
  return fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"{}\"{}>{}</text>\n", x, y, anchor, more,
                     what);
}

std::string line(Spot from, Spot to) {
  return fmt::format("<line x1=\"{:.1f}\" y1=\"{:.1f}\" x2=\"{:.1f}\" y2=\"{:.1f}\" stroke=\"#e2e8f0\"/>\n",
                     from.x, from.y, to.x, to.y);
}

}  // namespace

double Axis::at(double value) const {
  return from + (to - from) * (std::clamp(value, first, last) - first) / (last - first);
}

Picture::Picture(const Drawing& drawing, std::string_view condition)
    : drawing_(drawing), title_(std::string(drawing.title) + std::string(condition)) {}

void Picture::vertical(double x, std::string_view label) {
  body_ += line({x, kTop}, {x, kBottom});
  body_ += text(x, kBottom + 20, "middle", "", label);
}

void Picture::horizontal(double y, std::string_view label, double from, double to) {
  body_ += line({from, y}, {to, y});
  if (!label.empty()) body_ += text(kLeft - 8, y + 5, "end", "", label);
}

void Picture::panel(std::string_view name, double from, double to) {
  body_ += text((from + to) / 2, kTop - 7, "middle", " font-size=\"13\"", name);
}

void Picture::curve(const std::vector<Spot>& spots, const Look& look) {
  std::string points;
  for (const Spot& spot : spots) points += fmt::format("{:.1f},{:.1f} ", spot.x, spot.y);
  body_ += fmt::format("<polyline points=\"{}\" fill=\"none\" stroke=\"{}\" {}/>\n", points, colour_of(look),
                       style_of(look));
  body_ += marks(spots, look, kMarkShift * static_cast<double>(1 + curves_++ % 3));
}

void Picture::legend(const Look& look, std::string_view name) {
  const double x = kLeft + (legends_ % 2 == 0 ? 0 : kWidth / 2);
  const std::size_t row = legends_ / 2;
  const double y = kLegendTop + kLegendRow * static_cast<double>(row);
  ++legends_;
  legend_ += fmt::format("<line x1=\"{:.1f}\" y1=\"{:.1f}\" x2=\"{:.1f}\" y2=\"{:.1f}\" stroke=\"{}\" {}/>\n",
                         x, y, x + 36, y, colour_of(look), style_of(look));
  legend_ += mark(look, {x + 18, y});
  legend_ += text(x + 44, y + 5, "start", " class=\"legend\"", name);
}

std::string Picture::take() {
  const std::size_t rows = (legends_ + 1) / 2;
  double height = kLegendTop + kLegendRow * static_cast<double>(rows) + 8;
  std::string notes;
  for (const std::string_view note : drawing_.notes) {
    if (note.empty()) continue;
    notes += text(kLeft, height, "start", " font-size=\"13\"", note);
    height += kNoteRow;
  }
  std::string all = fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {0} {1}\" font-family=\"Helvetica, Arial, "
      "sans-serif\" font-size=\"14\" fill=\"#0f172a\">\n<rect width=\"{0}\" height=\"{1}\" "
      "fill=\"#ffffff\"/>\n",
      kPictureWidth, height);
  all += text(kLeft, 24, "start", " font-size=\"16\" font-weight=\"bold\"", title_);
  all += text((kLeft + kRight) / 2, kBottom + 44, "middle", " class=\"axis\"", drawing_.x);
  const double middle = (kTop + kBottom) / 2;
  all += text(24, middle, "middle",
              fmt::format(" class=\"axis\" transform=\"rotate(-90 24 {:.1f})\"", middle), drawing_.y);
  return all + body_ + legend_ + notes + "</svg>\n";
}

}  // namespace plchost::bench
