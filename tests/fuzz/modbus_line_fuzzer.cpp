// The first byte chooses devices and maps, the others are the script. The way of a response at a serial line:
// devices that a script plays answer polls over a pseudo terminal, by way of libmodbus. A device answers its
// requests in order, loses some, and is late. Other bytes are noise. Up to two devices, each with a thread,
// take turns.

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <deque>
#include <map>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <spdlog/spdlog.h>

#include "instances/io/modbus/client/device.hpp"
#include "instances/io/modbus/client/link.hpp"
#include "instances/io/modbus/images/image_table.hpp"
#include "instances/io/modbus/threads/stop_event.hpp"
#include "shm/files/pool_files.hpp"
#include "tests/integration/modbus/modbus_peer.hpp"
#include "tests/integration/modbus/scripted_line.hpp"
#include "tests/support/own_name.hpp"

namespace {

using namespace plchost::modbus;
using plchost::testing::ScriptedLine;
using plchost::testing::SerialLine;
using Bytes = ScriptedLine::Bytes;

constexpr std::uint32_t kSize = 64;
constexpr std::uint8_t kUntouched = 0xa5;
constexpr int kPolls = 3;
// Fewer than Unanswered remembers, because probes are requests, too.
constexpr std::size_t kMostLate = 8;
constexpr std::array<std::uint8_t, 2> kUnits{5, 6};

std::string image_of(std::uint8_t unit) {
  return "in" + std::to_string(unit);
}

/// No two registers of the devices have the same value.
std::uint16_t value_of(unsigned unit, unsigned function, unsigned address) {
  return static_cast<std::uint16_t>(unit * 4096 + function * 512 + address);
}
bool bit_of(unsigned unit, unsigned address) {
  return (address * 7 + unit) % 5 < 2;
}

// The first two maps have responses of one shape, so that one may be taken for the other. Those of further
// maps end a poll in which that has happened.
DeviceConfig device_at(const SerialLine& line, std::uint8_t unit, unsigned choice) {
  DeviceConfig device;
  device.name = "d" + std::to_string(unit);
  device.serial = line.path();
  device.baud = 115'200;
  device.unit = unit;
  device.timeout = std::chrono::milliseconds(4);
  const auto map = [](RegisterKind kind, std::uint16_t address, std::uint32_t count, std::string image,
                      std::uint32_t offset) {
    RegisterMap made;
    made.kind = kind;
    made.address = address;
    made.count = count;
    made.image = std::move(image);
    made.offset = offset;
    return made;
  };
  device.reads = {map(RegisterKind::holding_register, 7, 3, image_of(unit), 0),
                  map(RegisterKind::holding_register, 100, 3, image_of(unit), 8)};
  if ((choice & 2U) != 0)
    device.reads.push_back(map(RegisterKind::discrete_input, 16, 16, image_of(unit), 16));
  if ((choice & 4U) != 0) device.writes = {map(RegisterKind::holding_register, 300, 2, "out", 0)};
  return device;
}

Bytes good_response(const Bytes& request) {
  const auto word = [&](std::size_t at) {
    return static_cast<unsigned>(request[at] << 8U | request[at + 1]);
  };
  const unsigned unit = request[0];
  const unsigned function = request[1];
  const unsigned address = word(2);
  const unsigned count = word(4);
  Bytes frame{request[0], request[1]};
  if (function > 4) {
    frame.insert(frame.end(), request.begin() + 2, request.begin() + 6);
  } else if (function > 2) {
    frame.push_back(static_cast<std::uint8_t>(2 * count));
    for (unsigned i = 0; i < count; ++i) {
      const std::uint16_t value = value_of(unit, function, address + i);
      frame.push_back(static_cast<std::uint8_t>(value >> 8U));
      frame.push_back(static_cast<std::uint8_t>(value));
    }
  } else {
    Bytes bits((count + 7) / 8);
    for (unsigned i = 0; i < count; ++i) {
      if (bit_of(unit, address + i)) bits[i / 8] = static_cast<std::uint8_t>(bits[i / 8] | 1U << i % 8);
    }
    frame.push_back(static_cast<std::uint8_t>(bits.size()));
    frame.insert(frame.end(), bits.begin(), bits.end());
  }
  return ScriptedLine::with_checksum(frame);
}

/// The devices. One thread.
class Answers {
 public:
  Answers(const SerialLine& line, std::span<const std::uint8_t> script) : line_(line), script_(script) {}

