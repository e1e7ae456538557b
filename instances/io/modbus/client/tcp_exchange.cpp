#include "instances/io/modbus/client/tcp_exchange.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstddef>
#include <cstring>
#include <utility>

#include <fmt/format.h>
#include <poll.h>
#include <sys/socket.h>

#include "instances/io/modbus/threads/stop_event.hpp"

namespace plchost::modbus {

namespace {

constexpr std::size_t kTcpHeader = 7;  // with the unit, which is part of the length
constexpr std::size_t kLeastTcpLength = 2;

std::unexpected<ExchangeFailure> failed(std::string text) {
  return std::unexpected(ExchangeFailure{.at_rest = false, .text = std::move(text)});
}

// Fills up `bytes`.
std::expected<void, ExchangeFailure> receive(int fd, std::span<std::uint8_t> bytes, TimePoint deadline) {
  while (!bytes.empty()) {
    if (!wait_for(fd, POLLIN, deadline, nullptr)) return failed("the response timed out");
    const ssize_t got = ::recv(fd, bytes.data(), bytes.size(), MSG_DONTWAIT);
    if (got < 0 && (errno == EAGAIN || errno == EINTR)) continue;
    if (got < 0) return failed(std::strerror(errno));
    if (got == 0) return failed("the device has ended the connection");
    bytes = bytes.subspan(static_cast<std::size_t>(got));
  }
  return {};
}

std::array<std::uint8_t, kTcpHeader> header_of(std::uint16_t number, std::uint8_t unit, std::size_t size) {
  const std::size_t length = size + 1;  // with the unit
  return {static_cast<std::uint8_t>(number >> 8U), static_cast<std::uint8_t>(number), 0,   0,
          static_cast<std::uint8_t>(length >> 8U), static_cast<std::uint8_t>(length), unit};
}

unsigned number_in(std::span<const std::uint8_t> header) {
  return static_cast<unsigned>(header[0]) << 8U | header[1];
}

// The bytes behind the header.
std::expected<std::size_t, ExchangeFailure> size_in(std::span<const std::uint8_t> header) {
  const std::size_t length = static_cast<std::size_t>(header[4]) << 8U | header[5];
  const bool is_modbus =
      header[2] == 0 && header[3] == 0 && length >= kLeastTcpLength && length <= kMaxPdu + 1;
  if (!is_modbus) return failed("the response is no Modbus");
  return length - 1;
}

}  // namespace

std::expected<Pdu, ExchangeFailure> exchange_tcp(int fd, std::uint16_t number, std::uint8_t unit,
                                                 const Pdu& request, TimePoint deadline) {
  std::array<std::uint8_t, kTcpHeader + kMaxPdu> frame{};
  std::ranges::copy(header_of(number, unit, request.size), frame.begin());
  std::ranges::copy(request.view(), frame.begin() + kTcpHeader);
  const std::size_t size = kTcpHeader + request.size;
  // The buffer of a connection without an open request has room for one.
  if (::send(fd, frame.data(), size, MSG_NOSIGNAL | MSG_DONTWAIT) != static_cast<ssize_t>(size))
    return std::unexpected(ExchangeFailure{.at_rest = true, .text = std::strerror(errno)});

  // A response to another request is late, or comes twice. The one to this request may follow.
  const auto header = std::span(frame).first(kTcpHeader);
  while (true) {
    if (auto got = receive(fd, header.first(1), deadline); !got) {
      got.error().at_rest = MonotonicClock::now() < deadline;
      return std::unexpected(std::move(got).error());
    }
    if (auto got = receive(fd, header.subspan(1), deadline); !got)
      return std::unexpected(std::move(got).error());
    const auto rest = size_in(header);
    if (!rest) return std::unexpected(rest.error());
    Pdu response;
    response.size = *rest;
    if (auto got = receive(fd, std::span(response.bytes).first(*rest), deadline); !got)
      return std::unexpected(std::move(got).error());
    if (number_in(header) != number) {
      if (MonotonicClock::now() >= deadline) return failed("the responses are of other requests");
      continue;
    }
    if (header[6] != unit)
      return failed(fmt::format("the response is of unit {}, not of {}", header[6], unit));
    return response;
  }
}

bool is_usable(int fd) noexcept {
  std::uint8_t byte = 0;
  return ::recv(fd, &byte, 1, MSG_PEEK | MSG_DONTWAIT) < 0 && (errno == EAGAIN || errno == EINTR);
}

}  // namespace plchost::modbus
