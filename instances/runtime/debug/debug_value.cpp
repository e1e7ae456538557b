#include "instances/runtime/debug/debug_value.hpp"

#include <cstring>

namespace plchost {

namespace {

template <class Value>
DebugNumber read_as(std::span<const std::byte> bytes) noexcept {
  Value value{};
  if (bytes.size() >= sizeof value) std::memcpy(&value, bytes.data(), sizeof value);
  return static_cast<DebugNumber>(value);
}

constexpr DebugNumber kNanosecondsPerDay = 86'400e9L;

DebugNumber timespec_number(std::span<const std::byte> bytes) noexcept {
  constexpr DebugNumber kNanoseconds = 1e9L;
  if (bytes.size() < 2 * sizeof(std::int64_t)) return 0;
  return read_as<std::int64_t>(bytes) * kNanoseconds +
         read_as<std::int64_t>(bytes.subspan(sizeof(std::int64_t)));
}

}  // namespace

DebugNumber number_of(VariableType type, std::span<const std::byte> value) noexcept {
  switch (type) {
    case VariableType::bool_:
      return read_as<std::uint8_t>(value) != 0 ? 1 : 0;
    case VariableType::sint:
      return read_as<std::int8_t>(value);
    case VariableType::int_:
      return read_as<std::int16_t>(value);
    case VariableType::dint:
      return read_as<std::int32_t>(value);
    case VariableType::usint:
    case VariableType::byte:
    case VariableType::char_:
      return read_as<std::uint8_t>(value);
    case VariableType::uint:
    case VariableType::word:
    case VariableType::wchar:
      return read_as<std::uint16_t>(value);
    case VariableType::udint:
    case VariableType::dword:
      return read_as<std::uint32_t>(value);
    case VariableType::ulint:
    case VariableType::lword:
      return read_as<std::uint64_t>(value);
    case VariableType::real:
      return read_as<float>(value);
    case VariableType::lreal:
      return read_as<double>(value);
    case VariableType::lint:
    case VariableType::time:
    case VariableType::date:
    case VariableType::time_of_day:
    case VariableType::date_and_time:
      return read_as<std::int64_t>(value);
    case VariableType::timespec_time:
    case VariableType::timespec_date:
    case VariableType::timespec_time_of_day:
    case VariableType::timespec_date_and_time:
      return timespec_number(value);
    case VariableType::days_date:
      return read_as<std::int64_t>(value) * kNanosecondsPerDay;
    case VariableType::string:
    case VariableType::counted_string:
    case VariableType::sized_string:
    case VariableType::wstring:
    case VariableType::sized_wstring:
      return 0;
  }
  return 0;
}

}  // namespace plchost
