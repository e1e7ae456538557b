#pragma once

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "instances/io/modbus/client/device.hpp"
#include "instances/io/modbus/client/device_claim.hpp"
#include "instances/io/modbus/client/link.hpp"
#include "instances/io/modbus/config/modbus_config.hpp"
#include "instances/io/modbus/images/image_table.hpp"
#include "instances/io/modbus/server/server.hpp"
#include "instances/io/modbus/threads/log_pause.hpp"
#include "instances/io/modbus/threads/stop_event.hpp"
#include "shm/base/result.hpp"
#include "shm/threads/thread.hpp"

namespace plchost::modbus {

/// All of plchost-modbus: a thread for each device, one for the server, and the calling one, which shows the
/// age of each device and ends the others.
class ModbusProcess {
 public:
  /// Opens all images and the server's port. busy: another process has one of them, or a device. Set-up.
  [[nodiscard]] static Result<std::unique_ptr<ModbusProcess>> create(const ModbusConfig& config);
  ModbusProcess(const ModbusProcess&) = delete;
  ModbusProcess& operator=(const ModbusProcess&) = delete;
  ~ModbusProcess();

  /// Until SIGTERM or SIGINT, which `signals` tells.
  [[nodiscard]] Result<void> run(int signals);
  /// Ends all threads. False: a device keeps its thread, and nothing may be destroyed.
  [[nodiscard]] bool stop();

 private:
  ModbusProcess(const ModbusConfig& config, StopEvent stop, ImageTable images)
      : config_(config), stop_(std::move(stop)), images_(std::move(images)) {}
  [[nodiscard]] Result<void> add_devices();
  void show_at_end(const Device& device);
  [[nodiscard]] Result<void> start_threads();
  [[nodiscard]] bool join_until(TimePoint deadline);
  /// A device still puts its outputs into their safe state.
  [[nodiscard]] bool answers() const;
  /// The status and the age of each device, into all images.
  void show(TimePoint now, bool ended);
  void repair(TimePoint now);

  const ModbusConfig& config_;
  StopEvent stop_;
  ImageTable images_;
  struct ClaimedOutputs {
    OutputsClaim claim;
    Device* device;
  };
  std::map<std::string, std::unique_ptr<Link>> lines_;  ///< by line_of()
  std::vector<ClaimedOutputs> outputs_;                 ///< of devices on TCP
  std::vector<std::unique_ptr<Device>> devices_;
  std::unique_ptr<Server> server_;
  std::vector<Thread> threads_;
  TimePoint repaired_at_;
  LogPause repair_pause_;
};

}  // namespace plchost::modbus
