#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include <modbus/modbus.h>
#include <poll.h>

#include "instances/io/modbus/config/modbus_config.hpp"
#include "instances/io/modbus/images/image_table.hpp"
#include "instances/io/modbus/server/request.hpp"
#include "instances/io/modbus/server/served_maps.hpp"
#include "instances/io/modbus/threads/log_pause.hpp"
#include "instances/io/modbus/threads/stop_event.hpp"
#include "shm/base/result.hpp"
#include "shm/base/time.hpp"
#include "shm/base/unique_fd.hpp"

namespace plchost::modbus {

/// Shows images to Modbus clients on TCP. One thread serves all of them and never waits for one: a client
/// that stalls, sends garbage or takes no answer loses its own connection.
class Server {
 public:
  /// Set-up.
  [[nodiscard]] static Result<std::unique_ptr<Server>> listen(const ServerConfig& config,
                                                              const ImageTable& images,
                                                              const StopEvent& stop);
  /// Its thread, until the stop.
  void run();

 private:
  struct Client {
    UniqueFd fd;
    std::array<std::uint8_t, kMaxFrame> received{};
    std::size_t size = 0;
    TimePoint deadline;  ///< of the next whole request
  };
  struct Free {
    void operator()(modbus_t* context) const noexcept { modbus_free(context); }
  };
  Server(const ServerConfig& config, const ImageTable& images, const StopEvent& stop, UniqueFd listener,
         modbus_t* context)
      : config_(config),
        stop_(stop),
        maps_(config, images),
        listener_(std::move(listener)),
        context_(context) {}

  [[nodiscard]] std::vector<pollfd> watched() const;
  [[nodiscard]] TimePoint next_deadline() const noexcept;
  void accept_clients(TimePoint now);
  [[nodiscard]] bool serve(Client& client, TimePoint now);
  [[nodiscard]] bool answer_frames(Client& client, TimePoint now);

  const ServerConfig& config_;
  const StopEvent& stop_;
  ServedMaps maps_;
  UniqueFd listener_;
  std::unique_ptr<modbus_t, Free> context_;
  std::vector<Client> clients_;
  TimePoint accept_again_;  ///< after a failure that waiting may mend
  LogPause full_pause_;
  LogPause garbage_pause_;
};

}  // namespace plchost::modbus
