#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <expected>
#include <span>
#include <string>

#include <modbus/modbus.h>

#include "instances/io/modbus/config/map_values.hpp"
#include "instances/io/modbus/config/modbus_config.hpp"

namespace plchost::modbus {

// Requests to a device and its responses, without what is around them on TCP and on a serial line. Pure.

/// A request that was not answered as it should be.
struct LinkFailure {
  std::uint8_t exception = 0;  ///< the code of the device; 0: no answer, or garbage
  std::string text;
  bool not_sent = false;    ///< the line or the connection is not open
  bool not_asked = false;   ///< this process ends: nothing was sent, nothing is known of the device
  bool at_rest = false;     ///< the connection had ended before the response began
  bool timed_out = false;   ///< nothing came at a serial line
  bool is_garbled = false;  ///< bytes came at a serial line, but no whole response of the device

  /// The device has answered, and refuses the request. A gateway refuses with codes of its own if it does not
  /// reach the device.
  [[nodiscard]] bool is_refusal() const noexcept {
    return exception != 0 && exception != MODBUS_EXCEPTION_GATEWAY_PATH &&
           exception != MODBUS_EXCEPTION_GATEWAY_TARGET;
  }
};
using LinkResult = std::expected<void, LinkFailure>;

inline constexpr std::size_t kMaxPdu = 253;

struct Pdu {
  std::array<std::uint8_t, kMaxPdu> bytes{};
  std::size_t size = 0;
  [[nodiscard]] std::span<const std::uint8_t> view() const noexcept { return std::span(bytes).first(size); }
};

/// The kind of response to a request that is not refused. Two of different shapes are never mistaken for each
/// other.
struct ResponseShape {
  std::uint8_t function = 0;
  std::size_t size = 0;
  [[nodiscard]] bool operator==(const ResponseShape&) const = default;
};
[[nodiscard]] ResponseShape read_shape(const RegisterMap& map) noexcept;
[[nodiscard]] ResponseShape write_shape(const RegisterMap& map) noexcept;

/// Asks for all of the map, which is a [[device.read]].
[[nodiscard]] Pdu read_request(const RegisterMap& map) noexcept;
/// All of the map, which is a [[device.write]], is written by one request. False: each of its registers or
/// coils needs one.
[[nodiscard]] bool is_one_write(const RegisterMap& map) noexcept;
/// Writes all of the map, for which is_one_write() holds. One register or coil has a function of its own:
/// many devices have only that one, others only those for several.
[[nodiscard]] Pdu write_request(const RegisterMap& map, MapValues& values) noexcept;

/// The response to a read_request() of that map. The values change if all of it is good.
[[nodiscard]] LinkResult take_values(const RegisterMap& map, std::span<const std::uint8_t> response,
                                     MapValues& values);
/// Whether the response confirms what was written: address, and count or value.
[[nodiscard]] LinkResult check_written(const Pdu& request, std::span<const std::uint8_t> response);

}  // namespace plchost::modbus
