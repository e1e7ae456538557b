#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "api/dds/entity.hpp"
#include "api/dds/host_writers.hpp"
#include "api/dds/text.hpp"

namespace plchost {

/// The newest sample of each instance of one status topic.
template <class Sample>
class StatusCache {
 public:
  StatusCache() = default;
  /// `reader` was made from `topic`.
  StatusCache(dds::Entity topic, dds::Entity reader) noexcept
      : topic_(std::move(topic)), reader_(std::move(reader)) {}

  [[nodiscard]] explicit operator bool() const noexcept { return static_cast<bool>(reader_); }
  [[nodiscard]] dds_entity_t reader() const noexcept { return reader_.get(); }
  /// Those of its reader.
  [[nodiscard]] dds::HostWriters& writers() noexcept { return writers_; }

  /// Takes what has come. `on_sample(sample)` is called for each that is there now.
  template <class Function>
  void update(Function on_sample) {
    if (!reader_) return;
    dds::take_changes<Sample>(
        reader_.get(), writers_,
        [&](dds_instance_handle_t handle, const Sample& sample) {
          samples_[handle].take(sample);
          ++changes_;
          on_sample(sample);
        },
        [this](dds_instance_handle_t handle) {
          samples_.erase(handle);
          ++changes_;
        });
  }
  void update() {
    update([](const Sample&) {});
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

    void take(const Sample& from) {
      sample = from;
      ext.assign(from.ext._buffer, from.ext._buffer + from.ext._length);
      sample.ext = {};
      sample.ext._length = sample.ext._maximum = static_cast<std::uint32_t>(ext.size());
      sample.ext._buffer = ext.data();
    }
  };

  static bool is_of(const Sample& sample, std::string_view host, std::uint64_t epoch) {
    return sample.epoch == epoch && dds::text_of(sample.host) == host;
  }

  dds::Entity topic_;
  dds::Entity reader_;
  dds::HostWriters writers_;
  std::map<dds_instance_handle_t, Kept> samples_;
  std::uint64_t changes_ = 0;
};

}  // namespace plchost
