#pragma once

#include <atomic>
#include <cstdint>
#include <memory>

#include <control.h>

#include "api/dds/entity.hpp"
#include "tests/bench/bench.hpp"

namespace plchost::bench {

/// One end of a bare Cyclone DDS connection, which floors are measured with: types, QoS and configuration are
/// those of posts and their acknowledgements.
struct BareEnd {
  std::shared_ptr<dds::Entity> domain;
  dds::Entity participant;
  dds::Entity event_topic;
  dds::Entity ack_topic;
  dds::Entity reader;
  dds::Entity writer;
  dds::Entity wait_set;

  /// `fifo`: the priority of the threads that receive; 0: none.
  [[nodiscard]] Result<void> open(std::uint32_t number, bool receives, int fifo);
  void wait() const;
  [[nodiscard]] bool matched() const;
};

/// The work of the receiving end besides taking and counting.
enum class BareDuty : std::uint8_t {
  nothing,      ///< its threads have normal priority, on any core
  acknowledge,  ///< each batch; its threads have the core and the priorities of those of plchost-dds
  wake,         ///< at each sample, if it waits, a thread of a task's core and priority, which goes through
                ///< its loop as often as there are samples; else as `nothing`
};

/// For a process that does nothing else. `taken` counts the samples. Returns only if it cannot begin.
void run_bare_end(const Plan& plan, std::uint32_t domain, BareDuty duty, std::atomic<std::uint64_t>& taken);

/// The end that posts.
class BareClient {
 public:
  [[nodiscard]] Result<void> open(std::uint32_t domain);
  bool post();
  /// Posts, and waits for the acknowledgement.
  void round_trip();

 private:
  BareEnd end_;
  plc_EventPost sample_{};
  std::uint64_t last_ = 0;
};

}  // namespace plchost::bench
