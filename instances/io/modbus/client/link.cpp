#include "instances/io/modbus/client/link.hpp"

#include <array>
#include <cerrno>
#include <chrono>
#include <utility>

#include <fmt/format.h>
#include <sys/select.h>
#include <sys/socket.h>

#include "instances/io/modbus/client/tcp_connect.hpp"
#include "instances/io/modbus/config/endpoint.hpp"

namespace plchost::modbus {

namespace {

constexpr int kDataBits = 8;  // of RTU
constexpr std::array kParityLetters = {'N', 'E', 'O'};

modbus_t* context_of(const DeviceConfig& device) {
  // The connection of TCP is made here, so that it ends with the stop: the address is never used.
  if (device.serial.empty()) return modbus_new_tcp("127.0.0.1", kModbusPort);
  return modbus_new_rtu(device.serial.c_str(), device.baud, kParityLetters[std::to_underlying(device.parity)],
                        kDataBits, device.stop_bits);
}

std::uint16_t exception_of(int error) noexcept {
  const int code = error - MODBUS_ENOBASE;
  return code >= MODBUS_EXCEPTION_ILLEGAL_FUNCTION && code <= MODBUS_EXCEPTION_GATEWAY_TARGET
             ? static_cast<std::uint16_t>(code)
             : std::uint16_t{0};
}

LinkResult failed(std::string text) {
  return std::unexpected(LinkFailure{.exception = 0, .text = std::move(text)});
}

}  // namespace

Result<std::unique_ptr<Link>> Link::make(const DeviceConfig& device, const StopEvent& stop) {
  modbus_t* const context = context_of(device);
  if (context == nullptr) {
    return failure(ErrorCode::system, fmt::format("libmodbus refuses device '{}'", device.name), errno);
  }
  std::unique_ptr<Link> link(new Link(context, stop));
  // The response timeout is then that of the whole response: a device that sends single bytes with pauses has
  // no more time.
  modbus_set_byte_timeout(context, 0, 0);
  return link;
}

Link::~Link() {
  close();
}

void Link::keep_descriptor(int fd) noexcept {
  const std::lock_guard lock(descriptor_);
  fd_ = fd;
}

void Link::interrupt() noexcept {
  const std::lock_guard lock(descriptor_);
  if (fd_ >= 0) ::shutdown(fd_, SHUT_RDWR);
}

void Link::close() noexcept {
  keep_descriptor(-1);
  if (std::exchange(is_open_, false)) modbus_close(context_.get());
}

LinkResult Link::open(const DeviceConfig& device, Limits limits) {
  if (is_open_) return {};
  if (stop_.is_set() && !limits.at_end) return failed("this process ends");
  auto opened = device.serial.empty() ? open_tcp(device, limits) : open_serial(device);
  is_open_ = opened.has_value();
  return opened;
}

LinkResult Link::open_tcp(const DeviceConfig& device, Limits limits) {
  const auto endpoint = parse_endpoint(device.tcp);
  if (!endpoint) return failed(endpoint.error());
  auto fd = tcp_connect(*endpoint, MonotonicClock::now() + limits.timeout, limits.at_end ? nullptr : &stop_);
  if (!fd) return failed(fd.error().describe());
  keep_descriptor(fd->get());
  modbus_set_socket(context_.get(), fd->release());
  return {};
}

LinkResult Link::open_serial(const DeviceConfig& device) {
  if (modbus_connect(context_.get()) != 0) {
    return failed(fmt::format("{}: {}", device.serial, modbus_strerror(errno)));
  }
  if (modbus_get_socket(context_.get()) < FD_SETSIZE) return {};
  modbus_close(context_.get());
  return failed("too many open files for libmodbus");
}

template <class Call>
LinkResult Link::request(const DeviceConfig& device, Limits limits, const Call& call) {
  const std::lock_guard lock(turn_);
  if (auto opened = open(device, limits); !opened) return opened;
  modbus_t* const context = context_.get();
  modbus_set_slave(context, device.unit);
  const auto us = std::chrono::duration_cast<std::chrono::microseconds>(limits.timeout).count();
  constexpr std::int64_t kSecond = 1'000'000;
  modbus_set_response_timeout(context, static_cast<std::uint32_t>(us / kSecond),
                              static_cast<std::uint32_t>(us % kSecond));
  if (!device.serial.empty()) modbus_flush(context);  // a late response of somebody else
  if (call(context) >= 0) return {};
  const int error = errno;
  if (const std::uint16_t exception = exception_of(error); exception != 0) {
    return std::unexpected(LinkFailure{.exception = exception, .text = modbus_strerror(error)});
  }
  // A serial line stays open for its other devices while they can use it.
  const bool line_is_fine = error == ETIMEDOUT || error > MODBUS_ENOBASE;
  if (device.serial.empty() || !line_is_fine) close();
  return failed(modbus_strerror(error));
}

LinkResult Link::read(const DeviceConfig& device, const RegisterMap& map, MapValues& values) {
  const int count = static_cast<int>(map.count);
  return request(device, {.timeout = device.timeout}, [&](modbus_t* context) {
    switch (map.kind) {
      case RegisterKind::coil:
        return modbus_read_bits(context, map.address, count, values.bits(map.count).data());
      case RegisterKind::discrete_input:
        return modbus_read_input_bits(context, map.address, count, values.bits(map.count).data());
      case RegisterKind::holding_register:
        return modbus_read_registers(context, map.address, count, values.registers(map.count).data());
      case RegisterKind::input_register:
        break;
    }
    return modbus_read_input_registers(context, map.address, count, values.registers(map.count).data());
  });
}

LinkResult Link::write(const DeviceConfig& device, const RegisterMap& map, MapValues& values) {
  return write(device, map, values, {.timeout = device.timeout});
}

LinkResult Link::write_at_end(const DeviceConfig& device, const RegisterMap& map, MapValues& values,
                              Duration timeout) {
  return write(device, map, values, {.timeout = timeout, .at_end = true});
}

// Many devices have only the functions for one register, others only those for several.
LinkResult Link::write(const DeviceConfig& device, const RegisterMap& map, MapValues& values, Limits limits) {
  const int count = static_cast<int>(map.count);
  return request(device, limits, [&](modbus_t* context) {
    if (is_bit(map.kind)) {
      const auto bits = values.bits(map.count);
      return count == 1 ? modbus_write_bit(context, map.address, bits[0])
                        : modbus_write_bits(context, map.address, count, bits.data());
    }
    const auto registers = values.registers(map.count);
    return count == 1 ? modbus_write_register(context, map.address, registers[0])
                      : modbus_write_registers(context, map.address, count, registers.data());
  });
}

}  // namespace plchost::modbus
