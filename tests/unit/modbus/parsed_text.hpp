#pragma once

#include <expected>
#include <string>
#include <string_view>

#include <fmt/format.h>

#include "instances/io/modbus/config/load_modbus.hpp"

namespace plchost::modbus {

// The lines of this text are counted in the tests.
inline constexpr std::string_view kImages = R"([[image]]
name = "t.in"
direction = "input"
size = 64
[[image]]
name = "t.out"
direction = "output"
size = 64
)";

inline std::expected<ModbusConfig, ConfigErrors> parse(std::string_view text) {
  return parse_modbus_config(std::string(kImages) + std::string(text), "m.toml");
}

// All errors, or "accepted".
inline std::string refused(std::string_view text) {
  const auto config = parse(text);
  if (config) return "accepted";
  return fmt::format("{}", fmt::join(config.error(), "\n"));
}

}  // namespace plchost::modbus
