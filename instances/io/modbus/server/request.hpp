#pragma once

#include <cstddef>
#include <cstdint>
#include <expected>
#include <span>

#include "instances/io/modbus/config/map_values.hpp"
#include "instances/io/modbus/config/modbus_config.hpp"

// The requests of a Modbus client, read without trust. Only those that pass here are answered by libmodbus:
// its own answer to a request of a wrong length or function sleeps for half a second.

namespace plchost::modbus {

inline constexpr std::size_t kHeaderBytes = 7;  ///< of Modbus TCP, with the unit
inline constexpr std::size_t kMaxFrame = 260;

enum class FrameState : std::uint8_t { incomplete, whole, garbage };

/// The first frame of the bytes that were received. Pure.
struct Frame {
  FrameState state = FrameState::incomplete;
  std::size_t size = 0;  ///< of a whole one
};
[[nodiscard]] Frame first_frame(std::span<const std::uint8_t> received) noexcept;

struct Request {
  RegisterKind kind = RegisterKind::coil;
  bool writes = false;
  std::uint16_t address = 0;
  std::uint16_t count = 0;
};

/// The request of a whole frame, or the number of the exception that answers it. Pure.
[[nodiscard]] std::expected<Request, std::uint8_t> parse_request(
    std::span<const std::uint8_t> frame) noexcept;
/// The values that the request of that frame writes. Pure.
void take_written(std::span<const std::uint8_t> frame, const Request& request, MapValues& values) noexcept;

}  // namespace plchost::modbus
