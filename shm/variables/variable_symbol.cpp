#include "shm/variables/variable_symbol.hpp"

#include <algorithm>
#include <iterator>
#include <limits>

#include <fmt/format.h>

#include "shm/base/names.hpp"

namespace plchost {

namespace {

constexpr std::string_view kIndex = "[]";

// In each locale the same.
unsigned char folded(char c) noexcept {
  return static_cast<unsigned char>(c >= 'A' && c <= 'Z' ? c - 'A' + 'a' : c);
}

bool is_word_character(char c) noexcept {
  const unsigned char lower = folded(c);
  return (lower >= 'a' && lower <= 'z') || (c >= '0' && c <= '9') || c == '_';
}

/// The number of "[]"; SIZE_MAX: it is not a name.
std::size_t count_indexes(std::string_view name) noexcept {
  constexpr std::size_t kNoName = std::numeric_limits<std::size_t>::max();
  std::size_t count = 0;
  char before = '.';
  for (std::size_t at = 0; at < name.size(); ++at) {
    if (name.substr(at).starts_with(kIndex) && before != '.') {
      ++count;
      ++at;
    } else if (name[at] == '.' ? before == '.' : !is_word_character(name[at]) || before == ']') {
      return kNoName;
    }
    before = name[at];
  }
  return before == '.' ? kNoName : count;
}

Result<void> invalid(std::string text) {
  return failure(ErrorCode::invalid_argument, std::move(text));
}

Result<void> check_dimensions(const VariableSymbol& symbol) {
  const std::size_t indexes = count_indexes(symbol.name);
  if (symbol.dimensions.size() > kMaxVariableDimensions || symbol.dimensions.size() != indexes) {
    return invalid(fmt::format("{} dimensions, and {} \"[]\" in its name; each needs one, at most {}",
                               symbol.dimensions.size(), indexes, kMaxVariableDimensions));
  }
  std::uint64_t elements = 1;
  for (const VariableDimension& dimension : symbol.dimensions) {
    const std::int64_t last = std::int64_t{dimension.first} + dimension.count - 1;
    elements *= dimension.count;
    if (dimension.count == 0 || last > std::numeric_limits<std::int32_t>::max() ||
        elements > kMaxVariableElements) {
      return invalid(fmt::format(
          "a dimension from {} with {} elements; allowed are 1 to {} in all, with indexes of a DINT",
          dimension.first, dimension.count, kMaxVariableElements));
    }
  }
  return {};
}

}  // namespace

std::uint32_t VariableSymbol::elements() const noexcept {
  std::uint32_t product = 1;
  for (const VariableDimension& dimension : dimensions) product *= dimension.count;
  return product;
}

Result<void> check_symbol(const VariableSymbol& symbol) {
  if (symbol.name.empty() || symbol.name.size() > kMaxVariableName ||
      count_indexes(symbol.name) > symbol.name.size()) {
    return invalid(
        fmt::format("a name has 1 to {} characters: words of letters, digits and _, with dots between them "
                    "and a \"[]\" for each dimension behind a word",
                    kMaxVariableName));
  }
  const VariableTypeTraits* const type = find_variable_type(std::to_underlying(symbol.type));
  if (type == nullptr) {
    return invalid(fmt::format("no type has number {}; they have 1 to {}", std::to_underlying(symbol.type),
                               variable_types().size()));
  }
  if (is_string(symbol.type) ? symbol.bytes < 2 || symbol.bytes > kMaxVariableBytes
                             : symbol.bytes != type->bytes) {
    return invalid(fmt::format(
        "{} bytes of memory; a {} has {}", symbol.bytes, type->name,
        is_string(symbol.type) ? fmt::format("2 to {}", kMaxVariableBytes) : fmt::format("{}", type->bytes)));
  }
  PLCHOST_TRY(check_dimensions(symbol));
  if (symbol.task.size() > kMaxTaskName || !is_printable_utf8(symbol.task))
    return invalid(
        fmt::format("the name of its task has more than {} bytes, or is not printable", kMaxTaskName));
  if (symbol.area.size() > kMaxVariableArea || !is_printable_utf8(symbol.area)) {
    return invalid(
        fmt::format("the text of its area has more than {} bytes, or is not printable", kMaxVariableArea));
  }
  return {};
}

int compare_variable_names(std::string_view left, std::string_view right) noexcept {
  for (std::size_t i = 0; i < std::min(left.size(), right.size()); ++i) {
    if (const int difference = folded(left[i]) - folded(right[i]); difference != 0) return difference;
  }
  return left.size() == right.size() ? 0 : left.size() < right.size() ? -1 : 1;
}

Error has_members(std::string_view name, std::string_view member) {
  return {.code = ErrorCode::invalid_argument,
          .system_errno = 0,
          .message = fmt::format("'{}' has members; name one, as {}", shown(name), shown(member))};
}

std::string type_text(const VariableSymbol& symbol) {
  std::string text;
  for (const VariableDimension& dimension : symbol.dimensions) {
    fmt::format_to(std::back_inserter(text), "{}{}..{}", text.empty() ? "ARRAY [" : ", ", dimension.first,
                   std::int64_t{dimension.first} + dimension.count - 1);
  }
  if (!text.empty()) text += "] OF ";
  text += traits_of(symbol.type).name;
  if (is_string(symbol.type))
    fmt::format_to(std::back_inserter(text), "[{}]", string_room(symbol.type, symbol.bytes));
  return text;
}

std::array<std::uint32_t, kMaxVariableDimensions> places_of(const VariableSymbol& symbol,
                                                            std::uint32_t element) noexcept {
  std::array<std::uint32_t, kMaxVariableDimensions> places{};
  for (std::size_t d = std::min(symbol.dimensions.size(), places.size()); d-- > 0;) {
    places.at(d) = element % symbol.dimensions[d].count;
    element /= symbol.dimensions[d].count;
  }
  return places;
}

std::string element_name(const VariableSymbol& symbol, std::uint32_t element) {
  const auto places = places_of(symbol, element);
  std::string text;
  std::size_t dimension = 0;
  for (std::size_t at = 0; at < symbol.name.size(); ++at) {
    if (symbol.name[at] != '[' || dimension == symbol.dimensions.size()) {
      text += symbol.name[at];
      continue;
    }
    // "Grid[][]" is "Grid[1,2]".
    if (text.ends_with(']')) {
      text.back() = ',';
    } else {
      text += '[';
    }
    fmt::format_to(std::back_inserter(text), "{}]",
                   std::int64_t{symbol.dimensions[dimension].first} + places.at(dimension));
    ++dimension;
    ++at;
  }
  return text;
}

}  // namespace plchost
