#include "instances/io/modbus/client/pdu.hpp"

#include <algorithm>
#include <string_view>
#include <utility>

#include <fmt/format.h>
#include <modbus/modbus.h>

namespace plchost::modbus {

namespace {

using namespace std::string_view_literals;

constexpr std::uint8_t kRefused = 0x80;  // beside the function
constexpr std::size_t kExceptionSize = 2;
constexpr std::size_t kConfirmedSize = 5;  // function, address, count or value
constexpr std::size_t kValuesAt = 2;       // of a read response

constexpr std::array kReadFunctions = {MODBUS_FC_READ_COILS, MODBUS_FC_READ_DISCRETE_INPUTS,
                                       MODBUS_FC_READ_HOLDING_REGISTERS, MODBUS_FC_READ_INPUT_REGISTERS};
// The number is the code.
constexpr std::array kExceptions = {""sv,
                                    "Illegal function"sv,
                                    "Illegal data address"sv,
                                    "Illegal data value"sv,
                                    "Slave device or server failure"sv,
                                    "Acknowledge"sv,
                                    "Slave device or server is busy"sv,
                                    "Negative acknowledge"sv,
                                    "Memory parity error"sv,
                                    ""sv,
                                    "Gateway path unavailable"sv,
                                    "Target device failed to respond"sv};

void add_byte(Pdu& pdu, unsigned byte) noexcept {
  pdu.bytes[pdu.size++] = static_cast<std::uint8_t>(byte);
}

void add_word(Pdu& pdu, unsigned word) noexcept {
  add_byte(pdu, word >> 8U);
  add_byte(pdu, word & 0xffU);
}

std::size_t size_of_values(const RegisterMap& map) noexcept {
  return is_bit(map.kind) ? (map.count + 7) / 8 : std::size_t{map.count} * 2;
}

std::uint8_t read_function(const RegisterMap& map) noexcept {
  return static_cast<std::uint8_t>(kReadFunctions.at(std::to_underlying(map.kind)));
}

bool is_single_write(const RegisterMap& map) noexcept {
  return map.function == WriteFunction::single ||
         (map.function == WriteFunction::automatic && map.count == 1);
}

std::uint8_t write_function(const RegisterMap& map) noexcept {
  const bool single = is_single_write(map);
  if (is_bit(map.kind)) return single ? MODBUS_FC_WRITE_SINGLE_COIL : MODBUS_FC_WRITE_MULTIPLE_COILS;
  return single ? MODBUS_FC_WRITE_SINGLE_REGISTER : MODBUS_FC_WRITE_MULTIPLE_REGISTERS;
}

LinkResult no_answer(std::string text) {
  return std::unexpected(LinkFailure{.exception = 0, .text = std::move(text)});
}

// An exception, or a response to another function.
LinkResult check_function(std::uint8_t function, std::span<const std::uint8_t> response) {
  if (response.empty()) return no_answer("the response is empty");
  if (response[0] == function) return {};
  if (response[0] != (function | kRefused)) {
    return no_answer(fmt::format("the response is of function {}, and not of {}", response[0], function));
  }
  if (response.size() != kExceptionSize || response[1] == 0) return no_answer("the response is no exception");
  const std::uint8_t code = response[1];
  const std::string_view known = code < kExceptions.size() ? kExceptions.at(code) : ""sv;
  return std::unexpected(
      LinkFailure{.exception = code, .text = std::string(known.empty() ? "a code of its own"sv : known)});
}

}  // namespace

ResponseShape read_shape(const RegisterMap& map) noexcept {
  return {.function = read_function(map), .size = kValuesAt + size_of_values(map)};
}

ResponseShape write_shape(const RegisterMap& map) noexcept {
  return {.function = write_function(map), .size = kConfirmedSize};
}

Pdu read_request(const RegisterMap& map) noexcept {
  Pdu pdu;
  add_byte(pdu, read_function(map));
  add_word(pdu, map.address);
  add_word(pdu, map.count);
  return pdu;
}

bool is_one_write(const RegisterMap& map) noexcept {
  return map.count == 1 || !is_single_write(map);
}

Pdu write_request(const RegisterMap& map, MapValues& values) noexcept {
  constexpr unsigned kOn = 0xff00;
  const bool bits = is_bit(map.kind);
  Pdu pdu;
  add_byte(pdu, write_function(map));
  add_word(pdu, map.address);
  if (is_single_write(map)) {
    add_word(pdu, bits ? (values.bits(1)[0] != 0 ? kOn : 0) : values.registers(1)[0]);
    return pdu;
  }
  add_word(pdu, map.count);
  add_byte(pdu, static_cast<unsigned>(size_of_values(map)));
  if (!bits) {
    for (const std::uint16_t value : values.registers(map.count)) add_word(pdu, value);
    return pdu;
  }
  const auto all = values.bits(map.count);
  for (std::size_t first = 0; first < all.size(); first += 8) {
    unsigned byte = 0;
    for (std::size_t i = first; i < std::min(first + 8, all.size()); ++i) {
      byte |= (all[i] != 0 ? 1U : 0U) << (i - first);
    }
    add_byte(pdu, byte);
  }
  return pdu;
}

LinkResult take_values(const RegisterMap& map, std::span<const std::uint8_t> response, MapValues& values) {
  if (auto good = check_function(read_function(map), response); !good) return good;
  const std::size_t size = size_of_values(map);
  if (response.size() != kValuesAt + size || response[1] != size) {
    return no_answer(fmt::format("the response has {} bytes, and {} values have {}", response.size(),
                                 map.count, kValuesAt + size));
  }
  const auto bytes = response.subspan(kValuesAt);
  if (is_bit(map.kind)) {
    const auto bits = values.bits(map.count);
    for (std::size_t i = 0; i < bits.size(); ++i) bits[i] = bytes[i / 8] >> (i % 8) & 1U;
  } else {
    const auto registers = values.registers(map.count);
    for (std::size_t i = 0; i < registers.size(); ++i) {
      registers[i] = static_cast<std::uint16_t>(bytes[2 * i] << 8U | bytes[2 * i + 1]);
    }
  }
  return {};
}

LinkResult check_written(const Pdu& request, std::span<const std::uint8_t> response) {
  if (auto good = check_function(request.bytes[0], response); !good) return good;
  if (!std::ranges::equal(response, request.view().first(kConfirmedSize))) {
    return no_answer("the response confirms another address, count or value than was written");
  }
  return {};
}

}  // namespace plchost::modbus
