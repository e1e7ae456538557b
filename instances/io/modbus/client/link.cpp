#include "instances/io/modbus/client/link.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <utility>

#include <fmt/format.h>
#include <poll.h>
#include <sys/select.h>
#include <sys/socket.h>
#include <unistd.h>

#include "instances/io/modbus/client/device_claim.hpp"
#include "instances/io/modbus/client/tcp_connect.hpp"
#include "instances/io/modbus/client/tcp_exchange.hpp"
#include "instances/io/modbus/config/endpoint.hpp"

namespace plchost::modbus {

namespace {

using Failure = std::unexpected<std::string>;

LinkFailure not_asked() {
  return {.text = "this process ends", .not_asked = true};
}

std::unexpected<LinkFailure> without_answer(std::string text) {
  return std::unexpected(LinkFailure{.text = std::move(text)});
}

constexpr int kDataBits = 8;  // of RTU
// A device that answers does so within that time. At the end one that does not must not keep the line.
constexpr std::chrono::milliseconds kGraceAtEnd{300};
constexpr int kAround = 3;  // unit and checksum, which libmodbus compares
constexpr std::int64_t kCharacterBits = 11;
constexpr std::array kParityLetters = {'N', 'E', 'O'};

Duration time_of(std::int64_t half_characters, int baud) {
  return std::chrono::nanoseconds(std::chrono::seconds(half_characters * kCharacterBits)) / (2 * baud);
}

// Frames on a line are told apart by a silence of 3.5 characters, which is not below 1.75 ms.
Duration silence_of(int baud) {
  constexpr std::int64_t kHalfCharacters = 7;
  constexpr std::chrono::microseconds kLeast{1750};
  return std::max<Duration>(time_of(kHalfCharacters, baud), kLeast);
}

}  // namespace

Result<std::unique_ptr<Link>> Link::make(const DeviceConfig& device, const StopEvent& stop) {
  if (device.serial.empty()) return std::unique_ptr<Link>(new Link(nullptr, stop));
  modbus_t* const line =
      modbus_new_rtu(device.serial.c_str(), device.baud, kParityLetters[std::to_underlying(device.parity)],
                     kDataBits, device.stop_bits);
  if (line == nullptr) {
    return failure(ErrorCode::system, fmt::format("libmodbus refuses device '{}'", device.name), errno);
  }
  // The response timeout is then that of the whole response: a device that sends single bytes with pauses has
  // no more time.
  modbus_set_byte_timeout(line, 0, 0);
  return std::unique_ptr<Link>(new Link(line, stop));
}

Link::~Link() {
  close_line();
}

void Link::close_line() noexcept {
  if (std::exchange(line_is_open_, false)) modbus_close(line_.get());
  claim_.reset();
}

void Link::keep(UniqueFd connection) noexcept {
  const std::lock_guard lock(descriptor_);
  tcp_ = std::move(connection);
}

void Link::interrupt() noexcept {
  const std::lock_guard lock(descriptor_);
  if (tcp_ && !is_end_) ::shutdown(tcp_.get(), SHUT_RDWR);
}

std::expected<void, std::string> Link::open_tcp(const DeviceConfig& device, Limits limits) {
  // Many devices end a connection that rests. That is no failure: the next one is made at once.
  if (tcp_ && is_usable(tcp_.get())) return {};
  keep(UniqueFd());
  if (stop_.is_set() && !limits.at_end) return Failure("this process ends");
  const auto endpoint = parse_endpoint(device.tcp);
  if (!endpoint) return Failure(endpoint.error());
  auto fd = tcp_connect(*endpoint, MonotonicClock::now() + limits.timeout, limits.at_end ? nullptr : &stop_);
  if (!fd) return Failure(fd.error().describe());
  keep(std::move(*fd));
  ++connection_;
  return {};
}

std::expected<Pdu, LinkFailure> Link::ask_tcp(const DeviceConfig& device, Limits limits, const Pdu& asked) {
  // A device may end a connection at rest while it is asked. Then it is asked once more: a request that is
  // carried out twice does no more.
  for (bool again = tcp_ && !limits.once;; again = false) {
    if (auto opened = open_tcp(device, limits); !opened) return without_answer(std::move(opened).error());
    auto answer =
        exchange_tcp(tcp_.get(), ++number_, device.unit, asked, MonotonicClock::now() + limits.timeout);
    if (answer) return *answer;
    keep(UniqueFd());
    ExchangeFailure& failed = answer.error();
    if (!again || !failed.at_rest)
      return std::unexpected(LinkFailure{.text = std::move(failed.text), .at_rest = failed.at_rest});
  }
}

Result<void> Link::claim(const DeviceConfig& device) {
  if (!line_ || claim_) return {};
  auto claim = claim_line(device.serial);
  if (claim) {
    claim_ = std::move(*claim);
  } else if (claim.error().code == ErrorCode::busy) {
    return std::unexpected(std::move(claim).error());
  }
  return {};  // a line that is not there is tried again with each poll
}

// The claim comes first: to open the line means to set its baud rate.
std::expected<void, std::string> Link::open_line(const DeviceConfig& device) {
  if (line_is_open_) return {};
  if (!claim_) {
    auto claimed = claim_line(device.serial);
    if (!claimed) return Failure(claimed.error().describe());
    claim_ = std::move(*claimed);
  }
  if (modbus_connect(line_.get()) != 0) {
    const int error = errno;
    claim_.reset();
    return Failure(fmt::format("{}: {}", device.serial, modbus_strerror(error)));
  }
  line_is_open_ = true;
  if (modbus_get_socket(line_.get()) < FD_SETSIZE) {
    ++connection_;
    return {};
  }
  close_line();
  return Failure("too many open files for libmodbus");
}

// libmodbus waits for a whole response, and nothing interrupts it. So it does from the first byte on only.
bool Link::await_line(TimePoint deadline, Limits limits) {
  const int fd = modbus_get_socket(line_.get());
  const StopEvent* const stop = limits.at_end ? nullptr : &stop_;
  if (!wait_for(fd, POLLIN, deadline, stop)) {
    if (stop != nullptr && stop->is_set()) deadline = std::min(deadline, MonotonicClock::now() + kGraceAtEnd);
    if (!wait_for(fd, POLLIN, deadline, nullptr)) {
      errno = ETIMEDOUT;
      return false;
    }
  }
  constexpr std::chrono::microseconds kLeast{1000};
  constexpr std::int64_t kSecond = 1'000'000;
  const auto left = std::chrono::duration_cast<std::chrono::microseconds>(deadline - MonotonicClock::now());
  const auto us = std::max(left, kLeast).count();
  modbus_set_response_timeout(line_.get(), static_cast<std::uint32_t>(us / kSecond),
                              static_cast<std::uint32_t>(us % kSecond));
  return true;
}

// Bytes that come meanwhile are a late response, or noise: the silence begins behind them.
void Link::await_silence(const DeviceConfig& device) {
  const int fd = modbus_get_socket(line_.get());
  const TimePoint give_up = MonotonicClock::now() + device.timeout;
  std::array<std::uint8_t, MODBUS_RTU_MAX_ADU_LENGTH> ignored{};
  while (MonotonicClock::now() < give_up &&
         wait_for(fd, POLLIN, last_byte_ + silence_of(device.baud), nullptr) &&
         ::read(fd, ignored.data(), ignored.size()) > 0) {
    last_byte_ = MonotonicClock::now();
  }
}

std::expected<Pdu, LinkFailure> Link::ask_line(const DeviceConfig& device, Limits limits, const Pdu& asked) {
  if (auto opened = open_line(device); !opened)
    return std::unexpected(LinkFailure{.text = std::move(opened).error(), .not_sent = true});
  modbus_t* const line = line_.get();
  modbus_set_slave(line, device.unit);
  await_silence(device);
  std::array<std::uint8_t, kMaxPdu + 1> raw{};
  raw[0] = device.unit;
  std::ranges::copy(asked.view(), raw.begin() + 1);
  const bool sent = modbus_send_raw_request(line, raw.data(), static_cast<int>(asked.size) + 1) > 0;
  const int error = errno;
  const auto bytes = static_cast<std::int64_t>(asked.size) + kAround;
  last_byte_ = MonotonicClock::now() + time_of(2 * bytes, device.baud);  // the kernel still sends it
  auto response =
      sent ? receive_line(device, last_byte_ + limits.timeout, limits) : line_failure(error, false);
  const TimePoint now = MonotonicClock::now();
  last_byte_ = response ? now : std::max(last_byte_, now);
  return response;
}

// The line stays open for its other devices while they can use it.
std::unexpected<LinkFailure> Link::line_failure(int error, bool has_begun) {
  const bool is_garbled = error > MODBUS_ENOBASE || (error == ETIMEDOUT && has_begun);
  if (error != ETIMEDOUT && !is_garbled) close_line();
  const bool timed_out = error == ETIMEDOUT && !has_begun;
  return std::unexpected(
      LinkFailure{.text = modbus_strerror(error), .timed_out = timed_out, .is_garbled = is_garbled});
}

// A late response of another unit is none of this one, which may still answer.
std::expected<Pdu, LinkFailure> Link::receive_line(const DeviceConfig& device, TimePoint deadline,
                                                   Limits limits) {
  std::array<std::uint8_t, MODBUS_RTU_MAX_ADU_LENGTH> received{};
  bool is_of_another = false;
  while (await_line(deadline, limits)) {
    const int size = modbus_receive_confirmation(line_.get(), received.data());
    if (size < 0) return line_failure(errno, true);
    if (size > kAround && received[0] == device.unit) {
      Pdu response;
      response.size = static_cast<std::size_t>(size - kAround);
      std::copy_n(received.begin() + 1, response.size, response.bytes.begin());
      return response;
    }
    is_of_another = true;
    if (MonotonicClock::now() >= deadline) break;
  }
  if (!is_of_another) return line_failure(ETIMEDOUT, false);
  return std::unexpected(
      LinkFailure{.text = fmt::format("the response is not of unit {}", device.unit), .is_garbled = true});
}

LinkResult Link::request(const DeviceConfig& device, Limits limits, const Pdu& asked, const Take& take) {
  const Turn turn = take_turn();
  if (stop_.is_set() && !limits.at_end) return std::unexpected(not_asked());
  if (limits.at_end) {
    const std::lock_guard lock(descriptor_);
    is_end_ = true;
  }
  const auto response = line_ ? ask_line(device, limits, asked) : ask_tcp(device, limits, asked);
  if (response && limits.at_end) answered_at_end_ = MonotonicClock::now();
  auto result = response ? take(response->view()) : LinkResult(std::unexpected(response.error()));
  if (!result && result.error().exception == 0) keep(UniqueFd());
  return result;
}

LinkResult Link::open(const DeviceConfig& device) {
  const Turn turn = take_turn();
  if (stop_.is_set()) return std::unexpected(not_asked());
  auto opened = line_ ? open_line(device) : open_tcp(device, {.timeout = device.timeout});
  if (!opened) return std::unexpected(LinkFailure{.text = std::move(opened).error(), .not_sent = true});
  return {};
}

LinkResult Link::read(const DeviceConfig& device, const RegisterMap& map, MapValues& values) {
  return request(device, {.timeout = device.timeout}, read_request(map),
                 [&](std::span<const std::uint8_t> response) { return take_values(map, response, values); });
}

LinkResult Link::write(const DeviceConfig& device, const RegisterMap& map, MapValues& values,
                       const Look& look) {
  return write(device, map, values, {.timeout = device.timeout, .once = true}, look);
}

LinkResult Link::write_at_end(const DeviceConfig& device, const RegisterMap& map, MapValues& values,
                              Duration timeout) {
  return write(device, map, values, {.timeout = timeout, .at_end = true}, {});
}

// A map of many requests takes seconds at a slow device: each one has the value of its own time.
LinkResult Link::write(const DeviceConfig& device, const RegisterMap& map, MapValues& values, Limits limits,
                       const Look& look) {
  if (is_one_write(map)) return write_once(device, map, values, limits);
  RegisterMap one = map;
  one.count = 1;
  MapValues now = values;
  for (std::uint32_t i = 0; i < map.count; ++i) {
    if (i != 0 && look && !look(now)) return {};
    MapValues value;
    if (is_bit(map.kind)) {
      value.bits(1)[0] = values.bits(map.count)[i] = now.bits(map.count)[i];
    } else {
      value.registers(1)[0] = values.registers(map.count)[i] = now.registers(map.count)[i];
    }
    if (auto written = write_once(device, one, value, limits); !written) return written;
    ++one.address;
  }
  return {};
}

LinkResult Link::write_once(const DeviceConfig& device, const RegisterMap& map, MapValues& values,
                            Limits limits) {
  const Pdu asked = write_request(map, values);
  return request(device, limits, asked,
                 [&](std::span<const std::uint8_t> response) { return check_written(asked, response); });
}

}  // namespace plchost::modbus
