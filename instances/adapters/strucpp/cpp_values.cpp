#include "instances/adapters/strucpp/cpp_values.hpp"

#include <algorithm>
#include <charconv>
#include <cstddef>
#include <ranges>
#include <utility>

#include <fmt/format.h>

#include "instances/adapters/iec/tokens.hpp"
#include "instances/adapters/strucpp/symbols.hpp"
#include "instances/plc_debug.h"
#include "instances/plc_variables.h"
#include "shm/base/trimmed.hpp"

namespace plchost::strucpp {

namespace {

constexpr std::string_view kIndent = "    ";
constexpr std::string_view kLibrary = "IEC_";
constexpr std::string_view kPlain = "_t";
constexpr std::string_view kString = "IECStringVar<";
constexpr std::string_view kWideString = "IECWStringVar<";
constexpr std::string_view kEnumeration = "IEC_ENUM<";
constexpr std::string_view kArray = "Array";
/// The library adds the length to the characters, and an end.
constexpr unsigned kMostBytes = PLC_MAX_STRING - 16;

bool is_letter(char c) noexcept {
  return (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '_';
}

// Up to its initial value.
std::string_view declaration_in(std::string_view text) {
  int depth = 0;
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] == '<') ++depth;
    if (text[i] == '>') --depth;
    if (depth != 0) continue;
    if (text[i] == '(') return {};  // a function
    if (text[i] == '=' || text[i] == '{' || text[i] == ';') return text.substr(0, i);
  }
  return text;
}

/// The number of an elementary type, as "IEC_INT" or "INT_t"; 0: it is none.
unsigned elementary(std::string_view type) {
  if (type.starts_with(kLibrary)) return type_number(type.substr(kLibrary.size()));
  return type.ends_with(kPlain) ? type_number(type.substr(0, type.size() - kPlain.size())) : 0;
}

/// The number of a type of texts, as "IEC_STRING" or "IECStringVar<10>"; 0: it is none, or has too many
/// characters.
unsigned string_number(std::string_view type) {
  if (type == "IEC_STRING") return PLC_TYPE_SIZED_STRING;
  if (type == "IEC_WSTRING") return PLC_TYPE_SIZED_WSTRING;
  const bool is_wide = type.starts_with(kWideString);
  if (!is_wide && !type.starts_with(kString)) return 0;
  unsigned characters = 0;
  std::from_chars(type.data() + type.find('<') + 1, type.data() + type.size(), characters);
  if (characters == 0 || characters > kMostBytes / (is_wide ? sizeof(char16_t) : 1)) return 0;
  return is_wide ? PLC_TYPE_SIZED_WSTRING : PLC_TYPE_SIZED_STRING;
}

/// "IEC_ENUM<COLOR>" is of "COLOR"; others stay as they are.
std::string enumeration_in(const std::string& type) {
  if (!type.starts_with(kEnumeration) || !type.ends_with('>')) return type;
  return type.substr(kEnumeration.size(), type.size() - kEnumeration.size() - 1);
}

/// "Array2D<IEC_INT, 0, 1, 2, 4>"
struct CppArray {
  std::string element;
  std::vector<iec::DebugLocal::Dimension> dimensions;

  /// Nothing: the text is something else.
  static std::optional<CppArray> parse(std::string_view type) {
    const std::size_t begin = type.find('<');
    if (!type.starts_with(kArray) || begin == std::string_view::npos || !type.ends_with('>'))
      return std::nullopt;
    const std::string_view words = type.substr(begin + 1, type.size() - begin - 2);
    std::size_t end = 0;
    for (int depth = 0; end < words.size() && (depth > 0 || words[end] != ','); ++end)
      depth += words[end] == '<' ? 1 : words[end] == '>' ? -1 : 0;
    CppArray array{.element = std::string(trimmed(words.substr(0, end))), .dimensions = {}};
    std::vector<std::int64_t> bounds;
    for (const auto part : std::views::split(words.substr(std::min(end + 1, words.size())), ',')) {
      const std::string_view text = trimmed(std::string_view(part.begin(), part.end()));
      const auto [stop, error] =
          std::from_chars(text.data(), text.data() + text.size(), bounds.emplace_back());
      if (error != std::errc() || stop != text.data() + text.size()) return std::nullopt;
    }
    if (bounds.empty() || bounds.size() % 2 != 0) return std::nullopt;
    for (std::size_t i = 0; i < bounds.size(); i += 2) {
      if (bounds[i] < INT32_MIN || bounds[i + 1] > INT32_MAX || bounds[i + 1] < bounds[i])
        return std::nullopt;
      array.dimensions.push_back({.first = bounds[i],
                                  .count = static_cast<std::uint64_t>(bounds[i + 1] - bounds[i] + 1),
                                  .stride = ""});
    }
    iec::give_strides(std::span(array.dimensions), array.bytes_of_element());
    return array;
  }

 private:
  // In C++. The library keeps elements one behind the other, and nothing else.
  [[nodiscard]] std::string bytes_of_element() const {
    if (const auto inner = parse(element))
      return fmt::format("{}u * {}", inner->dimensions.front().count, inner->dimensions.front().stride);
    const std::string plain = enumeration_in(element);
    return plain == element ? fmt::format("sizeof(strucpp::{})", element)
                            : fmt::format("sizeof(strucpp::{}strucpp::{}>)", kEnumeration, plain);
  }
};

}  // namespace

