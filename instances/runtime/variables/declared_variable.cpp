#include "instances/runtime/variables/declared_variable.hpp"

#include <algorithm>
#include <iterator>
#include <utility>

#include <fmt/format.h>

#include "instances/runtime/variables/memory_map.hpp"
#include "shm/base/names.hpp"
#include "shm/log/log.hpp"

namespace plchost {

static_assert(PLC_MAX_SYMBOL_NAME == kMaxVariableName && PLC_MAX_DECLARED_VARIABLES == kMaxVariables);
static_assert(PLC_MAX_DIMENSIONS == kMaxVariableDimensions && PLC_MAX_STRING == kMaxVariableBytes);

namespace {

Result<void> bad_variable(std::string_view name, std::string_view what) {
  return failure(ErrorCode::invalid_argument, fmt::format("variable '{}': {}", shown(name), what));
}

std::string text_of(const char* text, std::size_t most) {
  return text == nullptr ? std::string() : std::string(cut(text, most + 1));
}

Result<void> check_declaration(const Plc_Variable& variable) {
  const std::string name = text_of(variable.pszName, kMaxVariableName);
  if (variable.pszName == nullptr) return failure(ErrorCode::invalid_argument, "pszName is null");
  if (variable.pAddress == nullptr) return bad_variable(name, "pAddress is null");
  if ((variable.dwFlags & ~PLC_VARIABLE_READ_ONLY) != 0)
    return bad_variable(name, fmt::format("dwFlags {:#x} are not allowed: bits of {:#x} are",
                                          variable.dwFlags, PLC_VARIABLE_READ_ONLY));
  const VariableTypeTraits* const type = find_variable_type(variable.dwType);
  if (type == nullptr)
    return bad_variable(
        name, fmt::format("dwType {} is not allowed: 1 to {} is", variable.dwType, variable_types().size()));
  if (!is_string(type->type) && variable.dwBytes != 0 && variable.dwBytes != type->bytes)
    return bad_variable(name,
                        fmt::format("dwBytes {} is not allowed: 0 or {} is", variable.dwBytes, type->bytes));
  if (variable.nDimensions > kMaxVariableDimensions)
    return bad_variable(name, fmt::format("nDimensions {} is not allowed: 0 to {} is", variable.nDimensions,
                                          kMaxVariableDimensions));
  return {};
}

// Strides: elements do not overlap, and all lie within what a process can have.
Result<void> check_strides(const DeclaredVariable& variable) {
  constexpr std::uint64_t kMostExtent = std::uint64_t{1} << 40U;
  const VariableSymbol& symbol = variable.symbol;
  for (std::size_t d = 0; d < symbol.dimensions.size(); ++d) {
    if (symbol.dimensions[d].count > 1 && variable.strides.at(d) < symbol.bytes) {
      return bad_variable(symbol.name,
                          fmt::format("dwStride {} is not allowed: {} and more is, the bytes of an element",
                                      variable.strides.at(d), symbol.bytes));
    }
  }
  if (variable.extent() > kMostExtent) return bad_variable(symbol.name, "dwStride is too large");
  return {};
}

std::uint64_t hash_of(std::string_view name) noexcept {
  constexpr std::uint64_t kOffset = 0xcbf29ce484222325;
  constexpr std::uint64_t kPrime = 0x100000001b3;
  std::uint64_t hash = kOffset;
  for (const char c : name) {
    const char folded = c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
    hash = (hash ^ static_cast<unsigned char>(folded)) * kPrime;
  }
  return hash;
}

}  // namespace

std::byte* DeclaredVariable::element(std::uint32_t number) const noexcept {
  const auto places = places_of(symbol, number);
  std::uint64_t offset = 0;
  for (std::size_t d = 0; d < symbol.dimensions.size(); ++d)
    offset += std::uint64_t{places.at(d)} * strides.at(d);
  return address + offset;
}

std::uint64_t DeclaredVariable::extent() const noexcept {
  std::uint64_t bytes = symbol.bytes;
  for (std::size_t d = 0; d < symbol.dimensions.size(); ++d)
    bytes += std::uint64_t{symbol.dimensions[d].count - 1} * strides.at(d);
  return bytes;
}

Result<DeclaredVariable> from_declaration(const Plc_Variable& variable) {
  if (variable.dwSize < sizeof(Plc_Variable)) {
    return failure(ErrorCode::invalid_argument,
                   fmt::format("dwSize {} is not allowed: {} is", variable.dwSize, sizeof(Plc_Variable)));
  }
  PLCHOST_TRY(check_declaration(variable));
  const VariableTypeTraits& type = *find_variable_type(variable.dwType);
  DeclaredVariable declared{.symbol = {.name = text_of(variable.pszName, kMaxVariableName),
                                       .type = type.type,
                                       .read_only = (variable.dwFlags & PLC_VARIABLE_READ_ONLY) != 0,
                                       .bytes = is_string(type.type) ? variable.dwBytes : type.bytes,
                                       .dimensions = {},
                                       .task = text_of(variable.pszTask, kMaxTaskName),
                                       .area = text_of(variable.pszArea, kMaxVariableArea)},
                            .address = static_cast<std::byte*>(variable.pAddress),
                            .strides = {}};
  for (unsigned d = 0; d < variable.nDimensions; ++d) {
    const Plc_Dimension& dimension = variable.aDimensions[d];
    declared.symbol.dimensions.push_back({.first = dimension.nFirst, .count = dimension.nCount});
    declared.strides.at(d) = dimension.dwStride;
  }
  if (auto valid = check_symbol(declared.symbol); !valid)
    return failure_in(fmt::format("variable '{}'", shown(declared.symbol.name)), std::move(valid).error());
  PLCHOST_TRY(check_strides(declared));
  return declared;
}

RTS_RESULT VariableCollection::declare(const Plc_Variable* variable) {
  const auto refuse = [](RTS_RESULT why, std::string_view text) {
    spdlog::error("plc_declare_variable: {}", text);
    return why;
  };
  if (variable == nullptr) return refuse(ERR_PARAMETER, "pVariable is null");
  auto declared = from_declaration(*variable);
  if (!declared) return refuse(ERR_PARAMETER, declared.error().message);
  const std::string& name = declared->symbol.name;
  // Names of one hash are compared: 65536 of them would be too many to compare all.
  auto& known = names_[hash_of(name)];
  for (const std::size_t other : known) {
    if (same_variable_name(variables_[other].symbol.name, name))
      return refuse(ERR_DUPLICATE, fmt::format("variable '{}' is declared twice", name));
  }
  if (variables_.size() == kMaxVariables)
    return refuse(ERR_NOMEMORY, fmt::format("variable '{}' is one too many: {} can be", name, kMaxVariables));
  known.push_back(variables_.size());
  variables_.push_back(*std::move(declared));
  return ERR_OK;
}

std::vector<DeclaredVariable> VariableCollection::take() {
  names_.clear();
  std::ranges::sort(variables_, [](const DeclaredVariable& left, const DeclaredVariable& right) {
    return compare_variable_names(left.symbol.name, right.symbol.name) < 0;
  });
  return std::exchange(variables_, {});
}

Result<void> check_variables(std::span<const DeclaredVariable> variables,
                             std::span<const std::string> tasks) {
  if (variables.empty()) return {};
  PLCHOST_TRY_ASSIGN(const auto map, MemoryMap::of_this_process());
  for (const DeclaredVariable& variable : variables) {
    const VariableSymbol& symbol = variable.symbol;
    if (!symbol.task.empty() && std::ranges::find(tasks, symbol.task) == tasks.end()) {
      return bad_variable(symbol.name, fmt::format("there is no task '{}'; there are {}", shown(symbol.task),
                                                   join_some(tasks)));
    }
    const auto begin = reinterpret_cast<std::uintptr_t>(variable.address);
    if (!map.allows(begin, variable.extent(), !symbol.read_only)) {
      return bad_variable(
          symbol.name,
          fmt::format("pAddress {:#x}: its {} bytes are not memory of this process that can be {}", begin,
                      variable.extent(), symbol.read_only ? "read" : "read and written"));
    }
  }
  return {};
}

}  // namespace plchost
