#include "instances/io/modbus/config/endpoint.hpp"

#include <array>
#include <charconv>
#include <cstddef>
#include <cstring>
#include <optional>
#include <system_error>

#include <arpa/inet.h>
#include <fmt/format.h>
#include <netinet/in.h>

#include "shm/base/names.hpp"

namespace plchost::modbus {

namespace {

std::optional<std::uint16_t> port_in(std::string_view text) {
  std::uint16_t port = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), port);
  const bool whole = error == std::errc() && end == text.data() + text.size();
  return whole && port > 0 ? std::optional(port) : std::nullopt;
}

template <class Address>
Endpoint endpoint_of(const Address& address) {
  Endpoint endpoint;
  std::memcpy(&endpoint.address, &address, sizeof address);
  endpoint.size = sizeof address;
  return endpoint;
}

template <class Address>
Address address_of(const Endpoint& endpoint) {
  Address address{};
  std::memcpy(&address, &endpoint.address, sizeof address);
  return address;
}

}  // namespace

bool Endpoint::is_loopback() const noexcept {
  if (family() == AF_INET6) {
    const auto six = address_of<sockaddr_in6>(*this);
    return IN6_IS_ADDR_LOOPBACK(&six.sin6_addr);
  }
  constexpr std::uint32_t kLoopbackNet = 127;
  return ntohl(address_of<sockaddr_in>(*this).sin_addr.s_addr) >> 24U == kLoopbackNet;
}

std::string Endpoint::text() const {
  std::array<char, INET6_ADDRSTRLEN> host{};
  if (family() == AF_INET) {
    const auto four = address_of<sockaddr_in>(*this);
    (void)::inet_ntop(AF_INET, &four.sin_addr, host.data(), host.size());
    return fmt::format("{}:{}", host.data(), ntohs(four.sin_port));
  }
  const auto six = address_of<sockaddr_in6>(*this);
  if (IN6_IS_ADDR_V4MAPPED(&six.sin6_addr)) {
    constexpr std::size_t kBefore = 12;
    (void)::inet_ntop(AF_INET, &six.sin6_addr.s6_addr[kBefore], host.data(), host.size());
    return fmt::format("{}:{}", host.data(), ntohs(six.sin6_port));
  }
  (void)::inet_ntop(AF_INET6, &six.sin6_addr, host.data(), host.size());
  return fmt::format("[{}]:{}", host.data(), ntohs(six.sin6_port));
}

std::expected<Endpoint, std::string> parse_endpoint(std::string_view text) {
  const auto wrong = [&] {
    return std::unexpected(fmt::format("\"{}\" is no address; allowed is {}", shown(text), kEndpointForm));
  };
  std::string_view host = text;
  std::string_view port;
  if (text.starts_with('[')) {
    const std::size_t end = text.find(']');
    if (end == std::string_view::npos) return wrong();
    host = text.substr(1, end - 1);
    port = text.substr(end + 1);
    if (!port.empty() && !port.starts_with(':')) return wrong();
  } else if (const std::size_t colon = text.find(':'); colon != std::string_view::npos) {
    host = text.substr(0, colon);
    port = text.substr(colon);
  }
  const auto number = port.empty() ? std::optional(kModbusPort) : port_in(port.substr(1));
  if (!number) return wrong();
  const std::string name(host);
  sockaddr_in four{.sin_family = AF_INET, .sin_port = htons(*number), .sin_addr = {}, .sin_zero = {}};
  if (!text.starts_with('[') && ::inet_pton(AF_INET, name.c_str(), &four.sin_addr) == 1) {
    return endpoint_of(four);
  }
  sockaddr_in6 six{};
  six.sin6_family = AF_INET6;
  six.sin6_port = htons(*number);
  if (text.starts_with('[') && ::inet_pton(AF_INET6, name.c_str(), &six.sin6_addr) == 1)
    return endpoint_of(six);
  return wrong();
}

}  // namespace plchost::modbus
