#pragma once

#include <cstdint>
#include <expected>
#include <string>
#include <string_view>

#include <sys/socket.h>

namespace plchost::modbus {

/// A numeric address and a port. Names are refused: looking one up could block for seconds.
struct Endpoint {
  sockaddr_storage address{};
  socklen_t size = 0;
  [[nodiscard]] int family() const noexcept { return address.ss_family; }
  [[nodiscard]] bool is_loopback() const noexcept;
  /// One text for each address, however it is written: "192.168.1.10:502", "[fd00::10]:502".
  [[nodiscard]] std::string text() const;
};

inline constexpr std::string_view kEndpointForm =
    "a numeric address and a port, like \"192.168.1.10:502\" or \"[fd00::10]:502\"";
inline constexpr std::uint16_t kModbusPort = 502;

/// Without a port it is 502. The error is the fault, in words.
[[nodiscard]] std::expected<Endpoint, std::string> parse_endpoint(std::string_view text);

}  // namespace plchost::modbus
