#pragma once

#include <cmath>
#include <string>

#include <CLI/CLI.hpp>

namespace plchost {

/// A number from `least` to `most`. CLI::Range alone takes "nan", which is neither less nor more than any.
template <class Number>
[[nodiscard]] CLI::Validator number_range(Number least, Number most) {
  const CLI::Range range(least, most);
  const auto check = [range](std::string& text) {
    Number number{};
    const bool is_nan = CLI::detail::lexical_cast(text, number) && std::isnan(static_cast<double>(number));
    return is_nan ? "Value " + text + " is no number" : range(text);
  };
  return {check, range.get_description()};
}

}  // namespace plchost
