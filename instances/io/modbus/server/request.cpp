#include "instances/io/modbus/server/request.hpp"

#include <algorithm>
#include <array>

#include <modbus/modbus.h>

namespace plchost::modbus {

namespace {

constexpr std::size_t kProtocolAt = 2;
constexpr std::size_t kLengthAt = 4;
constexpr std::size_t kUncounted = 6;  // bytes of the header that the length does not count
constexpr std::size_t kLeastLength = 2;
constexpr std::size_t kMostLength = kMaxFrame - kUncounted;

std::uint16_t word_at(std::span<const std::uint8_t> bytes, std::size_t at) noexcept {
  return static_cast<std::uint16_t>(bytes[at] << 8U | bytes[at + 1]);
}

/// A function that is served: the table, whether it writes, and the most that one request has. One: the value
/// stands where others have the count.
struct Function {
  std::uint8_t code;
  RegisterKind kind;
  bool writes;
  std::uint32_t most;
};
constexpr std::uint32_t kSingle = 1;
constexpr std::array kFunctions = {
    Function{MODBUS_FC_READ_COILS, RegisterKind::coil, false, kMaxReadBits},
    Function{MODBUS_FC_READ_DISCRETE_INPUTS, RegisterKind::discrete_input, false, kMaxReadBits},
    Function{MODBUS_FC_READ_HOLDING_REGISTERS, RegisterKind::holding_register, false, kMaxReadRegisters},
    Function{MODBUS_FC_READ_INPUT_REGISTERS, RegisterKind::input_register, false, kMaxReadRegisters},
    Function{MODBUS_FC_WRITE_SINGLE_COIL, RegisterKind::coil, true, kSingle},
    Function{MODBUS_FC_WRITE_SINGLE_REGISTER, RegisterKind::holding_register, true, kSingle},
    Function{MODBUS_FC_WRITE_MULTIPLE_COILS, RegisterKind::coil, true, kMaxWriteBits},
    Function{MODBUS_FC_WRITE_MULTIPLE_REGISTERS, RegisterKind::holding_register, true, kMaxWriteRegisters},
};

constexpr std::uint8_t kException = 0x80;  // in the function of a response
constexpr std::size_t kPlainSize = 5;      // function, address, count or value
constexpr std::uint16_t kOn = 0xff00;      // the value of a single coil

bool has_good_values(std::span<const std::uint8_t> pdu, const Function& function,
                     std::uint32_t count) noexcept {
  if (!function.writes) return pdu.size() == kPlainSize;
  if (function.most == kSingle) {
    const std::uint16_t value = word_at(pdu, 3);
    return pdu.size() == kPlainSize && (!is_bit(function.kind) || value == 0 || value == kOn);
  }
  const std::size_t bytes = is_bit(function.kind) ? (count + 7) / 8 : std::size_t{count} * 2;
  return pdu.size() == kPlainSize + 1 + bytes && pdu[kPlainSize] == bytes;
}

}  // namespace

Frame first_frame(std::span<const std::uint8_t> received) noexcept {
  if (received.size() >= kLengthAt && word_at(received, kProtocolAt) != 0)
    return {.state = FrameState::garbage, .size = 0};
  if (received.size() < kUncounted) return {};
  const std::size_t length = word_at(received, kLengthAt);
  if (length < kLeastLength || length > kMostLength) return {.state = FrameState::garbage, .size = 0};
  // An exception is no request. The number of its refusal would not fit into a byte.
  if (received.size() > kHeaderBytes && received[kHeaderBytes] >= kException)
    return {.state = FrameState::garbage, .size = 0};
  if (received.size() < kUncounted + length) return {};
  return {.state = FrameState::whole, .size = kUncounted + length};
}

std::expected<Request, std::uint8_t> parse_request(std::span<const std::uint8_t> frame) noexcept {
  const auto refused = [](unsigned exception) {
    return std::unexpected(static_cast<std::uint8_t>(exception));
  };
  const auto pdu = frame.subspan(kHeaderBytes);
  const auto* const function = std::ranges::find(kFunctions, pdu[0], &Function::code);
  if (function == kFunctions.end()) return refused(MODBUS_EXCEPTION_ILLEGAL_FUNCTION);
  if (pdu.size() < kPlainSize) return refused(MODBUS_EXCEPTION_ILLEGAL_DATA_VALUE);
  const std::uint16_t address = word_at(pdu, 1);
  const std::uint16_t count = function->most == kSingle ? std::uint16_t{1} : word_at(pdu, 3);
  const bool good = count >= 1 && count <= function->most && has_good_values(pdu, *function, count);
  if (!good) return refused(MODBUS_EXCEPTION_ILLEGAL_DATA_VALUE);
  if (address + std::uint32_t{count} > kRegisterSpace) return refused(MODBUS_EXCEPTION_ILLEGAL_DATA_ADDRESS);
  return Request{.kind = function->kind, .writes = function->writes, .address = address, .count = count};
}

void take_written(std::span<const std::uint8_t> frame, const Request& request, MapValues& values) noexcept {
  const auto pdu = frame.subspan(kHeaderBytes);
  const bool single = pdu.size() == kPlainSize;
  const auto data = pdu.subspan(single ? kPlainSize - 2 : kPlainSize + 1);
  if (is_bit(request.kind)) {
    const auto bits = values.bits(request.count);
    for (std::size_t i = 0; i < bits.size(); ++i) bits[i] = data[i / 8] >> (i % 8) & 1U;
    return;
  }
  const auto registers = values.registers(request.count);
  for (std::size_t i = 0; i < registers.size(); ++i) registers[i] = word_at(data, 2 * i);
}

}  // namespace plchost::modbus
