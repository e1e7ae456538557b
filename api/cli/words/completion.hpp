#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "api/cli/words/syntax.hpp"

namespace plchost {

/// A word that could stand in the place, and what it means.
struct Candidate {
  std::string word;
  std::string text;
  bool operator==(const Candidate&) const = default;
};

/// The candidates for the place of the last word.
struct Completion {
  std::vector<Candidate> candidates;  ///< that the command line itself knows
  std::string value;                  ///< else the form of a value, as "INSTANCE/EVENT" or "--host"
  std::vector<std::string> options;   ///< plcctl's own, in front of it, with their values: where to ask
};

/// `words`: all behind the name of the program, the last one unfinished, maybe empty.
[[nodiscard]] Completion complete(const Syntax& plcctl, std::span<const std::string> words);

/// The script that a shell reads to complete plcctl's command line. Nothing: no shell of that name.
[[nodiscard]] std::string_view completion_script(std::string_view shell);

}  // namespace plchost
