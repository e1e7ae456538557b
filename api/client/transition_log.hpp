#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include <control.h>

#include "api/dds/entity.hpp"

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
  /// `reader` was made from `topic`.
  TransitionLog(dds::Entity topic, dds::Entity reader) noexcept
      : topic_(std::move(topic)), reader_(std::move(reader)) {}

  [[nodiscard]] explicit operator bool() const noexcept { return static_cast<bool>(reader_); }
  /// What has come since the last call.
  [[nodiscard]] std::vector<TransitionView> take();
  /// One more. Nothing: it was there before. Public for tests.
  [[nodiscard]] bool is_news(const plc_Transition& sample, std::uint64_t& missed);

 private:
  struct Seen {
    std::uint64_t stream = 0;
    std::uint64_t last = 0;
  };

  dds::Entity topic_;
  dds::Entity reader_;
  std::map<std::pair<std::string, std::string>, Seen> seen_;  // by host and instance
};

}  // namespace plchost
