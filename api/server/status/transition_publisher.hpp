#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>

#include <control.h>
#include <sys/types.h>

#include "api/dds/topics.hpp"
#include "shm/base/result.hpp"
#include "shm/base/time.hpp"
#include "shm/pages/transition_ring.hpp"

namespace plchost {

/// Writes each change of state of each instance as one sample, in order. Control loop only.
class TransitionPublisher {
 public:
  struct Source {
    std::string host;
    std::string pool;
    std::uint64_t epoch = 0;
  };
  [[nodiscard]] static Result<TransitionPublisher> create(dds_entity_t participant, dds_entity_t publisher,
                                                          Source source);

  /// Writes what is new of this instance; the number of the last one that was written, 0: none. A transition
  /// that DDS does not take comes first the next time.
  std::uint64_t publish(const std::string& instance, TimePoint now);
  /// There is no such instance any more; another one of that name has another ring.
  void forget(const std::string& instance) { followed_.erase(instance); }

 private:
  struct Followed {
    std::optional<TransitionRingReader> ring;
    ino_t file = 0;                    // that has the ring
    TimePoint next_look;               // for the ring, or for another one
    std::optional<Transition> unsent;  // that DDS did not take
    std::uint64_t written = 0;         // the last number
  };
  TransitionPublisher(Source source, dds::TopicWriter way)
      : source_(std::move(source)), way_(std::move(way)) {}
  void follow(const std::string& instance, Followed& followed, TimePoint now);
  [[nodiscard]] bool write(const std::string& instance, std::int64_t stream, const Transition& transition);

  Source source_;
  dds::TopicWriter way_;
  std::map<std::string, Followed> followed_;
};

}  // namespace plchost
