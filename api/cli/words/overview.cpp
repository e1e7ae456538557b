#include "api/cli/words/overview.hpp"

#include <algorithm>
#include <utility>
#include <vector>

#include <fmt/format.h>

namespace plchost {

namespace {

std::string form_of(const Syntax& verb, const Syntax& noun) {
  std::string form = verb.name.empty() ? noun.name : fmt::format("{} {}", verb.name, noun.name);
  for (const Syntax::Argument& argument : noun.arguments)
    form += argument.required ? " " + argument.form : fmt::format(" [{}]", argument.form);
  return form;
}

}  // namespace

std::string overview(const Syntax& level, const std::string& said) {
  std::vector<std::pair<std::string, std::string>> lines;
  for (const Syntax& word : level.words) {
    if (word.words.empty()) {
      lines.emplace_back(form_of({}, word), word.text);
    } else {
      for (const Syntax& noun : word.words) lines.emplace_back(form_of(word, noun), noun.text);
    }
  }
  std::size_t width = 0;
  for (const auto& [form, text] : lines) width = std::max(width, form.size());
  std::string text = fmt::format("{} ...\n", said);
  for (const auto& [form, about] : lines) text += fmt::format("  {:<{}}  {}\n", form, width, about);
  return text + fmt::format("'{} ... --help' tells all of a command.\n", said);
}

}  // namespace plchost
