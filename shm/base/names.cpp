#include "shm/base/names.hpp"

#include <algorithm>
#include <array>
#include <numeric>
#include <ranges>
#include <vector>

#include <fmt/format.h>

#include "shm/base/utf8.hpp"

namespace plchost {

namespace {

std::size_t edit_distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 1; i <= a.size(); ++i) {
    std::size_t diagonal = row[0]++;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t replaced = diagonal + (a[i - 1] == b[j - 1] ? 0 : 1);
      diagonal = row[j];
      row[j] = std::min({row[j] + 1, row[j - 1] + 1, replaced});
    }
  }
  return row.back();
}

struct CodeRange {
  char32_t first;
  char32_t last;
};
// Control characters. Then what makes two lines of one, shows a text in another order than it has, or shows
// nothing, so that two texts look like one. U+200C and U+200D stay: the words of some languages need them.
constexpr std::array<CodeRange, 9> kUnprintable = {{{0, 0x1f},
                                                    {0x7f, 0x9f},
                                                    {0x61c, 0x61c},
                                                    {0x200b, 0x200b},
                                                    {0x200e, 0x200f},
                                                    {0x2028, 0x202e},
                                                    {0x2060, 0x2060},
                                                    {0x2066, 0x2069},
                                                    {0xfeff, 0xfeff}}};

// The bytes of the character that the text begins with; 0: not one, or not printable.
std::size_t printable_character(std::string_view text) noexcept {
  const auto character = first_utf8(text);
  if (!character) return 0;
  const auto has_it = [&](CodeRange range) {
    return character->code >= range.first && character->code <= range.last;
  };
  return std::ranges::any_of(kUnprintable, has_it) ? 0 : character->bytes;
}

}  // namespace

Result<void> check_name(std::string_view what, std::string_view name, std::size_t max) {
  const bool good = !name.empty() && name.size() <= max && name.front() != '.' && name.front() != '-' &&
                    std::ranges::all_of(name, is_name_character);
  if (good) return {};
  return failure(ErrorCode::invalid_argument,
                 fmt::format("{} '{}' is not valid: allowed are 1 to {} letters, digits, '_', '-' and '.', "
                             "not starting with '-' or '.'",
                             what, shown(name), max));
}

bool is_name_character(char c) noexcept {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' || c == '-' ||
         c == '.';
}

bool is_printable_utf8(std::string_view text) noexcept {
  while (!text.empty()) {
    const std::size_t bytes = printable_character(text);
    if (bytes == 0) return false;
    text.remove_prefix(bytes);
  }
  return true;
}

std::string printable_lines(std::string_view text) {
  std::string lines;
  for (;;) {
    const std::size_t end = text.find('\n');
    lines += printable(std::string(text.substr(0, end)));
    if (end == std::string_view::npos) return lines;
    lines += '\n';
    text.remove_prefix(end + 1);
  }
}

std::string printable(std::string text) {
  for (std::size_t at = 0; at < text.size();) {
    std::size_t bytes = printable_character(std::string_view(text).substr(at));
    if (bytes == 0) {
      text[at] = '?';
      bytes = 1;
    }
    at += bytes;
  }
  return text;
}

bool is_object_name(std::string_view name) noexcept {
  return !name.empty() && name.size() <= kMaxObjectName && is_printable_utf8(name);
}

Result<void> check_object_name(std::string_view name) {
  if (is_object_name(name)) return {};
  std::string told(shown(name));
  for (char& c : told) {
    if (c < ' ' || c > '~') c = '?';
  }
  return failure(ErrorCode::invalid_argument,
                 fmt::format("object name '{}' ({} bytes) is not valid: allowed are 1 to {} bytes of UTF-8 "
                             "without control characters",
                             told, name.size(), kMaxObjectName));
}

std::string event_object_name(std::string_view instance, std::string_view event) {
  return fmt::format("{}/{}", instance, event);
}

