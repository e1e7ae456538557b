#pragma once

#include <algorithm>
#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "api/dds/entity.hpp"
#include "api/dds/samples.hpp"
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

  /// Takes what has come. `on_sample(sample)` is called for each that is there now.
  template <class Function>
  void update(Function on_sample) {
    if (!reader_) return;
    for (bool more = true; more;) {
      const dds::Samples<Sample> batch(reader_.get());
      for (std::size_t i = 0; i < batch.size(); ++i) {
        const auto handle = batch.info(i).instance_handle;
        if (batch.disposed(i)) {
          samples_.erase(handle);
        } else if (batch.valid(i)) {
          samples_[handle] = batch[i];
          samples_[handle].ext = {};  // lives on loan only
          on_sample(batch[i]);
        }
      }
      more = batch.full();
    }
  }
  void update() {
    update([](const Sample&) {});
  }

  /// All of one host that its present server wrote.
  [[nodiscard]] std::vector<Sample> of_host(std::string_view host, std::uint64_t epoch) const {
    std::vector<Sample> found;
    for (const auto& [handle, sample] : samples_) {
      if (sample.epoch == epoch && dds::text_of(sample.host) == host) found.push_back(sample);
    }
    return found;
  }
  [[nodiscard]] std::uint32_t count(std::string_view host, std::uint64_t epoch) const {
    return static_cast<std::uint32_t>(std::ranges::count_if(samples_, [&](const auto& entry) {
      return entry.second.epoch == epoch && dds::text_of(entry.second.host) == host;
    }));
  }

 private:
  dds::Entity topic_;
  dds::Entity reader_;
  std::map<dds_instance_handle_t, Sample> samples_;
};

}  // namespace plchost
