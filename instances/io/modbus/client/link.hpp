#pragma once

#include <atomic>
#include <cstdint>
#include <expected>
#include <functional>
#include <memory>
#include <mutex>
#include <span>
#include <string>

#include <modbus/modbus.h>

#include "instances/io/modbus/client/pdu.hpp"
#include "instances/io/modbus/config/map_values.hpp"
#include "instances/io/modbus/config/modbus_config.hpp"
#include "instances/io/modbus/threads/stop_event.hpp"
#include "instances/io/modbus/threads/turn_lock.hpp"
#include "shm/base/result.hpp"
#include "shm/base/time.hpp"
#include "shm/base/unique_fd.hpp"

namespace plchost::modbus {

/// The way to one device on TCP, or to all devices of one serial line or one connection, which take turns for
/// each request. It connects by itself. A TCP connection is closed after each failure that is no exception,
/// so that no late response is taken for another one's. Any thread.
class Link {
 public:
  /// The address or the line is that of the device. Nothing is opened yet. Set-up.
  [[nodiscard]] static Result<std::unique_ptr<Link>> make(const DeviceConfig& device, const StopEvent& stop);
  ~Link();
  Link(const Link&) = delete;
  Link& operator=(const Link&) = delete;

  /// Takes a serial line for this process, if it is there. busy: another process has it. Set-up.
  [[nodiscard]] Result<void> claim(const DeviceConfig& device);

  /// The line or connection is this thread's alone, until the end of what is returned. That is for several
  /// requests, or for values that must not grow old while others have their turn.
  using Turn = std::unique_lock<TurnLock>;
  [[nodiscard]] Turn take_turn() { return Turn(turn_); }

  /// Connects, or opens the line, if that is not done: a request then waits for nothing before it is sent.
  [[nodiscard]] LinkResult open(const DeviceConfig& device);
  /// The time limit is that of the device, for the connection and for the whole response.
  [[nodiscard]] LinkResult read(const DeviceConfig& device, const RegisterMap& map, MapValues& values);
  /// It is not repeated after LinkFailure::at_rest, because its values may be old by then.
  /// `look`: called before each request but the first one of a map that takes several. It brings `values` up
  /// to date; false: no more is sent. Then `values` holds what was sent last.
  using Look = std::function<bool(MapValues& values)>;
  [[nodiscard]] LinkResult write(const DeviceConfig& device, const RegisterMap& map, MapValues& values,
                                 const Look& look);
  /// The same with a limit of its own, for a connection that has to be made and for the response. Repeated as
  /// a read is, and possible after the stop.
  [[nodiscard]] LinkResult write_at_end(const DeviceConfig& device, const RegisterMap& map, MapValues& values,
                                        Duration timeout);
  /// The number of the connection or of the opening of the line. The device may have forgotten earlier
  /// writes.
  [[nodiscard]] std::uint64_t connection() const noexcept { return connection_; }

  /// A thread that waits for a response on TCP gets none any more, except to write_at_end().
  void interrupt() noexcept;
  /// When a device last answered to write_at_end().
  [[nodiscard]] TimePoint answered_at_end() const noexcept { return answered_at_end_; }

 private:
  struct Free {
    void operator()(modbus_t* context) const noexcept { modbus_free(context); }
  };
  Link(modbus_t* line, const StopEvent& stop) : line_(line), stop_(stop) {}

  struct Limits {
    Duration timeout;
    bool at_end = false;
    bool once = false;  ///< not repeated after a failure at rest
  };
  using Take = std::function<LinkResult(std::span<const std::uint8_t> response)>;
  LinkResult request(const DeviceConfig& device, Limits limits, const Pdu& asked, const Take& take);
  LinkResult write(const DeviceConfig& device, const RegisterMap& map, MapValues& values, Limits limits,
                   const Look& look);
  std::expected<Pdu, LinkFailure> ask_tcp(const DeviceConfig& device, Limits limits, const Pdu& asked);
  bool await_line(TimePoint deadline, Limits limits);
  LinkResult write_once(const DeviceConfig& device, const RegisterMap& map, MapValues& values, Limits limits);
  void await_silence(const DeviceConfig& device);
  std::expected<Pdu, LinkFailure> ask_line(const DeviceConfig& device, Limits limits, const Pdu& asked);
  std::unexpected<LinkFailure> line_failure(int error, bool has_begun);
  std::expected<Pdu, LinkFailure> receive_line(const DeviceConfig& device, TimePoint deadline, Limits limits);
  std::expected<void, std::string> open_tcp(const DeviceConfig& device, Limits limits);
  std::expected<void, std::string> open_line(const DeviceConfig& device);
  void close_line() noexcept;
  void keep(UniqueFd connection) noexcept;

  std::unique_ptr<modbus_t, Free> line_;  ///< null: TCP
  const StopEvent& stop_;
  TurnLock turn_;  ///< held for one request, and for what follows
  bool line_is_open_ = false;
  TimePoint last_byte_;       ///< at the line, as far as it is known
  UniqueFd claim_;            ///< of the line; a name whose device is gone would stay with it
  std::uint16_t number_ = 0;  ///< of the last request on TCP
  std::atomic<std::uint64_t> connection_{0};
  std::mutex descriptor_;  ///< for changes of tcp_ beside turn_, and never held while waiting
  UniqueFd tcp_;
  bool is_end_ = false;  ///< with descriptor_: the request is one of write_at_end(), as all behind it are
  std::atomic<TimePoint> answered_at_end_{TimePoint()};
};

}  // namespace plchost::modbus