namespace {

// "domain" of "dds_domain".
bool is_part_of(std::string_view unknown, std::string_view known) noexcept {
  const std::size_t at = known.find(unknown);
  if (at == std::string_view::npos) return false;
  const std::size_t end = at + unknown.size();
  return (at == 0 || known[at - 1] == '_') && (end == known.size() || known[end] == '_');
}

}  // namespace

std::string_view nearest_name(std::string_view unknown, std::span<const std::string_view> known) {
  // Further away than this is another word, not a typing error.
  const std::string_view near = nearest_name(unknown, known, unknown.size() / 3 + 1);
  if (!near.empty() || unknown.empty()) return near;
  const auto whole = [&](std::string_view name) { return is_part_of(unknown, name); };
  const auto found = std::ranges::find_if(known, whole);
  const bool one = found != known.end() && std::none_of(found + 1, known.end(), whole);
  return one ? *found : std::string_view();
}

std::string_view nearest_name(std::string_view unknown, std::span<const std::string_view> known,
                              std::size_t most) {
  std::string_view nearest;
  std::size_t best = most + 1;
  for (const std::string_view candidate : known) {
    if (candidate.size() >= unknown.size() + best || unknown.size() >= candidate.size() + best) continue;
    const std::size_t distance = edit_distance(unknown, candidate);
    if (distance < best) {
      best = distance;
      nearest = candidate;
    }
  }
  return nearest;
}

std::string join_names(std::span<const std::string_view> names) {
  return names.empty() ? "none" : fmt::format("{}", fmt::join(names, ", "));
}

std::string count_text(std::uint64_t count, std::string_view one, std::string_view several) {
  if (count == 1) return fmt::format("1 {}", one);
  return several.empty() ? fmt::format("{} {}s", count, one) : fmt::format("{} {}", count, several);
}

std::string unknown_option(std::span<const std::string> words, std::span<const std::string> options) {
  const std::vector<std::string_view> known(options.begin(), options.end());
  for (const std::string& word : words) {
    if (word == "--") break;  // arguments only
    const std::string_view name = std::string_view(word).substr(0, word.find('='));
    if (name.size() < 2 || !name.starts_with('-')) continue;
    // "-ojson": the value of a short option can follow at once.
    const std::string_view shortened = name.starts_with("--") ? name : name.substr(0, 2);
    if (std::ranges::find(known, name) != known.end() || std::ranges::find(known, shortened) != known.end())
      continue;
    const std::string_view near = nearest_name(name, known);
    return fmt::format("unknown option '{}'{}; known are {}", shown(name),
                       near.empty() ? "" : fmt::format(" (did you mean '{}'?)", near), join_names(known));
  }
  return {};
}

namespace {

constexpr std::size_t kLongestCharacter = 4;

}  // namespace

std::string_view cut(std::string_view text, std::size_t most) noexcept {
  if (text.size() <= most) return text;
  std::size_t end = most;
  while (end > 0 && most - end < kLongestCharacter && continues_utf8(text[end])) --end;
  return text.substr(0, end);
}

std::string shortened(std::string_view text, std::size_t most) {
  constexpr std::string_view kMore = "...";
  if (text.size() <= most) return std::string(text);
  return std::string(cut(text, most - std::min(most, kMore.size()))).append(kMore.substr(0, most));
}

std::string_view cut_front(std::string_view text, std::size_t most) noexcept {
  if (text.size() <= most) return text;
  text.remove_prefix(text.size() - most);
  std::size_t torn = 0;
  while (torn < std::min(text.size(), kLongestCharacter) && continues_utf8(text[torn])) ++torn;
  return text.substr(torn);
}

std::string shown(std::string_view text) {
  return printable(std::string(cut(text, kShownBytes)));
}

std::string join_some(std::span<const std::string> names) {
  if (names.empty()) return join_names({});
  const std::string more =
      names.size() > kShownNames ? fmt::format(" and {} more", names.size() - kShownNames) : "";
  const auto first = names.first(std::min(names.size(), kShownNames)) | std::views::transform(shown);
  return fmt::format("{}{}", fmt::join(first, ", "), more);
}

}  // namespace plchost
