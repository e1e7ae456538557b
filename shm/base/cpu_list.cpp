#include "shm/base/cpu_list.hpp"

#include <algorithm>
#include <charconv>
#include <cstdint>
#include <iterator>
#include <utility>

#include <fmt/format.h>

namespace plchost {

namespace {

// A number at the start of `text`, which is then without it.
template <class Number>
std::optional<Number> take_number(std::string_view& text, int base = 10) {
  Number number{};
  const auto [stopped, error] = std::from_chars(text.data(), text.data() + text.size(), number, base);
  if (error != std::errc()) return std::nullopt;
  text.remove_prefix(static_cast<std::size_t>(stopped - text.data()));
  return number;
}

bool take(std::string_view& text, char wanted) {
  if (!text.starts_with(wanted)) return false;
  text.remove_prefix(1);
  return true;
}

constexpr int kWordBits = 32;  // of a mask

bool is_core(int number) {
  return number >= 0 && number <= kMaxCoreNumber;
}

}  // namespace

std::optional<std::vector<int>> parse_cpu_list(std::string_view text) {
  std::vector<int> cores;
  if (text.empty()) return cores;
  do {
    const auto first = take_number<int>(text);
    const auto last = first && take(text, '-') ? take_number<int>(text) : first;
    if (!first || !last || !is_core(*first) || !is_core(*last) || *last < *first) return std::nullopt;
    for (int core = *first; core <= *last; ++core) cores.push_back(core);
  } while (take(text, ','));
  if (!text.empty()) return std::nullopt;
  return each_once(std::move(cores));
}

std::optional<std::vector<int>> parse_cpu_mask(std::string_view text) {
  std::vector<std::uint32_t> words;
  do {
    const auto word = take_number<std::uint32_t>(text, 16);
    if (!word || words.size() * kWordBits > kMaxCoreNumber) return std::nullopt;
    words.push_back(*word);
  } while (take(text, ','));
  if (!text.empty()) return std::nullopt;
  std::ranges::reverse(words);
  std::vector<int> cores;
  for (std::size_t i = 0; i < words.size(); ++i) {
    for (int bit = 0; bit < kWordBits; ++bit) {
      if ((words[i] >> bit & 1U) != 0) cores.push_back(static_cast<int>(i) * kWordBits + bit);
    }
  }
  return cores;
}

std::string format_cpu_list(const std::vector<int>& sorted) {
  std::string text;
  for (std::size_t i = 0; i < sorted.size();) {
    std::size_t last = i;
    while (last + 1 < sorted.size() && sorted[last + 1] == sorted[last] + 1) ++last;
    text += text.empty() ? "" : ",";
    text += last == i ? fmt::format("{}", sorted[i]) : fmt::format("{}-{}", sorted[i], sorted[last]);
    i = last + 1;
  }
  return text;
}

std::string format_cpu_mask(const std::vector<int>& sorted) {
  std::vector<std::uint32_t> words(sorted.empty() ? 1
                                                  : static_cast<std::size_t>(sorted.back() / kWordBits + 1));
  for (const int core : sorted) words[static_cast<std::size_t>(core / kWordBits)] |= 1U << core % kWordBits;
  std::string text = fmt::format("{:x}", words.back());
  for (std::size_t i = words.size() - 1; i-- > 0;) text += fmt::format(",{:08x}", words[i]);
  return text;
}

std::vector<int> each_once(std::vector<int> cores) {
  std::ranges::sort(cores);
  cores.erase(std::ranges::unique(cores).begin(), cores.end());
  return cores;
}

std::vector<int> common_cores(const std::vector<int>& a, const std::vector<int>& b) {
  std::vector<int> both;
  std::ranges::set_intersection(a, b, std::back_inserter(both));
  return both;
}

std::vector<int> cores_without(const std::vector<int>& a, const std::vector<int>& b) {
  std::vector<int> rest;
  std::ranges::set_difference(a, b, std::back_inserter(rest));
  return rest;
}

}  // namespace plchost
