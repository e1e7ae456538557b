#include "instances/runtime/debug/declared_pou.hpp"

#include <algorithm>
#include <cstddef>
#include <cstring>
#include <limits>
#include <span>
#include <utility>

#include <fmt/format.h>

#include "instances/runtime/debug/debug_value.hpp"
#include "instances/runtime/debug/debug_words.hpp"
#include "shm/base/names.hpp"
#include "shm/base/path_parts.hpp"
#include "shm/log/log.hpp"
#include "shm/variables/indexed_name.hpp"

namespace plchost {

namespace {

constexpr std::size_t kMaxPouName = 63;
constexpr std::size_t kMaxPouFile = 255;

RTS_RESULT refuse_pou(RTS_RESULT why, std::string_view name, std::string_view text) {
  spdlog::error("plc_debug_declare_pou: POU '{}': {}", shown(name), text);
  return why;
}

std::string_view text_at(const char* text, std::size_t most) noexcept {
  return text == nullptr ? std::string_view() : std::string_view(text, ::strnlen(text, most + 1));
}

bool is_pou_name(std::string_view name) noexcept {
  const auto is_word = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_';
  };
  return !name.empty() && name.size() <= kMaxPouName && std::ranges::all_of(name, is_word);
}

// A debug build of before ends there.
constexpr std::size_t kSizeWithoutArrays = offsetof(Plc_Pou, pArrays);

std::span<const Plc_LocalArray> arrays_of(const Plc_Pou& pou) noexcept {
  if (pou.dwSize == kSizeWithoutArrays || pou.pArrays == nullptr) return {};
  return {pou.pArrays, pou.nArrays};
}

Result<void> give_dimensions(DeclaredLocal& local, const Plc_LocalArray& array) {
  if (array.nDimensions == 0 || array.nDimensions > PLC_MAX_DIMENSIONS) {
    return failure(ErrorCode::invalid_argument,
                   fmt::format("an array has 1 to {} dimensions", PLC_MAX_DIMENSIONS));
  }
  std::uint64_t reach = local.symbol.bytes;
  for (const Plc_Dimension& one : std::span(array.aDimensions).first(array.nDimensions)) {
    local.symbol.dimensions.push_back({.first = one.nFirst, .count = one.nCount});
    local.strides.push_back(one.dwStride);
    reach += std::uint64_t{one.nCount} * one.dwStride;
  }
  if (reach <= std::numeric_limits<std::uint32_t>::max()) return {};
  return failure(ErrorCode::invalid_argument, "an array has less than 4 GiB");
}

Result<DeclaredLocal> declared_local(const Plc_Local& local, const Plc_LocalArray* array) {
  const auto name = text_at(local.pszName, kMaxVariableName);
  const auto bad = [&](std::string_view what) {
    return failure(ErrorCode::invalid_argument, fmt::format("local variable '{}': {}", shown(name), what));
  };
  const VariableTypeTraits* const type = find_variable_type(local.dwType);
  if (type == nullptr)
    return bad(fmt::format("dwType {} is not allowed: 1 to {} is", local.dwType, variable_types().size()));
  if (!is_string(type->type) && local.dwBytes != 0 && local.dwBytes != type->bytes)
    return bad(fmt::format("dwBytes {} is not allowed: 0 or {} is", local.dwBytes, type->bytes));
  DeclaredLocal made{.symbol = {.name = std::string(name),
                                .type = type->type,
                                .bytes = is_string(type->type) ? local.dwBytes : type->bytes},
                     .first_line = local.dwFirstLine,
                     .last_line = local.dwLastLine};
  if (array != nullptr) {
    if (const auto given = give_dimensions(made, *array); !given) return bad(given.error().message);
  }
  if (const auto valid = check_symbol(made.symbol); !valid) return bad(valid.error().message);
  if (local.dwFirstLine > local.dwLastLine || (local.dwFirstLine == 0) != (local.dwLastLine == 0)) {
    return bad(fmt::format("the lines {} to {} are not allowed: they ascend, or both are 0",
                           local.dwFirstLine, local.dwLastLine));
  }
  return made;
}

Result<std::vector<DeclaredLocal>> declared_locals(const Plc_Pou& pou) {
  if (pou.nLocals > PLC_MAX_POU_LOCALS || (pou.nLocals > 0 && pou.pLocals == nullptr)) {
    return failure(ErrorCode::invalid_argument,
                   fmt::format("it has 0 to {} local variables", PLC_MAX_POU_LOCALS));
  }
  std::vector<const Plc_LocalArray*> arrays(pou.nLocals, nullptr);
  for (const Plc_LocalArray& array : arrays_of(pou)) {
    if (array.dwLocal >= pou.nLocals || arrays[array.dwLocal] != nullptr) {
      return failure(ErrorCode::invalid_argument,
                     fmt::format("pArrays: dwLocal {} is not allowed: below {}, and each once", array.dwLocal,
                                 pou.nLocals));
    }
    arrays[array.dwLocal] = &array;
  }
  std::vector<DeclaredLocal> locals;
  for (const Plc_Local& one : std::span(pou.pLocals, pou.nLocals)) {
    PLCHOST_TRY_ASSIGN(auto local, declared_local(one, arrays[locals.size()]));
    locals.push_back(std::move(local));
  }
  return locals;
}

bool ascend(std::span<const std::uint32_t> lines) noexcept {
  return lines.front() > 0 && std::ranges::adjacent_find(lines, std::ranges::greater_equal()) == lines.end();
}

std::string_view last_name(std::string_view path) noexcept {
  return path.substr(path.find_last_of('/') + 1);
}

// How well a declared file is the one that is asked for; 0: it is not. A whole path may be that of another
// machine, or of another folder. A part of a path must agree as far as it goes.
std::size_t agreement(std::string_view declared, std::string_view asked) noexcept {
  const std::size_t common = common_last_parts(declared, asked);
  const bool is_part = common == std::min(path_parts(declared), path_parts(asked));
  return is_part || asked.starts_with('/') ? common : 0;
}

}  // namespace

