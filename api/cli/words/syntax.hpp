#pragma once

#include <string>
#include <vector>

namespace plchost {

/// The command line as data, for all that tells of it: completion, the manual page, hints.
struct Syntax {
  struct Option {
    std::vector<std::string> names;  ///< "-h", "--help"
    std::string value;               ///< the arguments, as the help shows them; empty: none
    std::string text;
    std::string variable;  ///< of the environment, that stands for it; empty: none
  };
  struct Argument {
    std::string form;  ///< "INSTANCE/EVENT"
    std::string text;
    bool required = true;
  };

  std::string name;
  std::string text;
  std::vector<Option> options;
  std::vector<Argument> arguments;
  std::vector<Syntax> words;  ///< one of which must follow, if there are any

  /// Null: there is no such word.
  [[nodiscard]] const Syntax* word(const std::string& of) const;
  /// Null: there is no such option here.
  [[nodiscard]] const Option* option(const std::string& of) const;
};

}  // namespace plchost
