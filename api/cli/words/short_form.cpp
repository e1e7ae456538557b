#include "api/cli/words/short_form.hpp"

#include <array>
#include <cstddef>
#include <optional>
#include <string_view>

#include "shm/base/names.hpp"

namespace plchost {

namespace {

// The place of the first word at or behind `at` that is neither an option nor the value of one.
std::optional<std::size_t> next_word(const Syntax& plcctl, const Syntax& level,
                                     std::span<const std::string> words, std::size_t at) {
  for (; at < words.size(); ++at) {
    const std::string& word = words[at];
    if (!word.starts_with('-')) return at;
    const Syntax::Option* option = level.option(word);
    if (option == nullptr) option = plcctl.option(word);
    if (option != nullptr && !option->value.empty()) ++at;
  }
  return std::nullopt;
}

}  // namespace

std::vector<std::string> with_noun(const Syntax& plcctl, std::vector<std::string> words) {
  const auto at = next_word(plcctl, plcctl, words, 0);
  const Syntax* const verb = at ? plcctl.word(words[*at]) : nullptr;
  if (verb == nullptr || verb->words.size() != 1) return words;
  const Syntax& noun = verb->words.front();
  const auto next = next_word(plcctl, noun, words, *at + 1);
  if (!next || words[*next] == noun.name) return words;
  const std::array<std::string_view, 1> known = {noun.name};
  if (!nearest_name(words[*next], known).empty()) return words;
  words.insert(words.begin() + static_cast<std::ptrdiff_t>(*at) + 1, noun.name);
  return words;
}

std::vector<std::string> without_options(const Syntax& plcctl, std::span<const std::string> words) {
  std::vector<std::string> plain;
  for (auto at = next_word(plcctl, plcctl, words, 0); at; at = next_word(plcctl, plcctl, words, *at + 1)) {
    plain.push_back(words[*at]);
  }
  return plain;
}

}  // namespace plchost
