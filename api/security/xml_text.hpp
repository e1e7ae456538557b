#pragma once

#include <string>
#include <string_view>

namespace plchost::security {

/// As it stands in XML, between tags.
[[nodiscard]] inline std::string escaped(std::string_view text) {
  std::string made;
  for (const char c : text) {
    switch (c) {
      case '&':
        made += "&amp;";
        break;
      case '<':
        made += "&lt;";
        break;
      case '>':
        made += "&gt;";
        break;
      default:
        made += c;
    }
  }
  return made;
}

}  // namespace plchost::security
