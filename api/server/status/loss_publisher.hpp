#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <utility>

#include <control.h>

#include "api/server/status/status_table.hpp"
#include "shm/base/time.hpp"
#include "shm/pages/flight_page.hpp"
#include "shm/pages/host_page.hpp"

namespace plchost {

/// Shows the last losses of each instance, from its flight recorder. Control loop only.
class LossPublisher {
 public:
  /// A recorder is looked at so often.
  static constexpr Duration kPeriod = std::chrono::milliseconds(200);

  LossPublisher() = default;
  LossPublisher(std::string pool, StatusTable<plc_LossStatus>& table)
      : pool_(std::move(pool)), table_(&table) {}

  /// Takes the manager's report of an instance: opens the recorder of a new process, and shows what is new in
  /// it. True: something is. Instances of a version that has no recorder have no losses to show.
  bool follow(const InstanceStatus& instance, TimePoint now);
  bool forget(const std::string& instance);
  void write() { table_->write(); }

 private:
  struct Watched {
    std::int32_t pid = 0;
    std::optional<FlightPageReader> page;
    TimePoint next_look;
    std::array<std::uint64_t, kLossesKept> sequences{};  // of each place, when it was shown
  };
  bool open_page(const std::string& instance, Watched& watched);
  bool show(const std::string& instance, Watched& watched);

  std::string pool_;
  StatusTable<plc_LossStatus>* table_ = nullptr;
  std::map<std::string, Watched> instances_;
};

}  // namespace plchost
