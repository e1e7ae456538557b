// The way of a request through the server: any bytes are cut into frames, and each frame is answered by
// libmodbus at a real socket, from and to real images.

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <modbus/modbus.h>
#include <sys/socket.h>

#include "instances/io/modbus/images/image_table.hpp"
#include "instances/io/modbus/server/request.hpp"
#include "instances/io/modbus/server/served_maps.hpp"
#include "shm/files/pool_files.hpp"
#include "tests/support/own_name.hpp"

namespace {

using namespace plchost::modbus;

constexpr std::uint32_t kSize = 64;
constexpr std::uint8_t kReadOnly = 0xa5;  // of the bytes that nobody may write

ServerConfig config() {
  ServerConfig server;
  server.silent_after = plchost::Duration::zero();
  const auto map = [&](RegisterKind kind, std::uint16_t address, std::uint32_t count, const char* image,
                       std::uint32_t offset, bool writable) {
    RegisterMap entry;
    entry.kind = kind;
    entry.address = address;
    entry.count = count;
    entry.image = image;
    entry.offset = offset;
    entry.bit = is_bit(kind) ? 3 : 0;
    entry.order = is_bit(kind) ? RegisterOrder::single : RegisterOrder::abcd;
    entry.writable = writable;
    server.maps.push_back(entry);
  };
  map(RegisterKind::coil, 0, 50, "in", 0, true);
  map(RegisterKind::coil, 50, 50, "in", 32, false);
  map(RegisterKind::holding_register, 0, 8, "in", 16, true);
  map(RegisterKind::holding_register, 8, 8, "in", 48, false);
  map(RegisterKind::input_register, 65534, 2, "out", 60, false);
  map(RegisterKind::discrete_input, 0, 400, "out", 0, false);
  return server;
}

struct Server {
  Server() {
    auto opened = ImageTable::open(
        pool, {{.name = "in", .direction = ImageDirection::input, .size = kSize, .line = 0},
               {.name = "out", .direction = ImageDirection::output, .size = kSize, .line = 0}});
    if (!opened) std::abort();
    images = std::move(*opened);
    if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0, sockets.data()) != 0)
      std::abort();
    modbus_set_socket(context, sockets[0]);
  }
  ~Server() { plchost::remove_pool_memories(pool); }
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;

  std::string pool = plchost::own_name("fuzz");
  ServerConfig server = config();
  ImageTable images;
  std::array<int, 2> sockets{};
  modbus_t* context = modbus_new_tcp("127.0.0.1", 1502);
};

// Writable are the bytes of the two maps only.
bool is_untouched(std::span<const std::byte> bytes) {
  constexpr std::size_t kBitsEnd = 7;
  constexpr std::size_t kRegisters = 16;
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    const bool writable = i < kBitsEnd || (i >= kRegisters && i < 2 * kRegisters);
    if (!writable && bytes[i] != std::byte{kReadOnly}) return false;
  }
  return true;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static Server server;
  static const ServedMaps maps(server.server, server.images);
  InputImage& inputs = *server.images.input("in");
  inputs.update([](std::span<std::byte> bytes) { std::ranges::fill(bytes, std::byte{kReadOnly}); });
  std::span<const std::uint8_t> rest(data, size);
  for (Frame frame = first_frame(rest); frame.state == FrameState::whole; frame = first_frame(rest)) {
    if (frame.size > kMaxFrame || frame.size > rest.size()) std::abort();
    const std::vector<std::uint8_t> alone(rest.begin(),
                                          rest.begin() + static_cast<std::ptrdiff_t>(frame.size));
    if (!answer(server.context, maps, alone)) std::abort();
    std::array<std::uint8_t, 512> reply{};
    const ssize_t got = ::recv(server.sockets[1], reply.data(), reply.size(), 0);
    // One answer, with the number of the request and the length that it says.
    if (got < 9 || got > static_cast<ssize_t>(kMaxFrame)) std::abort();
    if (reply[0] != alone[0] || reply[1] != alone[1]) std::abort();
    constexpr ssize_t kUncounted = 6;  // bytes of the header that the length does not count
    if (kUncounted + (reply[4] << 8U | reply[5]) != got) std::abort();
    rest = rest.subspan(frame.size);
  }
  inputs.look([](std::span<const std::byte> bytes) {
    if (!is_untouched(bytes)) std::abort();
  });
  return 0;
}
