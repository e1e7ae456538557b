#include "instances/adapters/iec/pragmas.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <fmt/format.h>

#include "shm/base/names.hpp"

namespace plchost::iec {

namespace {

// A program may rely on the first ones.
constexpr std::array<std::string_view, 9> kWords{"ATTRIBUTE", "WARNING", "ERROR", "REGION", "ENDREGION",
                                                 "ANALYSIS",  "FLAG",    "INFO",  "TEXT"};
constexpr auto kOfMeaning = std::span(kWords).first<3>();

bool has_word(const Token& token, std::span<const std::string_view> words) {
  if (token.kind != Token::Kind::pragma || token.text.starts_with("{{")) return false;
  const std::string text = folded(token.text);
  const auto is_letter = [](char c) { return c >= 'A' && c <= 'Z'; };
  const auto begin = std::ranges::find_if(text, is_letter);
  const std::string_view word(begin, std::find_if_not(begin, text.end(), is_letter));
  return std::ranges::find(words, word) != words.end();
}

}  // namespace

bool is_of_other_tools(const Token& token) {
  return has_word(token, kWords);
}

SourceProblems idle_pragmas(std::span<const Source> sources) {
  struct Idle {
    Token first;
    std::size_t count = 0;
  };
  std::vector<Idle> found;
  for (const Source& source : sources) {
    for (const Token& token : tokens_of(source.text, source.file).all) {
      if (!has_word(token, kOfMeaning)) continue;
      auto known = std::ranges::find(found, token.text, [](const Idle& idle) { return idle.first.text; });
      if (known == found.end()) known = found.insert(found.end(), {.first = token});
      ++known->count;
    }
  }
  SourceProblems remarks;
  for (const auto& [first, count] : found) {
    const std::string more =
        count == 1 ? "" : fmt::format(", here and in {}", count_text(count - 1, "other place"));
    remarks.push_back({first.place, fmt::format("{} has no effect{}", shown(first.text), more)});
  }
  return remarks;
}

}  // namespace plchost::iec
