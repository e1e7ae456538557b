#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "api/dds/host_writers.hpp"
#include "api/dds/sequence.hpp"
#include "api/dds/text.hpp"
#include "api/dds/topics.hpp"

namespace plchost {

/// The end of a sample when none of its writers is seen any more.
enum class UnseenHost : std::uint8_t {
  forgets,           ///< the sample is gone: it may not be true any more
  keeps_last_words,  ///< the sample stays until the host tells the next one; of topics with one sample a host
};

/// The newest sample of each instance of one status topic.
template <class Sample, UnseenHost kUnseen = UnseenHost::forgets>
class StatusCache {
 public:
  StatusCache() = default;
  explicit StatusCache(dds::TopicReader from) noexcept : from_(std::move(from)) {}

  [[nodiscard]] explicit operator bool() const noexcept { return static_cast<bool>(from_); }
  [[nodiscard]] dds_entity_t reader() const noexcept { return from_.reader.get(); }
  /// Those of its reader.
  [[nodiscard]] dds::HostWriters& writers() noexcept { return writers_; }

  /// Takes what has come.
  void update() {
    if (!from_) return;
    dds::take_changes<Sample>(
        from_.reader.get(), writers_,
        [this](dds_instance_handle_t handle, const Sample& sample) {
          ++changes_;
          if (!samples_.contains(handle)) forget_last_words(dds::text_of(sample.host));
          samples_[handle].take(sample);
        },
        [this](dds_instance_handle_t handle, dds::InstanceEnd why) { end(handle, why); });
  }

  /// All of one host that its present server wrote. Their ext lies in this cache: valid until it is updated.
  [[nodiscard]] std::vector<Sample> of_host(std::string_view host, std::uint64_t epoch) const {
    std::vector<Sample> found;
    for (const auto& [handle, kept] : samples_) {
      if (is_of(kept.sample, host, epoch)) found.push_back(kept.sample);
    }
    return found;
  }
  [[nodiscard]] std::uint32_t count(std::string_view host, std::uint64_t epoch) const {
    return static_cast<std::uint32_t>(std::ranges::count_if(
        samples_, [&](const auto& entry) { return is_of(entry.second.sample, host, epoch); }));
  }

  [[nodiscard]] std::size_t size() const noexcept { return samples_.size(); }
  /// Grows with each change that was taken.
  [[nodiscard]] std::uint64_t changes() const noexcept { return changes_; }
  /// Forgets those of which `is_gone(sample)` says so.
  template <class Predicate>
  void erase_if(Predicate is_gone) {
    std::erase_if(samples_, [&](const auto& entry) { return is_gone(entry.second.sample); });
  }

 private:
  // The elements of a sequence are on loan only, so they are copied.
  struct Kept {
    Sample sample{};
    std::vector<plc_KeyValue> ext;
    bool is_last_word = false;

    void take(const Sample& from) {
      is_last_word = false;
      sample = from;
      const auto parts = dds::parts_of(from.ext);
      ext.assign(parts.begin(), parts.end());
      dds::lend(sample.ext, ext);
    }
  };

  void end(dds_instance_handle_t handle, dds::InstanceEnd why) {
    const auto known = samples_.find(handle);
    if (known == samples_.end()) return;
    ++changes_;
    if (why == dds::InstanceEnd::without_host && kUnseen == UnseenHost::keeps_last_words) {
      known->second.is_last_word = true;
    } else {
      samples_.erase(known);
    }
  }
  // A host that tells of itself again uses another handle than for its last words.
  void forget_last_words(std::string_view host) {
    if constexpr (kUnseen == UnseenHost::keeps_last_words) {
      std::erase_if(samples_, [host](const auto& entry) {
        return entry.second.is_last_word && dds::text_of(entry.second.sample.host) == host;
      });
    }
  }

  static bool is_of(const Sample& sample, std::string_view host, std::uint64_t epoch) {
    return sample.epoch == epoch && dds::text_of(sample.host) == host;
  }

  dds::TopicReader from_;
  dds::HostWriters writers_;
  std::map<dds_instance_handle_t, Kept> samples_;
  std::uint64_t changes_ = 0;
};

}  // namespace plchost
