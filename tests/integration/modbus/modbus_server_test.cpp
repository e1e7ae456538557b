// The server of plchost-modbus and real clients of libmodbus.

#include <array>
#include <atomic>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <memory>
#include <span>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <arpa/inet.h>
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <modbus/modbus.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>

#include "shm/base/unique_fd.hpp"
#include "shm/files/memory_file.hpp"
#include "shm/files/pool_files.hpp"
#include "tests/integration/modbus/modbus_peer.hpp"
#include "tests/integration/modbus/modbus_program.hpp"

namespace plchost::testing {
namespace {

using namespace std::chrono_literals;

/// A client of libmodbus.
class Client {
 public:
  explicit Client(const HeldPort& port) : context_(modbus_new_tcp("127.0.0.1", port.number())) {
    modbus_set_response_timeout(context_, 10, 0);
    connected_ = eventually([&] { return modbus_connect(context_) == 0; });
  }
  ~Client() {
    modbus_close(context_);
    modbus_free(context_);
  }
  Client(const Client&) = delete;
  Client& operator=(const Client&) = delete;

  [[nodiscard]] bool connected() const { return connected_; }
  [[nodiscard]] modbus_t* context() const { return context_; }
  /// The registers, or the negative number of the exception; -100: another fault.
  [[nodiscard]] std::vector<int> holding(int address, int count) const {
    std::array<std::uint16_t, MODBUS_MAX_READ_REGISTERS> values{};
    if (modbus_read_registers(context_, address, count, values.data()) < 0) return {exception()};
    return {values.begin(), values.begin() + count};
  }
  [[nodiscard]] int write(int address, std::uint16_t value) const {
    return modbus_write_register(context_, address, value) == 1 ? 0 : exception();
  }
  [[nodiscard]] static int exception() {
    const int code = errno - MODBUS_ENOBASE;
    return code > 0 && code < MODBUS_EXCEPTION_MAX ? -code : -100;
  }

