#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "shm/base/time.hpp"

namespace plchost::modbus {

/// The four tables of a Modbus device. The order is that of kKindNames.
enum class RegisterKind : std::uint8_t { coil, discrete_input, holding_register, input_register };

[[nodiscard]] constexpr bool is_bit(RegisterKind kind) noexcept {
  return kind == RegisterKind::coil || kind == RegisterKind::discrete_input;
}
[[nodiscard]] constexpr bool is_writable(RegisterKind kind) noexcept {
  return kind == RegisterKind::coil || kind == RegisterKind::holding_register;
}

/// How registers become bytes of the image. Of two registers with the bytes AB and CD, the value of 32 bit
/// has its highest byte first in the order abcd.
enum class RegisterOrder : std::uint8_t { single, abcd, cdab, badc, dcba };

enum class ImageDirection : std::uint8_t {
  input,   ///< written by this process, read by the PLC
  output,  ///< written by the PLC
  memory,  ///< a memory area, which is no process image: the server shows it
};

/// The function that writes a map. The order is that of kFunctionNames.
enum class WriteFunction : std::uint8_t {
  automatic,  ///< single for one register or coil, several for more
  single,     ///< 6 or 5: a request for each register or coil
  several,    ///< 16 or 15, for one as well
};

/// The values of inputs that are not refreshed any more.
enum class LossPolicy : std::uint8_t { keep, zero };

enum class Parity : std::uint8_t { none, even, odd };

/// [modbus]: the process.
struct ProcessConfig {
  std::string pool = "plchost";
  std::string log_level = "info";
};

/// One [[image]].
struct ImageConfig {
  std::string name;
  ImageDirection direction = ImageDirection::input;
  std::uint32_t size = 0;  ///< 0: it was refused
  unsigned line = 0;
  unsigned direction_line = 0;  ///< 0: it was refused
};

/// One [[device.read]], [[device.write]] or [[server.map]]: a run of registers or bits and its place.
struct RegisterMap {
  RegisterKind kind = RegisterKind::holding_register;
  std::uint16_t address = 0;
  std::uint32_t count = 1;
  std::string image;
  std::uint32_t offset = 0;
  std::uint8_t bit = 0;
  RegisterOrder order = RegisterOrder::single;
  Duration rewrite = std::chrono::seconds(1);         ///< [[device.write]]; 0: only when it has changed
  WriteFunction function = WriteFunction::automatic;  ///< [[device.write]]
  bool optional = false;                              ///< [[device.read]]
  bool writable = false;                              ///< [[server.map]]
  unsigned line = 0;
};

/// One [[device]].
struct DeviceConfig {
  std::string name;
  std::string tcp;     ///< "192.168.1.10:502"; empty: it is at a serial line
  std::string serial;  ///< "/dev/ttyUSB0"
  int baud = 19'200;
  Parity parity = Parity::even;
  int stop_bits = 1;
  std::uint8_t unit = 1;
  bool share_connection = true;  ///< on TCP, with the other devices of its address
  bool probe = true;             ///< at a serial line: reads that tell late responses apart
  Duration poll = std::chrono::milliseconds(100);
  Duration timeout = std::chrono::milliseconds(500);
  Duration reconnect = std::chrono::milliseconds(500);  ///< doubles with each failure in a row
  Duration reconnect_max = std::chrono::seconds(10);
  LossPolicy when_gone = LossPolicy::keep;
  Duration gone_after = std::chrono::seconds(1);
  LossPolicy when_silent = LossPolicy::zero;
  Duration silent_after = std::chrono::seconds(1);
  std::string status_image;  ///< empty: none
  std::uint32_t status_offset = 0;
  std::vector<RegisterMap> reads = {};
  std::vector<RegisterMap> writes = {};
  unsigned line = 0;
};

/// [server]
struct ServerConfig {
  std::string listen = "127.0.0.1:502";
  bool allow_unsecured = false;
  std::uint32_t connections = 8;
  Duration idle_timeout = std::chrono::seconds(60);
  Duration silent_after = std::chrono::seconds(1);  ///< 0: never
  std::vector<RegisterMap> maps = {};
  unsigned line = 0;
};

struct ModbusConfig {
  ProcessConfig process;
  std::vector<ImageConfig> images;
  std::vector<DeviceConfig> devices;
  std::optional<ServerConfig> server;
};

// Bounds of what a file may say.
inline constexpr std::size_t kMaxConfigBytes = std::size_t{1} << 20;
inline constexpr std::size_t kMaxImages = 32;
inline constexpr std::size_t kMaxDevices = 256;
inline constexpr std::size_t kMaxMaps = 64;  ///< of a device in one direction, and of the server
inline constexpr std::int64_t kMaxServerConnections = 64;
inline constexpr std::uint32_t kRegisterSpace = 65'536;  ///< addresses of each kind
/// Of one request, as the protocol bounds it.
inline constexpr std::uint32_t kMaxReadBits = 2000;
inline constexpr std::uint32_t kMaxReadRegisters = 125;
inline constexpr std::uint32_t kMaxWriteBits = 1968;
inline constexpr std::uint32_t kMaxWriteRegisters = 123;

/// The status of a device in an input image. The PLC sees this struct at `status_offset`.
struct DeviceStatus {
  std::uint16_t quality = 0;   ///< Quality
  std::uint8_t exception = 0;  ///< the last exception code of the device; 0: none
  std::uint8_t counter = 0;    ///< another one every 50 ms, as long as plchost-modbus runs
  std::uint32_t age_ms = 0;    ///< since the last reading of all inputs began; kNeverRead: not yet
};
static_assert(sizeof(DeviceStatus) == 8);
inline constexpr std::uint32_t kNeverRead = 0xffff'ffff;

enum class Quality : std::uint16_t {
  none = 0,       ///< nothing was read yet, or plchost-modbus has ended
  good = 1,       ///< the last poll was answered
  lost = 2,       ///< no connection, no answer, or garbage
  exception = 3,  ///< the device refuses a request
};

/// Bits or bytes that the map takes in its image.
[[nodiscard]] constexpr std::uint64_t first_bit(const RegisterMap& map) noexcept {
  return std::uint64_t{map.offset} * 8 + (is_bit(map.kind) ? map.bit : 0);
}
[[nodiscard]] constexpr std::uint64_t size_in_bits(const RegisterMap& map) noexcept {
  return is_bit(map.kind) ? map.count : std::uint64_t{map.count} * 16;
}

}  // namespace plchost::modbus
