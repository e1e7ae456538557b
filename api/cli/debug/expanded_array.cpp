#include "api/cli/debug/expanded_array.hpp"

#include <algorithm>
#include <charconv>
#include <system_error>

#include <fmt/format.h>

#include "shm/base/trimmed.hpp"

namespace plchost {

namespace {

std::optional<std::int64_t> number_of(std::string_view text) {
  std::int32_t number = 0;
  const auto [stop, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  return error == std::errc() && stop == text.data() + text.size() ? std::optional(std::int64_t{number})
                                                                   : std::nullopt;
}

}  // namespace

std::optional<ExpandedArray> ExpandedArray::of(std::string_view name, std::string_view type) {
  const std::size_t begin = type.find('[');
  const std::size_t end = type.find("] OF ");
  if (!type.starts_with("ARRAY") || begin > end || end == std::string_view::npos) return std::nullopt;
  ExpandedArray array;
  array.name_ = name;
  array.element_type_ = type.substr(end + std::string_view("] OF ").size());
  std::string_view rest = type.substr(begin + 1, end - begin - 1);
  while (!rest.empty()) {
    const std::string_view bounds = trimmed(rest.substr(0, rest.find(',')));
    rest.remove_prefix(std::min(rest.find(','), rest.size() - 1) + 1);
    const std::size_t dots = bounds.find("..");
    if (dots == std::string_view::npos) return std::nullopt;
    const auto first = number_of(bounds.substr(0, dots));
    const auto last = number_of(bounds.substr(dots + 2));
    if (!first || !last || *first > *last) return std::nullopt;
    array.dimensions_.push_back({.first = *first, .count = static_cast<std::uint64_t>(*last - *first + 1)});
    array.elements_ *= array.dimensions_.back().count;
    if (array.elements_ > kMaxVariableElements) return std::nullopt;
  }
  std::size_t places = 0;
  for (std::size_t at = name.find("[]"); at != std::string_view::npos; at = name.find("[]", at + 2)) ++places;
  if (places == 0 || places != array.dimensions_.size()) return std::nullopt;
  return array;
}

Result<std::uint64_t> ExpandedArray::number(const IndexedName& element) const {
  std::uint64_t number = 0;
  for (std::size_t d = 0; d < dimensions_.size(); ++d) {
    const auto [first, count] = dimensions_[d];
    const auto index = d < element.indexes.size() ? element.indexes[d] : std::nullopt;
    if (!index || *index < first || static_cast<std::uint64_t>(*index - first) >= count) {
      return failure(ErrorCode::invalid_argument,
                     fmt::format("{}: allowed as index {} are {} to {}", name_, d + 1, first,
                                 first + static_cast<std::int64_t>(count) - 1));
    }
    number = number * count + static_cast<std::uint64_t>(*index - first);
  }
  return number;
}

std::string ExpandedArray::element(std::uint64_t number) const {
  std::vector<std::int64_t> indexes(dimensions_.size());
  for (std::size_t d = dimensions_.size(); d-- > 0;) {
    indexes[d] = dimensions_[d].first + static_cast<std::int64_t>(number % dimensions_[d].count);
    number /= dimensions_[d].count;
  }
  std::string whole;
  std::size_t next = 0;
  std::string_view rest = name_;
  while (!rest.empty()) {
    if (!rest.starts_with("[]")) {
      whole += rest.front();
      rest.remove_prefix(1);
      continue;
    }
    // As hosts name it: "Grid[1,2]".
    if (whole.ends_with(']')) {
      whole.back() = ',';
    } else {
      whole += '[';
    }
    whole += fmt::format("{}]", indexes[next++]);
    rest.remove_prefix(2);
  }
  return whole;
}

}  // namespace plchost
