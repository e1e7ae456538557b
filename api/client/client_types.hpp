#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <control.h>

#include "api/dds/debug_page.hpp"
#include "api/dds/log_page.hpp"
#include "api/dds/node_page.hpp"
#include "api/dds/object_page.hpp"
#include "api/dds/trace_page.hpp"
#include "api/dds/variable_page.hpp"
#include "shm/base/result.hpp"
#include "shm/base/time.hpp"

namespace plchost {

/// How long a command or a post may take unless its caller says otherwise.
inline constexpr Duration kDefaultTimeout = std::chrono::seconds(3);

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

/// One host, as it was seen last.
struct HostView {
  std::string name;
  std::uint64_t epoch = 0;
  std::int32_t server_pid = 0;    ///< of plchost-dds
  plc_HostStatus status{};        ///< but for its ext
  std::vector<plc_KeyValue> ext;  ///< of the status
  bool silent = false;            ///< it does not show its presence any more; the rest is what it said last
  bool contested = false;         ///< two servers show their presence under that name at the same time

  /// The labels of its configuration, beside its name.
  [[nodiscard]] std::vector<std::string> labels() const;
  /// The names of the schedulers that its instances can have. None: a host of an older version.
  [[nodiscard]] std::vector<std::string> schedulers() const;
};

/// How far a host's CLOCK_REALTIME is ahead of the one here, and how wrong that can be.
struct ClockOffset {
  Duration offset{};
  Duration uncertainty{};
};

/// A post that was run.
struct RunReport {
  std::uint32_t tasks = 0;  ///< that were bound
  std::string last_task;    ///< "INSTANCE/TASK" that ended its cycle last
  Duration to_start{};      ///< on the host: from the post's arrival to the start of that cycle
  Duration to_end{};        ///< and to its end
  Duration round_trip{};    ///< here: from before the post to after the news
};

/// The listing of a page: ListingOf<plc_LogPage> is a LogListing.
template <class Page>
using ListingOf = decltype(listing_of(std::declval<const Page&>()));

/// An application that is to be sent to an instance.
struct Download {
  std::string host;
  std::string instance;
  std::string name;  ///< of the file, for people
  std::span<const std::byte> contents;
  bool boot = false;    ///< it becomes the boot application
  bool online = false;  ///< it takes over while the tasks run; see kOnlineOption
};
/// Told how many bytes have arrived: again from the beginning, when plchost-dds had to be started again.
using DownloadProgressFunction = std::function<void(std::uint64_t received)>;

}  // namespace plchost
