// The way of a response to the client: any bytes are what a device sends, over a real socket. The first byte
// chooses the request. The others come as they are, and once more behind a header that belongs to it.

#include <algorithm>
#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <span>
#include <vector>

#include <sys/socket.h>
#include <unistd.h>

#include "instances/io/modbus/client/pdu.hpp"
#include "instances/io/modbus/client/tcp_exchange.hpp"

namespace {

using namespace plchost::modbus;

constexpr std::uint16_t kNumber = 0x1234;
constexpr std::uint8_t kUnit = 5;
constexpr std::size_t kHeader = 7;
constexpr std::uint8_t kUntouched = 0xa5;

RegisterMap map_of(std::uint8_t choice) {
  constexpr std::array<std::uint32_t, 4> kCounts{1, 2, 9, 123};
  RegisterMap map;
  map.kind = static_cast<RegisterKind>(choice & 3U);
  map.address = 0x0107;
  map.count = kCounts.at(choice >> 2U & 3U);
  return map;
}

// Nothing of a response that is refused is taken, and nothing behind the values in any case.
void take(const RegisterMap& map, std::span<const std::uint8_t> response) {
  MapValues values;
  std::ranges::fill(values.bits(kMaxReadBits), kUntouched);
  std::ranges::fill(values.registers(kMaxReadRegisters), kUntouched);
  MapValues before = values;
  const auto taken = take_values(map, response, values);
  const std::size_t bits = taken && is_bit(map.kind) ? map.count : 0;
  const std::size_t registers = taken && !is_bit(map.kind) ? map.count : 0;
  const auto are_same = [](auto one, auto other, std::size_t from) {
    return std::ranges::equal(one.subspan(from), other.subspan(from));
  };
  if (!are_same(values.bits(kMaxReadBits), before.bits(kMaxReadBits), bits)) std::abort();
  if (!are_same(values.registers(kMaxReadRegisters), before.registers(kMaxReadRegisters), registers))
    std::abort();
  if (taken && read_shape(map) != ResponseShape{.function = response[0], .size = response.size()})
    std::abort();
  if (!taken && taken.error().text.empty()) std::abort();
}

// From the first frame on that has the number of the request. The ones of others are passed over.
std::span<const std::uint8_t> from_answer(std::span<const std::uint8_t> sent) {
  constexpr std::size_t kUncounted = 6;
  while (sent.size() >= kHeader && (sent[0] != kNumber >> 8U || sent[1] != (kNumber & 0xffU))) {
    const std::size_t length = kUncounted + (static_cast<std::size_t>(sent[4]) << 8U | sent[5]);
    sent = sent.subspan(std::min(length, sent.size()));
  }
  return sent;
}

// The device has ended the connection behind its bytes.
void exchange(const Pdu& request, std::span<const std::uint8_t> sent) {
  std::array<int, 2> sockets{};
  if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, sockets.data()) != 0) std::abort();
  if (::send(sockets[1], sent.data(), sent.size(), 0) != static_cast<ssize_t>(sent.size())) std::abort();
  (void)::shutdown(sockets[1], SHUT_WR);
  const auto deadline = plchost::MonotonicClock::now() + std::chrono::seconds(10);
  const auto response = exchange_tcp(sockets[0], kNumber, kUnit, request, deadline);
  std::array<std::uint8_t, 300> asked{};
  const ssize_t size = ::recv(sockets[1], asked.data(), asked.size(), MSG_DONTWAIT);
  if (size != static_cast<ssize_t>(kHeader + request.size)) std::abort();
  if (response) {
    const auto frame = from_answer(sent);
    if (frame.size() < kHeader) std::abort();
    const auto behind = frame.subspan(kHeader);
    if (response->size == 0 || response->size > kMaxPdu || response->size > behind.size()) std::abort();
    if (!std::ranges::equal(response->view(), behind.first(response->size))) std::abort();
    if (frame[2] != 0 || frame[3] != 0 || frame[6] != kUnit) std::abort();
  } else if (response.error().text.empty()) {
    std::abort();
  }
  ::close(sockets[0]);
  ::close(sockets[1]);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  constexpr std::size_t kMost = 4096;
  if (size == 0 || size > kMost) return 0;
  const RegisterMap map = map_of(data[0]);
  const std::vector<std::uint8_t> bytes(data + 1, data + size);  // alone, so that a sanitizer sees their end
  take(map, bytes);
  MapValues zeros;
  const Pdu written = is_writable(map.kind) ? write_request(map, zeros) : Pdu();
  if (written.size != 0) (void)check_written(written, bytes);
  exchange(written.size != 0 ? written : read_request(map), bytes);
  // The first two say the length, and so many follow, if a response may be nearly as long.
  if (bytes.size() < 2) return 0;
  constexpr std::size_t kLong = 300;
  const std::size_t length = static_cast<std::size_t>(bytes[0]) << 8U | bytes[1];
  std::vector<std::uint8_t> framed{kNumber >> 8U, kNumber & 0xffU, 0, 0, bytes[0], bytes[1], kUnit};
  // And one of another request, protocol or unit.
  constexpr std::array<std::size_t, 4> kPlaces{1, 2, 3, 6};
  if (const unsigned other = data[0] >> 4U; other >= 12) ++framed[kPlaces.at(other & 3U)];
  framed.insert(framed.end(), bytes.begin() + 2, bytes.end());
  if (length <= kLong) framed.resize(std::max(framed.size(), kHeader + length));
  exchange(read_request(map), framed);
  return 0;
}
