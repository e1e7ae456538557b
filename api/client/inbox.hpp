#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <control.h>

#include "api/dds/guid.hpp"

namespace plchost {

/// Request number, client and host.
struct AnswerKey {
  dds::Guid asker;
  std::int64_t number = 0;
  std::string host;

  AnswerKey(const dds::Guid& from, std::int64_t asked, std::string_view to)
      : asker(from), number(asked), host(to) {}
  AnswerKey(const plc_SampleIdentity& asked, std::string_view to)
      : AnswerKey(dds::Guid::from(asked.writer_guid), asked.sequence_number, to) {}
  auto operator<=>(const AnswerKey&) const = default;
};

/// Answers of one type that operations wait for. Others are not kept: they answer what was given up.
template <class Answer>
class Inbox {
 public:
  /// While it exists, the answers to one question are kept for it.
  class Expected {
   public:
    Expected(Inbox& inbox, const AnswerKey& key) : inbox_(inbox), key_(key) { inbox_.answers_[key_]; }
    ~Expected() { inbox_.answers_.erase(key_); }
    Expected(const Expected&) = delete;
    Expected& operator=(const Expected&) = delete;

    /// Those that have come since the last call, in their order.
    [[nodiscard]] std::vector<Answer> take() { return std::exchange(inbox_.answers_[key_], {}); }
    /// The first of them; the others are repetitions.
    [[nodiscard]] std::optional<Answer> take_first() {
      auto come = take();
      if (come.empty()) return std::nullopt;
      return std::move(come.front());
    }

   private:
    Inbox& inbox_;
    AnswerKey key_;
  };

  [[nodiscard]] bool expects_any() const noexcept { return !answers_.empty(); }
  /// `make()`: the answer that has come. Of one question, kMost are kept until they are taken.
  template <class Make>
  void put(const AnswerKey& key, Make make) {
    const auto expected = answers_.find(key);
    if (expected != answers_.end() && expected->second.size() < kMost) expected->second.push_back(make());
  }

 private:
  static constexpr std::size_t kMost = 64;
  std::map<AnswerKey, std::vector<Answer>> answers_;
};

}  // namespace plchost
