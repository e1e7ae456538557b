#pragma once

#include <cstdint>
#include <expected>
#include <memory>
#include <mutex>
#include <string>

#include <modbus/modbus.h>

#include "instances/io/modbus/config/map_values.hpp"
#include "instances/io/modbus/config/modbus_config.hpp"
#include "instances/io/modbus/threads/stop_event.hpp"
#include "shm/base/result.hpp"

namespace plchost::modbus {

/// A request that was not answered as it should be.
struct LinkFailure {
  std::uint16_t exception = 0;  ///< the code of the device; 0: no answer, or garbage
  std::string text;
};
using LinkResult = std::expected<void, LinkFailure>;

/// The way to one device on TCP, or to all devices of one serial line, which take turns for each request. It
/// connects by itself. A TCP connection is closed after each failure that is no exception, so that no late
/// response is taken for another one's. Any thread.
class Link {
 public:
  /// The address or the line is that of the device. Nothing is opened yet. Set-up.
  [[nodiscard]] static Result<std::unique_ptr<Link>> make(const DeviceConfig& device, const StopEvent& stop);
  ~Link();
  Link(const Link&) = delete;
  Link& operator=(const Link&) = delete;

  /// The time limit is that of the device, for the connection and for the whole response.
  [[nodiscard]] LinkResult read(const DeviceConfig& device, const RegisterMap& map, MapValues& values);
  [[nodiscard]] LinkResult write(const DeviceConfig& device, const RegisterMap& map, MapValues& values);
  /// The same with a limit of its own, for a connection that has to be made and for the response. Also after
  /// the stop.
  [[nodiscard]] LinkResult write_at_end(const DeviceConfig& device, const RegisterMap& map, MapValues& values,
                                        Duration timeout);

  /// A thread that waits for a response on TCP gets none any more.
  void interrupt() noexcept;

 private:
  struct Free {
    void operator()(modbus_t* context) const noexcept { modbus_free(context); }
  };
  Link(modbus_t* context, const StopEvent& stop) : context_(context), stop_(stop) {}

  struct Limits {
    Duration timeout;
    bool at_end = false;
  };
  template <class Call>
  LinkResult request(const DeviceConfig& device, Limits limits, const Call& call);
  LinkResult write(const DeviceConfig& device, const RegisterMap& map, MapValues& values, Limits limits);
  LinkResult open(const DeviceConfig& device, Limits limits);
  LinkResult open_tcp(const DeviceConfig& device, Limits limits);
  LinkResult open_serial(const DeviceConfig& device);
  void close() noexcept;
  void keep_descriptor(int fd) noexcept;

  std::unique_ptr<modbus_t, Free> context_;
  const StopEvent& stop_;
  std::mutex turn_;        ///< held for one request
  bool is_open_ = false;   ///< under turn_
  std::mutex descriptor_;  ///< of fd_, and never held while waiting
  int fd_ = -1;            ///< of a TCP connection
};

}  // namespace plchost::modbus
