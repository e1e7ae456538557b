#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <thread>
#include <utility>
#include <vector>

#include <poll.h>
#include <unistd.h>

#include "tests/integration/modbus/modbus_peer.hpp"

namespace plchost::testing {

/// All devices of a serial line, which a test plays byte by byte: libmodbus always does it right.
class ScriptedLine {
 public:
  using Bytes = std::vector<std::uint8_t>;
  /// Called with each whole request, in a thread of its own.
  ScriptedLine(const SerialLine& line, std::function<void(const Bytes& request)> answer)
      : fd_(line.other_end()), answer_(std::move(answer)), thread_([this] { run(); }) {}
  ~ScriptedLine() {
    ends_ = true;
    thread_.join();
  }
  ScriptedLine(const ScriptedLine&) = delete;
  ScriptedLine& operator=(const ScriptedLine&) = delete;

  static void send(const SerialLine& line, const Bytes& bytes) {
    (void)!::write(line.other_end(), bytes.data(), bytes.size());
  }
  /// The good response to a request for one register, or to a write.
  static Bytes response(const Bytes& request, std::uint8_t value) {
    Bytes frame(request.begin(), request.begin() + 2);
    if (frame[1] <= 4) {
      frame.insert(frame.end(), {2, 0, value});
    } else {
      frame.insert(frame.end(), request.begin() + 2, request.begin() + 6);
    }
    return with_checksum(frame);
  }
  static Bytes with_checksum(Bytes frame) {
    unsigned sum = 0xffff;
    for (const std::uint8_t byte : frame) {
      sum ^= byte;
      for (int bit = 0; bit < 8; ++bit) sum = (sum & 1U) != 0 ? sum >> 1U ^ 0xa001U : sum >> 1U;
    }
    frame.push_back(static_cast<std::uint8_t>(sum));
    frame.push_back(static_cast<std::uint8_t>(sum >> 8U));
    return frame;
  }

 private:
  void run() {
    Bytes request;
    while (!ends_) {
      pollfd look{.fd = fd_, .events = POLLIN, .revents = 0};
      std::uint8_t byte = 0;
      if (::poll(&look, 1, 10) <= 0 || ::read(fd_, &byte, 1) != 1) continue;
      request.push_back(byte);
      if (!is_whole(request)) continue;
      answer_(request);
      request.clear();
    }
  }
  static bool is_whole(const Bytes& request) {
    constexpr std::size_t kPlain = 8;
    if (request.size() < kPlain) return false;
    return request[1] <= 6 || request.size() == std::size_t{9} + request[6];
  }

  int fd_;
  std::function<void(const Bytes&)> answer_;
  std::atomic<bool> ends_{false};
  std::thread thread_;
};

}  // namespace plchost::testing
