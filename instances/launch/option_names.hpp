#pragma once

#include <string>
#include <vector>

#include <CLI/CLI.hpp>

namespace plchost {

/// Of all options of a program, as they are typed: "-v", "--version". For unknown_option(). Set-up.
[[nodiscard]] inline std::vector<std::string> option_names(const CLI::App& app) {
  std::vector<std::string> names;
  for (const CLI::Option* option : app.get_options()) {
    for (const std::string& name : option->get_snames()) names.push_back("-" + name);
    for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
  }
  return names;
}

}  // namespace plchost
