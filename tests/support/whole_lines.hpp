#pragma once

#include <fstream>
#include <string>
#include <vector>

namespace plchost {

/// The lines of a file, or none if it cannot be opened. A line without its end is left out: a program may be
/// writing it, and a write over the end of a page is seen in two parts.
inline std::vector<std::string> whole_lines(const std::string& path) {
  std::vector<std::string> lines;
  std::ifstream file(path);
  for (std::string line; std::getline(file, line) && !file.eof();) lines.push_back(line);
  return lines;
}

}  // namespace plchost
