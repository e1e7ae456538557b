#pragma once

#include <array>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

#include <modbus/modbus.h>

#include "shm/base/unique_fd.hpp"

namespace plchost::testing {

/// A port of the loopback interface that nobody else gets while this is there, also if nobody listens.
class HeldPort {
 public:
  HeldPort();
  [[nodiscard]] std::uint16_t number() const { return number_; }
  [[nodiscard]] std::string address() const;

 private:
  std::uint16_t number_ = 0;  // before the socket, which sets it
  UniqueFd fd_;
};

/// Two ends of a serial line: a terminal of the kernel that programs open, and the other end.
class SerialLine {
 public:
  SerialLine();
  [[nodiscard]] const std::string& path() const { return path_; }
  [[nodiscard]] int other_end() const { return master_.get(); }

 private:
  UniqueFd master_;
  UniqueFd held_;  ///< else the line would hang up when its last user closes it
  std::string path_;
};

/// A Modbus device made with libmodbus, in a thread of its own. It has kRegisters of each kind, which begin
/// as zero.
class ModbusPeer {
 public:
  static constexpr int kRegisters = 300;
  static constexpr int kHalf = 200;
  static constexpr std::uint8_t kOwnException = 0x21;
  static constexpr std::chrono::milliseconds kSlow{30};
  enum class Mode : int {
    normal,
    stalls,           ///< takes requests, and does not answer
    garbage,          ///< answers with bytes that are no Modbus
    dribbles,         ///< answers one byte of a response after the other, and never ends
    refuses,          ///< answers with exception 2
    other_unit,       ///< answers as another unit
    other_length,     ///< says more bytes in the header than the function has
    other_protocol,   ///< says in the header that it is no Modbus
    other_write,      ///< confirms writes of another address
    unreachable,      ///< answers as a gateway that does not reach the device: with exception 11
    no_single,        ///< has no functions that write one register or coil
    no_several,       ///< has no functions that write several
    half,             ///< refuses what lies from register kHalf on
    answers_another,  ///< normal, behind a response to the request before
    own_exception,    ///< answers with an exception that no standard names
    slow,             ///< normal, kSlow behind each request
    late,             ///< answers each request with the response to an earlier one: answer_late()
    ends,             ///< normal, and ends the connection behind each response
    echoes,           ///< normal, and its input registers follow its holding registers
  };

  /// On TCP.
  explicit ModbusPeer(const HeldPort& port, Mode mode = Mode::normal);
  /// On a serial line, with this unit.
  ModbusPeer(const SerialLine& line, int unit);
  /// Connections end, and nobody listens any more.
  ~ModbusPeer();
  ModbusPeer(const ModbusPeer&) = delete;
  ModbusPeer& operator=(const ModbusPeer&) = delete;

  void set(Mode mode) { mode_ = mode; }
  /// From now on each request gets the response to the one that came `requests` earlier.
  void answer_late(int requests) {
    late_by_ = requests;
    mode_ = Mode::late;
  }
  /// Calls `use` while no request is answered.
  void with(const std::function<void(modbus_mapping_t&)>& use);
  [[nodiscard]] int holding(int address);
  [[nodiscard]] int coil(int address);
  /// That it was sent so far.
  [[nodiscard]] int requests() const { return requests_; }

 private:
  void run();
  void run_line();
  using Request = std::array<std::uint8_t, MODBUS_TCP_MAX_ADU_LENGTH>;
  [[nodiscard]] bool serve(int fd);
  [[nodiscard]] bool answer(int fd, Request& request, int size);
  [[nodiscard]] static bool answer_altered(int fd, Request& request, std::size_t at, std::uint8_t byte);
  /// On TCP.
  [[nodiscard]] bool refuses(const Request& request) const;
  void make_mapping();

  modbus_t* context_ = nullptr;
  modbus_mapping_t* mapping_ = nullptr;
  std::mutex mutex_;
  std::atomic<Mode> mode_;
  std::atomic<int> requests_{0};
  std::atomic<bool> ends_{false};
  UniqueFd listener_;
  struct Held {
    Request request;
    int size;
  };
  std::deque<Held> held_;  ///< late: requests that are not answered yet
  std::atomic<int> late_by_{1};
  int line_ = -1;
  int unit_ = 0;
  std::thread thread_;
};

}  // namespace plchost::testing
