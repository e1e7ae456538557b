#pragma once

#include <memory>
#include <string>

#include "instances/io/modbus/config/modbus_config.hpp"
#include "shm/base/result.hpp"
#include "shm/base/unique_fd.hpp"
#include "shm/plc_process_image.h"

namespace plchost::modbus {

// Things of which one process has each, however many files name it. The kernel ends a claim with its process.

/// The serial line, as long as the descriptor is open. busy: the text names the process that has it. Another
/// error: there is no such line, or it cannot be opened.
[[nodiscard]] Result<UniqueFd> claim_line(const std::string& path);

/// The outputs of a device on TCP. It is held as the writer of an image is: by a lock of a memory of the
/// pool, in which nothing is written. Set-up, and one thread.
class OutputsClaim {
 public:
  /// busy: the text names the process that writes them.
  [[nodiscard]] static Result<OutputsClaim> take(const std::string& pool, const DeviceConfig& device);
  /// Takes it again if its file was cut short or removed, as the end of a host does. busy: another process
  /// was faster.
  [[nodiscard]] Result<void> repair();

 private:
  struct Close {
    void operator()(plc_image* image) const noexcept;
  };
  OutputsClaim(std::string pool, std::string device, std::string address)
      : pool_(std::move(pool)), device_(std::move(device)), address_(std::move(address)) {}
  [[nodiscard]] Result<void> open();

  std::string pool_;
  std::string device_;
  std::string address_;  ///< with the unit
  std::unique_ptr<plc_image, Close> image_;
};

}  // namespace plchost::modbus