  void answer(const Bytes& request) {
    std::deque<Bytes>& waiting = waiting_[request[0]];
    waiting.push_back(good_response(request));
    if (waiting.size() > kMostLate) waiting.pop_front();
    switch (next() % 12) {
      case 0:
        return;  // late, or lost
      case 1:
        waiting.pop_front();
        return;
      case 2:  // all that wait, one behind the other
        while (waiting.size() > 1) send(take(waiting));
        return send(take(waiting));
      case 3: {  // half of it
        Bytes half = take(waiting);
        half.resize(1 + next() % (half.size() - 1));
        return send(half);
      }
      case 4: {  // a refusal
        const Bytes refused = take(waiting);
        return send(ScriptedLine::with_checksum(
            {refused[0], static_cast<std::uint8_t>(refused[1] | 0x80U), static_cast<std::uint8_t>(next())}));
      }
      case 5: {  // that of another unit comes before
        Bytes other = good_response(request);
        other.resize(other.size() - 2);
        other[0] = static_cast<std::uint8_t>(other[0] + 8);
        send(ScriptedLine::with_checksum(other));
        return send(take(waiting));
      }
      case 6:
        send_noise(request[0]);
        return send(take(waiting));
      case 7:
        return send_noise(request[0]);
      case 8:  // those before are lost
        while (waiting.size() > 1) waiting.pop_front();
        [[fallthrough]];
      default:
        return send(take(waiting));
    }
  }
  /// Only whole responses were sent, or parts of one.
  [[nodiscard]] bool is_without_noise() const noexcept { return !noise_; }

 private:
  static Bytes take(std::deque<Bytes>& waiting) {
    Bytes first = std::move(waiting.front());
    waiting.pop_front();
    return first;
  }
  std::uint8_t next() {
    if (script_.empty()) return 8;
    const std::uint8_t byte = script_.front();
    script_ = script_.subspan(1);
    return byte;
  }
  void send(const Bytes& bytes) { ScriptedLine::send(line_, bytes); }
  // Any bytes, or behind the unit and with their checksum.
  void send_noise(std::uint8_t unit) {
    noise_ = true;
    const unsigned kind = next();
    Bytes bytes;
    if (kind % 2 != 0) bytes.push_back(unit);
    for (unsigned i = 0; i < kind / 8; ++i) bytes.push_back(next());
    if (!bytes.empty()) send(kind % 2 != 0 ? ScriptedLine::with_checksum(bytes) : bytes);
  }

  const SerialLine& line_;
  std::span<const std::uint8_t> script_;
  std::map<std::uint8_t, std::deque<Bytes>> waiting_;
  std::atomic<bool> noise_{false};
};

struct Images {
  Images() {
    spdlog::set_level(spdlog::level::off);
    std::vector<ImageConfig> configs{{.name = "out", .direction = ImageDirection::output, .size = kSize}};
    for (const std::uint8_t unit : kUnits)
      configs.push_back({.name = image_of(unit), .direction = ImageDirection::input, .size = kSize});
    auto opened = ImageTable::open(pool, configs);
    auto made = StopEvent::make();
    if (!opened || !made) std::abort();
    table = std::move(*opened);
    stop.emplace(std::move(*made));
  }
  ~Images() { plchost::remove_pool_memories(pool); }
  Images(const Images&) = delete;
  Images& operator=(const Images&) = delete;

  std::string pool = plchost::own_name("fuzz");
  ImageTable table;
  std::optional<StopEvent> stop;
};

// All of its inputs, or none: and never those of other registers, however late it is.
void check_inputs(const DeviceConfig& device, const ImageTable& images, bool is_without_noise) {
  std::vector<std::byte> expected(kSize, std::byte{kUntouched});
  for (const RegisterMap& map : device.reads) {
    MapValues values;
    for (unsigned i = 0; i < map.count; ++i) {
      if (is_bit(map.kind)) {
        values.bits(map.count)[i] = bit_of(device.unit, map.address + i) ? 1 : 0;
      } else {
        values.registers(map.count)[i] = value_of(device.unit, 3, map.address + i);
      }
    }
    values.write_to(map, expected);
  }
  images.input(image_of(device.unit))->look([&](std::span<const std::byte> bytes) {
    const auto is_untouched = [](std::span<const std::byte> part) {
      return std::ranges::all_of(part, [](std::byte byte) { return byte == std::byte{kUntouched}; });
    };
    constexpr std::size_t kMapsEnd = 18;
    if (!is_untouched(bytes.subspan(kMapsEnd))) std::abort();
    if (is_without_noise && !is_untouched(bytes) && !std::ranges::equal(bytes, expected)) std::abort();
  });
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  constexpr std::size_t kMost = 256;
  if (size == 0 || size > kMost) return 0;
  static Images images;
  const SerialLine line;
  Answers answers(line, std::span(data, size).subspan(1));
  const ScriptedLine devices(line, [&](const Bytes& request) { answers.answer(request); });
  const std::array configs{device_at(line, kUnits[0], data[0]), device_at(line, kUnits[1], data[0])};
  const auto link = Link::make(configs[0], *images.stop);
  if (!link) std::abort();
  const auto poll = [&](const DeviceConfig& config) {
    images.table.input(image_of(config.unit))->update([](std::span<std::byte> bytes) {
      std::ranges::fill(bytes, std::byte{kUntouched});
    });
    Device device(config, **link, images.table, *images.stop);
    for (int i = 0; i < kPolls; ++i) {
      (void)device.poll();
      check_inputs(config, images.table, answers.is_without_noise());
    }
  };
  if (data[0] % 2 == 0) {
    poll(configs[0]);
  } else {
    std::thread other([&] { poll(configs[1]); });
    poll(configs[0]);
    other.join();
  }
  return 0;
}