 private:
  modbus_t* context_;
  bool connected_ = false;
};

/// A client that sends any bytes.
class RawClient {
 public:
  explicit RawClient(const HeldPort& port) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(port.number());
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    EXPECT_TRUE(eventually([&] {
      fd_.reset(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0));
      return ::connect(fd_.get(), reinterpret_cast<sockaddr*>(&address), sizeof address) == 0;
    }));
  }
  void send(std::string_view bytes) const {
    EXPECT_EQ(::send(fd_.get(), bytes.data(), bytes.size(), MSG_NOSIGNAL),
              static_cast<ssize_t>(bytes.size()));
  }
  /// Waits for room if there is none. False: the connection has ended.
  [[nodiscard]] bool offer(std::string_view bytes) const {
    pollfd look{.fd = fd_.get(), .events = POLLOUT, .revents = 0};
    if (::poll(&look, 1, 40'000) != 1) return true;
    return ::send(fd_.get(), bytes.data(), bytes.size(), MSG_NOSIGNAL | MSG_DONTWAIT) > 0 || errno == EAGAIN;
  }
  /// The server has closed the connection.
  [[nodiscard]] bool is_closed() const {
    char byte = 0;
    pollfd look{.fd = fd_.get(), .events = POLLIN, .revents = 0};
    return ::poll(&look, 1, 40'000) == 1 && ::recv(fd_.get(), &byte, 1, 0) <= 0;
  }

 private:
  UniqueFd fd_;
};

// Registers 0 to 3: read-only. 4 and 5: writable, at byte 16. 100: an output. Coil 0 to 9: writable, at
// byte 20.
std::string server(const HeldPort& port, std::string_view more = "") {
  return fmt::format(R"(
[server]
listen = "{}"
{}
[[server.map]]
kind = "holding_register"
address = 0
count = 4
image = "t.in"
[[server.map]]
kind = "holding_register"
address = 4
count = 2
image = "t.in"
offset = 16
writable = true
[[server.map]]
kind = "holding_register"
address = 100
image = "t.out"
[[server.map]]
kind = "coil"
address = 0
count = 10
image = "t.in"
offset = 20
writable = true
)",
                     port.address(), more);
}

TEST(ModbusServer, ShowsOutputsThatAreFresh) {
  Plant plant;
  const HeldPort port;
  const ModbusProgram sut(plant, plant.write(server(port, "silent_after_ms = 300")));
  const Client client(port);
  ASSERT_TRUE(client.connected()) << sut.log();
  EXPECT_TRUE(eventually([&] {
    plant.put_out(0, 4711);
    return client.holding(100, 1) == std::vector{4711};
  }));
  EXPECT_TRUE(eventually([&] { return client.holding(100, 1) == std::vector{-4}; }));  // the PLC is silent
}

// An instance makes it, and the end of the host takes it away.
TEST(ModbusServer, ShowsAMemoryAreaWhileItIsThere) {
  Plant plant;
  const HeldPort port;
  const std::string text = fmt::format(
      "[[image]]\nname = \"line1\"\ndirection = \"memory\"\nsize = 12\n[server]\nlisten = \"{}\"\n"
      "[[server.map]]\nkind = \"holding_register\"\naddress = 0\ncount = 6\nimage = \"line1\"\n",
      port.address());
  const ModbusProgram sut(plant, plant.write(text));
  const Client client(port);
  ASSERT_TRUE(client.connected()) << sut.log();
  EXPECT_EQ(client.holding(0, 1), std::vector{-4});
  const std::string name = pool_memory_name(plant.pool(), "line1");
  const auto make = [&](std::size_t size, std::uint16_t first, std::uint16_t last) {
    const MemoryFile memory = MemoryFile::create(name, size).value();
    std::memcpy(memory.bytes().data(), &first, sizeof first);
    std::memcpy(memory.bytes().data() + size - sizeof last, &last, sizeof last);
  };
  const auto shows = [&](const std::vector<int>& values) {
    return eventually([&] { return client.holding(0, static_cast<int>(values.size())) == values; });
  };
  make(12, 4711, 12);
  EXPECT_TRUE(shows({4711, 0, 0, 0, 0, 12}));
  MemoryFile::remove(name);
  EXPECT_TRUE(shows({-4}));
  make(10, 1, 2);  // too short
  EXPECT_EQ(client.holding(0, 1), std::vector{-4});
  MemoryFile::remove(name);
  make(12, 1, 2);
  EXPECT_TRUE(shows({1, 0, 0, 0, 0, 2}));
  EXPECT_EQ(client.write(0, 3), -2);
  MemoryFile::remove(name);
}

// Registers and coils that are as long as the header of an image.
std::string memory_server(const HeldPort& port, std::string_view name) {
  return fmt::format(
      "[[image]]\nname = \"{}\"\ndirection = \"memory\"\nsize = 128\n[server]\nlisten = \"{}\"\n"
      "[[server.map]]\nkind = \"holding_register\"\naddress = 0\ncount = 60\nimage = \"{}\"\nwritable = "
      "true\n"
      "[[server.map]]\nkind = \"coil\"\naddress = 0\ncount = 64\noffset = 120\nimage = \"{}\"\nwritable = "
      "true\n",
      name, port.address(), name, name);
}

// The output and the exit code of --check-config.
std::pair<std::string, int> checked(const std::string& config) {
  std::string text;
  std::FILE* const program = ::popen((PLCHOST_MODBUS_PROGRAM " --check-config " + config).c_str(), "r");
  for (int letter = 0; (letter = std::fgetc(program)) != EOF;) text += static_cast<char>(letter);
  return {text, ::pclose(program)};
}

TEST(ModbusServer, AProcessImageIsRefusedAsAMemoryArea) {
  Plant plant;
  const HeldPort port;
  const std::string config = plant.write(memory_server(port, "sv.out"));
  EXPECT_EQ(checked(config).second, 0) << "there is none yet: " << checked(config).first;
  plc_image image{};
  ASSERT_EQ(plc_image_open(plant.pool().c_str(), "sv.out", 64, PLC_IMAGE_WRITE, &image), 0);
  const std::string error = config +
                            ":13: [[image]] 'sv.out' direction: \"memory\" is for other areas, and " +
                            fmt::format("'sv.out' of pool '{}' is a process image", plant.pool());
  const auto [text, code] = checked(config);
  EXPECT_NE(code, 0);
  EXPECT_THAT(text, ::testing::HasSubstr(error));
  ModbusProgram sut(plant, config);
  EXPECT_EQ(sut.end(), 1);
  EXPECT_TRUE(sut.logged(error)) << sut.log();
  plc_image_close(&image);
}

/// Each client's write is refused, and nothing of an image is read or has changed.
void expect_refused(const Client& client, const plc_image& image) {
  const plc_image_header before = *image.header;
  EXPECT_EQ(client.holding(0, 1), std::vector{-4});
  for (int address = 0; address < 60; ++address) EXPECT_EQ(client.write(address, 0x0102), -4) << address;
  EXPECT_EQ(modbus_write_bit(client.context(), 3, 1), -1);
  EXPECT_EQ(Client::exception(), -4);
  EXPECT_EQ(std::memcmp(&before, image.header, sizeof before), 0);
}

// An instance starts later, with the name of a memory area for its outputs.
TEST(ModbusServer, AProcessImageThatReplacesAMemoryAreaIsNotTouched) {
  Plant plant;
  const HeldPort port;
  const ModbusProgram sut(plant, plant.write(memory_server(port, "line1")));
  const Client client(port);
  ASSERT_TRUE(client.connected()) << sut.log();
  EXPECT_EQ(client.holding(0, 1), std::vector{-4}) << "it is not there";
  const std::string name = pool_memory_name(plant.pool(), "line1");
  plc_image image{};
  ASSERT_EQ(plc_image_open(plant.pool().c_str(), "line1", 64, PLC_IMAGE_WRITE, &image), 0);
  expect_refused(client, image);
  EXPECT_TRUE(sut.logged("memory 'line1' of pool '" + plant.pool() + "' is not shown: it is a process image"))
      << sut.log();
  plc_image_close(&image);
  MemoryFile::remove(name);
  {
    const MemoryFile memory = MemoryFile::create(name, 128).value();
    EXPECT_TRUE(eventually([&] { return client.write(8, 3) == 0; })) << sut.log();
    EXPECT_EQ(client.holding(8, 1), std::vector{3});
  }
  MemoryFile::remove(name);
  ASSERT_EQ(plc_image_open(plant.pool().c_str(), "line1", 64, PLC_IMAGE_WRITE, &image), 0);
  EXPECT_TRUE(eventually([&] { return client.holding(0, 1) == std::vector{-4}; })) << sut.log();
  expect_refused(client, image);
  plc_image_close(&image);
}

// A memory of zeros that has the size of an image becomes one where it lies.
TEST(ModbusServer, AMemoryAreaThatBecomesAProcessImageIsNotTouched) {
  Plant plant;
  const HeldPort port;
  const MemoryFile memory =
      MemoryFile::create(pool_memory_name(plant.pool(), "line1"), plc_image_bytes(64)).value();
  const ModbusProgram sut(plant, plant.write(memory_server(port, "line1")));
  const Client client(port);
  ASSERT_TRUE(client.connected()) << sut.log();
  EXPECT_EQ(client.write(59, 3), 0);
  EXPECT_EQ(client.holding(59, 1), std::vector{3});
  plc_image image{};
  ASSERT_EQ(plc_image_open(plant.pool().c_str(), "line1", 64, PLC_IMAGE_WRITE, &image), 0);
  expect_refused(client, image);
  EXPECT_TRUE(sut.logged("it is a process image")) << sut.log();
  plc_image_close(&image);
}

// As a C program and firmware, which know no cycle of each other: this thread writes what lies between.
TEST(ModbusServer, WritesAMemoryAreaAndNothingBesideItsRegisters) {
  Plant plant;
  const HeldPort port;
  const std::string text = fmt::format(R"(
[[image]]
name = "line1"
direction = "memory"
size = 32
[server]
listen = "{}"
[[server.map]]
kind = "holding_register"
address = 0
count = 8
image = "line1"
order = "abcd"
writable = true
[[server.map]]
kind = "coil"
address = 0
count = 64
image = "line1"
offset = 20
writable = true
)",
                                       port.address());
  const std::string name = pool_memory_name(plant.pool(), "line1");
  const ModbusProgram sut(plant, plant.write(text));
  const Client client(port);
  ASSERT_TRUE(client.connected()) << sut.log();
  EXPECT_EQ(client.write(0, 3), -4) << "it is not there yet";
  const MemoryFile memory = MemoryFile::create(name, 32).value();
  auto* const words = reinterpret_cast<std::uint16_t*>(memory.bytes().data());
  auto* const coils = reinterpret_cast<std::uint8_t*>(memory.bytes().data() + 20);
  ASSERT_TRUE(eventually([&] { return client.write(0, 3) == 0; }));
  EXPECT_EQ(words[1], 3) << "the low register of 32 bit has the high word";
  // Registers 1 and 2 are words 0 and 3. Words 1 and 2 and the bits beside the coil are this thread's.
  std::atomic<bool> stop{false};
  int lost = 0;
  std::thread program([&] {
    for (std::uint16_t value = 1; !stop; ++value) {
      __atomic_store_n(&words[1], value, __ATOMIC_RELAXED);
      __atomic_store_n(&words[2], value, __ATOMIC_RELAXED);
      __atomic_fetch_xor(coils, 2, __ATOMIC_RELAXED);
      const bool on = (__atomic_load_n(coils, __ATOMIC_RELAXED) & 2) != 0;
      std::this_thread::yield();
      if (__atomic_load_n(&words[1], __ATOMIC_RELAXED) != value) ++lost;
      if (__atomic_load_n(&words[2], __ATOMIC_RELAXED) != value) ++lost;
      if (((__atomic_load_n(coils, __ATOMIC_RELAXED) & 2) != 0) != on) ++lost;
    }
  });
  for (std::uint16_t value = 1; value <= 1000; ++value) {
    const std::array<std::uint16_t, 2> both = {value, static_cast<std::uint16_t>(value + 1)};
    EXPECT_EQ(modbus_write_registers(client.context(), 1, 2, both.data()), 2);
    EXPECT_EQ(__atomic_load_n(&words[0], __ATOMIC_RELAXED), value);
    EXPECT_EQ(__atomic_load_n(&words[3], __ATOMIC_RELAXED), value + 1);
    EXPECT_EQ(modbus_write_bit(client.context(), 0, value % 2), 1);
    EXPECT_EQ(__atomic_load_n(coils, __ATOMIC_RELAXED) & 1, value % 2);
  }
  stop = true;
  program.join();
  EXPECT_EQ(lost, 0);
  MemoryFile::remove(name);
}

TEST(ModbusServer, WritesOnlyWhereItMay) {
  Plant plant;
  const HeldPort port;
  const ModbusProgram sut(plant, plant.write(server(port)));
  const Client client(port);
  ASSERT_TRUE(client.connected()) << sut.log();
  EXPECT_EQ(client.write(4, 1234), 0);
  EXPECT_TRUE(eventually([&] { return plant.input_word(16) == 1234; }));
  EXPECT_EQ(client.holding(4, 2), (std::vector{1234, 0}));
  EXPECT_EQ(client.write(3, 1234), -2);
  EXPECT_EQ(client.write(100, 1234), -2);
  EXPECT_EQ(client.write(6, 1234), -2);
  const std::array<std::uint16_t, 2> over_both = {7, 8};
  EXPECT_EQ(modbus_write_registers(client.context(), 3, 2, over_both.data()), -1);
  EXPECT_EQ(Client::exception(), -2);
  EXPECT_EQ(client.holding(0, 6), (std::vector{0, 0, 0, 0, 1234, 0}));  // over two maps
  EXPECT_EQ(client.holding(0, 7), std::vector{-2});
  const std::array<std::uint8_t, 3> bits = {1, 0, 1};
  EXPECT_EQ(modbus_write_bits(client.context(), 7, 3, bits.data()), 3);
  EXPECT_EQ(modbus_write_bit(client.context(), 0, 1), 1);
  EXPECT_TRUE(eventually([&] { return plant.input_word(20) == 0x0281; }));
  std::array<std::uint8_t, 16> read{};
  EXPECT_EQ(modbus_read_bits(client.context(), 0, 10, read.data()), 10);
  EXPECT_THAT(std::span(read).first(10), ::testing::ElementsAre(1, 0, 0, 0, 0, 0, 0, 1, 0, 1));
  EXPECT_EQ(modbus_read_input_bits(client.context(), 0, 1, read.data()), -1);
  EXPECT_EQ(Client::exception(), -2);
  std::array<std::uint16_t, 2> exchanged{};
  EXPECT_EQ(modbus_write_and_read_registers(client.context(), 4, 1, over_both.data(), 4, 1, exchanged.data()),
            -1);
  EXPECT_EQ(Client::exception(), -1);  // a function that is not served
}

// A client that has the answer may tell others to look.
TEST(ModbusServer, AnAnsweredWriteIsInTheImage) {
  Plant plant;
  const HeldPort port;
  const ModbusProgram sut(plant, plant.write(server(port)));
  const Client client(port);
  ASSERT_TRUE(client.connected()) << sut.log();
  for (std::uint16_t value = 1; value <= 300; ++value) {
    ASSERT_EQ(client.write(4, value), 0);
    ASSERT_EQ(plant.input_word(16), value);
  }
}

TEST(ModbusServer, GarbageEndsItsOwnConnectionOnly) {
  Plant plant;
  const HeldPort port;
  const ModbusProgram sut(plant, plant.write(server(port)));
  const Client client(port);
  ASSERT_TRUE(client.connected()) << sut.log();
  for (const std::string_view garbage :
       {std::string_view("GET / HTTP/1.1\r\n\r\n"), std::string_view("\0\1\0\0\0\1", 6),
        std::string_view("\0\1\0\0\1\0xxxxxxxxxxxxxxxxxxxxx", 27)}) {
    const RawClient raw(port);
    raw.send(garbage);
    EXPECT_TRUE(raw.is_closed());
  }
  EXPECT_EQ(client.holding(0, 1), std::vector{0});
}

TEST(ModbusServer, AnIdleConnectionAndHalfARequestEnd) {
  Plant plant;
  const HeldPort port;
  const ModbusProgram sut(plant, plant.write(server(port, "idle_timeout_ms = 300")));
  const RawClient idle(port);
  const RawClient half(port);
  half.send(std::string_view("\0\1\0\0\0\6\xff\3\0", 9));
  EXPECT_TRUE(idle.is_closed()) << sut.log();
  EXPECT_TRUE(half.is_closed());
}

TEST(ModbusServer, HasSoManyConnections) {
  Plant plant;
  const HeldPort port;
  const ModbusProgram sut(plant, plant.write(server(port, "connections = 2")));
  const Client first(port);
  auto second = std::make_unique<Client>(port);
  EXPECT_EQ(first.holding(0, 1), std::vector{0}) << sut.log();
  EXPECT_EQ(second->holding(0, 1), std::vector{0});
  const RawClient third(port);
  EXPECT_TRUE(third.is_closed());
  EXPECT_TRUE(eventually([&] { return sut.logged("all 2 connections are in use"); }));
  second.reset();
  EXPECT_TRUE(eventually([&] { return Client(port).holding(0, 1) == std::vector{0}; }));
  EXPECT_EQ(first.holding(0, 1), std::vector{0});
}

// Its answers fill the buffers of both sockets: the server closes it, and serves the others meanwhile.
TEST(ModbusServer, AClientThatTakesNoAnswerStopsNobody) {
  Plant plant;
  const HeldPort port;
  const ModbusProgram sut(plant, plant.write(server(port)));
  const Client client(port);
  ASSERT_TRUE(client.connected()) << sut.log();
  const RawClient deaf(port);
  const std::string request("\0\1\0\0\0\6\xff\1\0\0\0\12", 12);
  std::string many;
  for (int i = 0; i < 1000; ++i) many += request;
  bool ended = false;
  for (int i = 0; i < 10'000 && !ended; ++i) ended = !deaf.offer(many);
  EXPECT_TRUE(ended);
  EXPECT_EQ(client.holding(0, 1), std::vector{0});
}

TEST(ModbusServer, APortThatIsTakenIsTold) {
  Plant plant;
  const HeldPort port;
  const ModbusPeer other(port);
  ModbusProgram sut(plant, plant.write(server(port)));
  EXPECT_EQ(sut.end(), 1);
  EXPECT_TRUE(sut.logged("[server] listen: " + port.address() + ": Address already in use")) << sut.log();
}

}  // namespace
}  // namespace plchost::testing
