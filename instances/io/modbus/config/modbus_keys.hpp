#pragma once

#include <array>
#include <span>
#include <string>
#include <string_view>

#include "instances/io/modbus/config/modbus_config.hpp"
#include "shm/toml/key_table.hpp"

namespace plchost::modbus {

using namespace std::string_view_literals;

// In the order of their enumerators.
inline constexpr std::array kKindNames = {"coil"sv, "discrete_input"sv, "holding_register"sv,
                                          "input_register"sv};
inline constexpr std::array kOrderNames = {"single"sv, "abcd"sv, "cdab"sv, "badc"sv, "dcba"sv};
inline constexpr std::array kDirectionNames = {"input"sv, "output"sv, "memory"sv};
inline constexpr std::array kLossNames = {"keep"sv, "zero"sv};
inline constexpr std::array kFunctionNames = {"auto"sv, "single"sv, "several"sv};
inline constexpr std::array kParityNames = {"none"sv, "even"sv, "odd"sv};

/// One key of the file, as people are told of it.
struct ModbusKey {
  std::string_view section = {};
  std::string_view name;
  std::string_view initial = {};  ///< the default in words; empty: that of the struct
  std::string_view meaning;       ///< for the table in instances/io/modbus/modbus.md
};

/// The kinds of value need nothing beside the file.
struct ModbusReading {};

template <class Config>
using ModbusRow = KeyRow<ModbusKey, Config, ModbusReading>;

// The tables, in the order of instances/io/modbus/modbus.md.
[[nodiscard]] std::span<const ModbusRow<ProcessConfig>> process_keys() noexcept;
[[nodiscard]] std::span<const ModbusRow<ImageConfig>> image_keys() noexcept;
[[nodiscard]] std::span<const ModbusRow<DeviceConfig>> device_keys() noexcept;
[[nodiscard]] std::span<const ModbusRow<ServerConfig>> server_keys() noexcept;
[[nodiscard]] std::span<const ModbusRow<RegisterMap>> map_keys() noexcept;         ///< of all three
[[nodiscard]] std::span<const ModbusRow<RegisterMap>> read_map_keys() noexcept;    ///< beside map_keys()
[[nodiscard]] std::span<const ModbusRow<RegisterMap>> write_map_keys() noexcept;   ///< beside map_keys()
[[nodiscard]] std::span<const ModbusRow<RegisterMap>> server_map_keys() noexcept;  ///< beside map_keys()

/// The table of instances/io/modbus/modbus.md, a line with its end for each row.
[[nodiscard]] std::string modbus_key_table();

}  // namespace plchost::modbus
