#pragma once

#include <cstdint>
#include <expected>
#include <span>
#include <string>

#include "instances/io/modbus/client/pdu.hpp"
#include "shm/base/time.hpp"

namespace plchost::modbus {

struct ExchangeFailure {
  bool at_rest = false;  ///< the connection had ended before the response began
  std::string text;
};

/// Sends a request on a connection that was made, and waits for its whole response. After a failure the
/// connection is of no use any more. On TCP libmodbus compares neither unit nor length of a response: the
/// mistake of a gateway that mixes up its devices would not be seen.
[[nodiscard]] std::expected<Pdu, ExchangeFailure> exchange_tcp(int fd, std::uint16_t number,
                                                               std::uint8_t unit, const Pdu& request,
                                                               TimePoint deadline);

/// The device has not ended the connection since the last response, and has sent nothing more.
[[nodiscard]] bool is_usable(int fd) noexcept;

}  // namespace plchost::modbus
