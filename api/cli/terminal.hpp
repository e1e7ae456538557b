#pragma once

#include <cstddef>

#include "api/cli/rows/histogram_plot.hpp"

namespace plchost {

/// How to draw on standard output: its terminal's width, else $COLUMNS, else 80 characters; unicode if the
/// locale (LC_ALL, LC_CTYPE, LANG: the first that is set) is one of UTF-8.
[[nodiscard]] PlotStyle terminal_style();

/// Characters in a line of the terminal that standard output is; 0: it is none.
[[nodiscard]] std::size_t terminal_width();

/// Whether standard output is a terminal that shows colours, and nobody has said NO_COLOR.
[[nodiscard]] bool shows_colours();

}  // namespace plchost
