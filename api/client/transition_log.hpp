#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include <control.h>

#include "api/client/newest_epoch.hpp"
#include "api/dds/host_writers.hpp"
#include "api/dds/topics.hpp"

namespace plchost {

/// One change of state of one instance.
struct TransitionView {
  plc_Transition sample{};   ///< without its ext
  std::uint64_t missed = 0;  ///< how many before this one were overtaken and will never come
};

/// The changes of state that come from all hosts, each once and in the order of its instance's numbers, over
/// all ends of the servers that write them.
class TransitionLog {
 public:
  TransitionLog() = default;
  explicit TransitionLog(dds::TopicReader from) noexcept : from_(std::move(from)) {}

  [[nodiscard]] explicit operator bool() const noexcept { return static_cast<bool>(from_); }
  /// The transitions since the last call.
  [[nodiscard]] std::vector<TransitionView> take();
  /// Whether everything has been taken that this instance's host had written when it wrote this status of it.
  [[nodiscard]] bool has_all(const plc_InstanceStatus& status) const;
  /// One more. Nothing: it was there before. Public for tests.
  [[nodiscard]] bool is_news(const plc_Transition& sample, TimePoint now, std::uint64_t& missed);

 private:
  struct Seen {
    std::uint64_t stream = 0;
    std::uint64_t last = 0;
    // The number that its present server has written, also if it was no news: it begins with the kept ones.
    NewestEpoch epoch;
    std::uint64_t written = 0;
  };
  [[nodiscard]] Seen& seen(const plc_Transition& sample);

  dds::TopicReader from_;
  dds::HostWriters writers_;
  std::map<std::pair<std::string, std::string>, Seen> seen_;  // by host and instance
};

}  // namespace plchost