std::optional<CppVariable> CppVariable::parse(std::string_view text) {
  text = trimmed(declaration_in(text));
  std::size_t begin = text.size();
  while (begin > 0 && is_letter(text[begin - 1])) --begin;
  CppVariable variable{.type = "", .name = std::string(text.substr(begin))};
  std::string_view type = trimmed(text.substr(0, begin), " &");
  constexpr std::string_view kConst = "const ";
  if (type.starts_with(kConst)) type.remove_prefix(kConst.size());
  variable.type = type;
  // Names that begin with two are the compiler's own.
  if (variable.type.empty() || variable.name.empty() || variable.name.starts_with("__")) return std::nullopt;
  return variable;
}

CppValues::CppValues(std::string_view header, std::span<const iec::Source> sources) {
  for (const auto part : std::views::split(header, '\n'))
    read_line(std::string_view(part.begin(), part.end()));
  for (const iec::Source& source : sources) {
    for (const iec::Token& token : iec::tokens_of(source.text, source.file).all) {
      if (token.kind == iec::Token::Kind::name) names_.try_emplace(iec::folded(token.text), token.text);
    }
  }
}

void CppValues::read_line(std::string_view line) {
  const auto behind = [&](std::string_view word) {
    if (!line.starts_with(word)) return std::string();
    const std::string_view rest = line.substr(word.size());
    return std::string(
        rest.substr(0, static_cast<std::size_t>(std::ranges::find_if_not(rest, is_letter) - rest.begin())));
  };
  if (const std::string name = behind("using "); !name.empty()) {
    const std::size_t equal = line.find('=');
    const std::size_t end = line.find(';');
    if (equal != std::string_view::npos && end != std::string_view::npos && equal < end)
      aliases_.try_emplace(name, trimmed(line.substr(equal + 1, end - equal - 1)));
  } else if (const std::string enumeration = behind("enum class "); !enumeration.empty()) {
    enumerations_.insert(enumeration);
  } else if (line.ends_with('{') && (line.starts_with("struct ") || line.starts_with("class "))) {
    const bool is_structure = line.starts_with("struct ");
    in_ = behind(is_structure ? "struct " : "class ");
    if (is_structure) structures_.insert(in_);
  } else if (line.starts_with('}')) {
    in_.clear();
  } else if (!in_.empty() && line.starts_with(kIndent) && line.ends_with(';')) {
    if (auto member = CppVariable::parse(line)) members_[in_].push_back(*std::move(member));
  }
}

const CppVariable* CppValues::member(const std::string& type, const std::string& name) const {
  const auto found = members_.find(type);
  if (found == members_.end()) return nullptr;
  for (const std::string& called : {name, name + "_"}) {
    const auto one = std::ranges::find(found->second, called, &CppVariable::name);
    if (one != found->second.end()) return &*one;
  }
  return nullptr;
}

// The compiler puts an underscore behind some names.
std::string CppValues::name_in_source(const std::string& name) const {
  auto found = names_.find(name);
  if (found == names_.end() && name.ends_with('_')) found = names_.find(name.substr(0, name.size() - 1));
  return found == names_.end() ? name : found->second;
}

void CppValues::add(std::vector<iec::DebugLocal>& locals, const CppVariable& variable,
                    const std::string& name) const {
  add(locals, {.type = variable.type, .name = name, .value = variable.name}, 0);
}

void CppValues::add(std::vector<iec::DebugLocal>& locals, const Part& part, std::size_t depth) const {
  const std::string& type = part.type;
  if (depth > iec::kMostNested || locals.size() == PLC_MAX_POU_LOCALS ||
      part.name.size() > PLC_MAX_SYMBOL_NAME)
    return;
  const auto found = [&](std::string number, std::string bytes) {
    locals.push_back({.name = part.name,
                      .type = std::move(number),
                      .bytes = std::move(bytes),
                      .address = fmt::format("::plchost_local({})", part.value),
                      .dimensions = part.dimensions});
  };
  if (const unsigned number = elementary(type); number != 0) return found(fmt::format("{}u", number), "0");
  if (const unsigned number = string_number(type); number != 0)
    return found(fmt::format("{}u", number), fmt::format("plchost_bytes<strucpp::{}>", type));
  if (type.starts_with(kArray)) return add_array(locals, part, depth);
  const std::string plain = enumeration_in(type);
  if (enumerations_.contains(plain))
    return found(fmt::format("plchost_enumeration<strucpp::{}>", plain), "0");
  Part next = part;
  if (const auto alias = aliases_.find(type); alias != aliases_.end()) {
    next.type = alias->second;
    return add(locals, next, depth + 1);
  }
  const auto fields = members_.find(type);
  if (fields == members_.end() || !structures_.contains(type)) return;
  for (const CppVariable& field : fields->second) {
    next.type = field.type;
    next.name = fmt::format("{}.{}", part.name, name_in_source(field.name));
    next.value = fmt::format("{}.{}", part.value, field.name);
    add(locals, next, depth + 1);
  }
}

void CppValues::add_array(std::vector<iec::DebugLocal>& locals, const Part& array, std::size_t depth) const {
  const auto type = CppArray::parse(array.type);
  if (!type) return;
  Part element{.type = type->element, .name = array.name, .value = "", .dimensions = array.dimensions};
  std::string first;
  for (const iec::DebugLocal::Dimension& one : type->dimensions) {
    element.name += "[]";
    first += fmt::format(", {}L", one.first);
    element.dimensions.push_back(one);
  }
  element.value = fmt::format("::plchost_at({}{})", array.value, first);
  if (iec::are_allowed(element.dimensions)) add(locals, element, depth + 1);
}

}  // namespace plchost::strucpp