std::optional<std::uint32_t> DeclaredPou::line_from(std::uint32_t line) const noexcept {
  const auto found = std::ranges::lower_bound(lines, line);
  return found == lines.end() ? std::nullopt : std::optional(*found);
}

namespace {

// Lines of a method may lie between others of its block: the narrowest range is that of the method.
template <class Has>
std::optional<std::uint32_t> narrowest(std::span<const DeclaredLocal> locals, std::string_view canonical,
                                       std::uint32_t line, const Has& has) noexcept {
  std::optional<std::uint32_t> found;
  for (std::uint32_t i = 0; i < locals.size(); ++i) {
    if (!locals[i].is_at(line) || !has(i) || !same_without_brackets(locals[i].symbol.name, canonical))
      continue;
    if (!found || locals[i].reach() < locals[*found].reach()) found = i;
  }
  return found;
}

template <class Has>
Result<std::optional<LocalElement>> element(std::span<const DeclaredLocal> locals, std::string_view name,
                                            std::uint32_t line, const Has& has) {
  const auto indexed = IndexedName::parse(name);
  if (!indexed) return std::nullopt;
  const auto number = narrowest(locals, indexed->canonical, line, has);
  if (!number) return std::nullopt;
  const DeclaredLocal& local = locals[*number];
  if (!same_variable_name(local.symbol.name, indexed->canonical))
    return std::unexpected(other_dimensions(name, local.symbol));
  auto place = element_number(local.symbol, *indexed);
  if (!place) return failure_in(fmt::format("'{}'", shown(name)), std::move(place).error());
  return LocalElement{.local = *number, .offset = local.offset(*place)};
}

}  // namespace

std::uint32_t DeclaredLocal::offset(std::uint32_t element) const noexcept {
  const auto places = places_of(symbol, element);
  std::uint32_t bytes = 0;
  for (std::size_t d = 0; d < strides.size(); ++d) bytes += places.at(d) * strides[d];
  return bytes;
}

Result<std::optional<LocalElement>> DeclaredPou::local(std::string_view local_name,
                                                       std::uint32_t line) const {
  return element(locals, local_name, line, [](std::uint32_t) { return true; });
}

Result<std::optional<LocalElement>> DeclaredPou::local(std::string_view local_name,
                                                       const Plc_Frame& frame) const {
  return element(locals, local_name, frame.dwLine,
                 [&](std::uint32_t number) { return local_address(frame, number) != nullptr; });
}

RTS_RESULT PouCollection::declare(Plc_Pou* pou) {
  if (pou == nullptr) return refuse_pou(ERR_PARAMETER, "", "pPou is null");
  const bool is_known = pou->dwSize == sizeof(Plc_Pou) || pou->dwSize == kSizeWithoutArrays;
  const auto name = text_at(is_known ? pou->pszName : nullptr, kMaxPouName);
  if (!is_known) return refuse_pou(ERR_PARAMETER, "", fmt::format("dwSize is not {}", sizeof(Plc_Pou)));
  if (!is_pou_name(name)) {
    return refuse_pou(ERR_PARAMETER, name,
                      fmt::format("a name has 1 to {} letters, digits and _", kMaxPouName));
  }
  const auto file = text_at(pou->pszFile, kMaxPouFile);
  if (file.empty() || file.size() > kMaxPouFile || !is_printable_utf8(file))
    return refuse_pou(ERR_PARAMETER, name, fmt::format("pszFile has 1 to {} characters", kMaxPouFile));
  if (pou->pdwLines == nullptr || pou->nLines == 0 || pou->nLines > PLC_MAX_POU_LINES)
    return refuse_pou(ERR_PARAMETER, name, fmt::format("it has 1 to {} lines", PLC_MAX_POU_LINES));
  const std::span lines(pou->pdwLines, pou->nLines);
  if (!ascend(lines)) return refuse_pou(ERR_PARAMETER, name, "its lines are above 0 and ascend");
  auto locals = declared_locals(*pou);
  if (!locals) return refuse_pou(ERR_PARAMETER, name, locals.error().message);
  const bool known = std::ranges::any_of(
      pous_, [&](const DeclaredPou& other) { return same_variable_name(other.name, name); });
  if (known) return refuse_pou(ERR_DUPLICATE, name, "it is declared twice");
  if (pous_.size() == PLC_MAX_POUS)
    return refuse_pou(ERR_NOMEMORY, name, fmt::format("there are {} already", PLC_MAX_POUS));
  pou->dwNumber = static_cast<unsigned>(pous_.size());
  pous_.push_back({.name = std::string(name),
                   .file = std::string(file),
                   .lines = {lines.begin(), lines.end()},
                   .locals = *std::move(locals)});
  return ERR_OK;
}

