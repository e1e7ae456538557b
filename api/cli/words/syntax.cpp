#include "api/cli/words/syntax.hpp"

#include <algorithm>

namespace plchost {

const Syntax* Syntax::word(const std::string& of) const {
  const auto found = std::ranges::find(words, of, &Syntax::name);
  return found != words.end() ? &*found : nullptr;
}

const Syntax::Option* Syntax::option(const std::string& of) const {
  const auto found = std::ranges::find_if(
      options, [&](const Option& one) { return std::ranges::find(one.names, of) != one.names.end(); });
  return found != options.end() ? &*found : nullptr;
}

}  // namespace plchost
