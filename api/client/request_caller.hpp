#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include <control.h>

#include "api/client/host_clock.hpp"
#include "api/client/wait_set.hpp"
#include "api/dds/guid.hpp"
#include "api/dds/host_writers.hpp"
#include "api/dds/topics.hpp"
#include "shm/base/result.hpp"
#include "shm/base/time.hpp"

namespace plchost {

/// A request to one instance.
struct ApiRequest {
  std::string host;
  std::int32_t operation = 0;  ///< plc_OPERATION_...
  std::string instance;
  std::string argument;
  bool boot = false;        ///< as in plc_Request
  bool online = false;      ///< as in plc_Request
  std::uint64_t size = 0;   ///< of the file of a download
  std::string sha256 = {};  ///< of that file
  plc_ListPart part = {};   ///< of the list that is asked for
};

/// A host's answer.
struct ApiReply {
  ErrorCode code = ErrorCode::ok;
  std::string text;                ///< why not; or a remark
  std::uint64_t status_round = 0;  ///< the host's status from this round on shows the effect
  plc_SampleIdentity identity{};   ///< of the request
  std::int64_t host_unix_ns = 0;   ///< when the host wrote it, by its clock
  std::int64_t asked_unix_ns = 0;  ///< by the clock here: before the request was written for the first time
  std::int64_t heard_unix_ns = 0;  ///< and when the answer was taken
};

/// The requests of one role to one host: writes, repeats under the same identity, waits for the answer.
class RequestCaller {
 public:
  static constexpr Duration kFirstRepeat = std::chrono::milliseconds(50);
  static constexpr Duration kRepeat = std::chrono::milliseconds(250);

  [[nodiscard]] static Result<RequestCaller> create(dds_entity_t participant, dds_entity_t topic,
                                                    const std::string& host);
  [[nodiscard]] dds_entity_t writer() const noexcept { return way_.writer.get(); }
  [[nodiscard]] const dds::Guid& guid() const noexcept { return guid_; }

  /// How long a call goes on waiting.
  struct Wait {
    TimePoint next = TimePoint::max();  ///< there is something to do meanwhile
    TimePoint deadline;
  };
  /// The work while the answer is waited for: called whenever something may have changed.
  using Meanwhile = std::function<Wait(const plc_SampleIdentity& request, TimePoint now)>;

  /// The host's clock, as it is known now; nullptr: the host has not been seen yet.
  using ClockOf = std::function<const HostClock*()>;

  /// `answering`: the writers that reply_reader takes from. timed_out: no answer until the deadline, which
  /// `meanwhile` can move. A request that the host has not begun by then it does not do; whether it has begun
  /// with it is not known.
  [[nodiscard]] Result<ApiReply> call(const ApiRequest& request, dds_entity_t reply_reader,
                                      const WaitSet& wait_set, TimePoint deadline, const ClockOf& clock,
                                      dds::HostWriters& answering, const Meanwhile& meanwhile = {});

 private:
  RequestCaller() = default;

  dds::PartitionWriter way_;  // to the host
  dds::Guid guid_;
  std::int64_t last_number_ = 0;
};

}  // namespace plchost
