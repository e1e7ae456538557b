#pragma once

#include <cstdint>
#include <string>

#include <control.h>

#include "api/client/met_readers.hpp"
#include "api/dds/guid.hpp"
#include "api/dds/topics.hpp"
#include "shm/base/result.hpp"
#include "shm/base/time.hpp"

namespace plchost {

/// The way of requests of one role to one host. It numbers them.
class RequestCaller {
 public:
  static constexpr Duration kFirstRepeat = std::chrono::milliseconds(50);
  static constexpr Duration kRepeat = std::chrono::milliseconds(250);

  /// `topic` is that of the role.
  [[nodiscard]] static Result<RequestCaller> create(dds_entity_t participant, dds_entity_t topic,
                                                    const std::string& host);
  [[nodiscard]] dds_entity_t writer() const noexcept { return way_.writer.get(); }
  [[nodiscard]] const dds::Guid& guid() const noexcept { return guid_; }
  /// Whether the host's reader is there.
  [[nodiscard]] bool matched() const noexcept { return has_reader(way_.writer.get()); }

  /// Makes it the next request.
  void number(plc_Request& request) noexcept;
  /// Once, or again.
  void write(const plc_Request& request) const noexcept;

 private:
  RequestCaller() = default;

  dds::PartitionWriter way_;  // to the host
  dds::Guid guid_;
  std::int64_t last_number_ = 0;
};

}  // namespace plchost
