#pragma once

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>

#include <dds/dds.h>

#include "shm/base/time.hpp"

namespace plchost::dds {

/// The kind of partitions that a topic is written into; see control.idl.
enum class Partition : std::uint8_t { host, status, client, name, blocks };

/// The values of a topic's `qos:` in control.idl. All topics are reliable.
struct TopicQos {
  Duration blocking{};            ///< a writer waits so long for a slow reader
  std::int32_t depth = 0;         ///< of the history; 0: all samples are kept
  bool transient_local = false;   ///< late readers get what is kept
  bool autodispose = true;        ///< a writer that ends disposes its instances
  Duration deadline{};            ///< 0: none
  std::int32_t reader_holds = 0;  ///< samples that the host's reader holds; 0: no bound
};

/// A topic of control.idl.
struct TopicInfo {
  const char* name;
  const dds_topic_descriptor_t* type;
  Partition partition;
  TopicQos qos;
};

/// The topic of a type that is sent as one topic: kTopicOf<plc_Reply>. Others have none.
template <class Sample>
inline constexpr std::nullptr_t kTopicOf{};

}  // namespace plchost::dds