RTS_RESULT PouCollection::declare_instance(const Plc_Pou* pou, const void* self, const char* path) {
  const auto text = text_at(path, kMaxVariableName);
  const auto refuse = [&](RTS_RESULT why, std::string_view reason) {
    spdlog::error("plc_debug_declare_instance: '{}': {}", shown(text), reason);
    return why;
  };
  const bool known =
      pou != nullptr && pou->dwNumber < pous_.size() && pous_[pou->dwNumber].name == pou->pszName;
  if (!known) return refuse(ERR_PARAMETER, "its POU is not declared");
  if (self == nullptr) return refuse(ERR_PARAMETER, "pSelf is null");
  if (text.empty() || text.size() > kMaxVariableName || !is_printable_utf8(text))
    return refuse(ERR_PARAMETER, fmt::format("a path has 1 to {} characters", kMaxVariableName));
  if (instances_.size() == PLC_MAX_POU_INSTANCES)
    return refuse(ERR_NOMEMORY, fmt::format("there are {} already", PLC_MAX_POU_INSTANCES));
  const bool added = instances_.emplace(std::pair(pou->dwNumber, self), text).second;
  return added ? ERR_OK : refuse(ERR_DUPLICATE, "it is declared twice");
}

std::string_view PouCollection::path_of(std::uint32_t pou, const void* self) const noexcept {
  const auto found = instances_.find({pou, self});
  return found == instances_.end() ? std::string_view() : std::string_view(found->second);
}

std::vector<PouCollection::PouInstance> PouCollection::instances_of(std::uint32_t pou) const {
  std::vector<PouInstance> found;
  for (auto one = instances_.lower_bound({pou, nullptr}); one != instances_.end() && one->first.first == pou;
       ++one)
    found.push_back({.self = one->first.second, .path = one->second});
  return found;
}

Result<PouLine> PouCollection::find(std::string_view place) const {
  const std::size_t colon = place.find_last_of(':');
  std::uint32_t line = 0;
  if (colon != std::string_view::npos) {
    line = number_in<std::uint32_t>(place.substr(colon + 1)).value_or(0);
    if (line == 0) {
      return failure(ErrorCode::invalid_argument,
                     fmt::format("'{}' is no place: POU, POU:LINE or FILE:LINE is", shown(place)));
    }
  }
  const auto name = place.substr(0, colon);
  for (std::uint32_t pou = 0; pou < pous_.size(); ++pou) {
    if (!same_variable_name(pous_[pou].name, name)) continue;
    if (const auto found = pous_[pou].line_from(line)) return PouLine{.pou = pou, .line = *found};
    return failure(ErrorCode::not_found,
                   fmt::format("POU '{}' has no statement from line {} on; its last is in line {}",
                               pous_[pou].name, line, pous_[pou].lines.back()));
  }
  if (colon != std::string_view::npos) return find_in_file(name, line);
  std::vector<std::string> names;
  for (const DeclaredPou& pou : pous_) names.emplace_back(pou.name);
  return failure(ErrorCode::not_found,
                 fmt::format("no POU '{}'; there are: {}", shown(name), join_some(names)));
}

// The file that agrees most. A POU that holds the line goes before one that only begins behind it.
Result<PouLine> PouCollection::find_in_file(std::string_view file, std::uint32_t line) const {
  std::optional<PouLine> best;
  std::uint32_t distance = std::numeric_limits<std::uint32_t>::max();
  std::size_t most = 0;
  for (const DeclaredPou& pou : pous_) most = std::max(most, agreement(pou.file, file));
  for (std::uint32_t pou = 0; most > 0 && pou < pous_.size(); ++pou) {
    if (agreement(pous_[pou].file, file) != most) continue;
    const auto found = pous_[pou].line_from(line);
    if (!found || *found - line >= distance) continue;
    distance = *found - line;
    best = PouLine{.pou = pou, .line = *found};
  }
  if (best) return *best;
  if (most > 0) {
    return failure(ErrorCode::not_found,
                   fmt::format("'{}' has no statement from line {} on", shown(file), line));
  }
  std::vector<std::string> names;
  for (const DeclaredPou& pou : pous_) {
    names.emplace_back(pou.name);
    if (std::ranges::find(names, last_name(pou.file)) == names.end()) names.emplace_back(last_name(pou.file));
  }
  return failure(ErrorCode::not_found,
                 fmt::format("no POU or file '{}'; there are: {}", shown(file), join_some(names)));
}

}  // namespace plchost
