#include "api/cli/verbs/word_hint.hpp"

#include <cstddef>
#include <string_view>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "api/cli/cli_session.hpp"

namespace plchost {

namespace {

// How many words the option at the front of `words` takes with its value; 0: it is unknown here.
std::size_t words_of_option(const Syntax& plcctl, const Syntax& level, const std::string& word) {
  const auto find = [&](const std::string& name) {
    const Syntax::Option* const option = level.option(name);
    return option != nullptr ? option : plcctl.option(name);
  };
  if (const Syntax::Option* const option = find(word)) return option->value.empty() ? 1 : 2;
  // "--host=cell", "-ojson"
  const std::string name = word.starts_with("--") ? word.substr(0, word.find('=')) : word.substr(0, 2);
  return find(name) != nullptr ? 1 : 0;
}

}  // namespace

// The words behind a wrong one are no mistake, so only the first word that no command knows counts.
std::string word_hint(const Syntax& plcctl, std::span<const std::string> words) {
  const Syntax* level = &plcctl;
  std::string said = plcctl.name;
  const auto known = [&] {
    std::vector<std::string> names;
    for (const Syntax& one : level->words) names.push_back(one.name);
    return names;
  };
  for (std::size_t at = 0; at < words.size() && !level->words.empty();) {
    const std::string& word = words[at];
    if (word.starts_with('-')) {
      const std::size_t taken = words_of_option(plcctl, *level, word);
      if (taken == 0) return "";
      at += taken;
      continue;
    }
    const Syntax* const next = level->word(word);
    if (next == nullptr) {
      return fmt::format("{}: unknown word '{}'{}; known here: {}\n", plcctl.name, word, hint(word, known()),
                         fmt::join(known(), ", "));
    }
    said += " " + word;
    level = next;
    ++at;
  }
  if (level->words.empty()) return "";
  return fmt::format("{}: '{}' needs one more word: {}\n", plcctl.name, said, fmt::join(known(), ", "));
}

}  // namespace plchost
