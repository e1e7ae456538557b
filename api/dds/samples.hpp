#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include <dds/dds.h>

namespace plchost::dds {

/// Up to `Max` samples taken from a reader, on loan until this object ends. No copy is made.
/// `for (std::size_t i = 0; i < batch.size(); ++i) if (batch.valid(i)) use(batch[i]);`
template <class Sample, std::size_t Max = 64>
class Samples {
 public:
  explicit Samples(dds_entity_t reader) noexcept : reader_(reader) {
    const dds_return_t taken = dds_take(reader, pointers_.data(), infos_.data(), Max, Max);
    size_ = taken > 0 ? static_cast<std::size_t>(taken) : 0;
  }
  Samples(const Samples&) = delete;
  Samples& operator=(const Samples&) = delete;
  ~Samples() {
    if (size_ > 0) (void)dds_return_loan(reader_, pointers_.data(), static_cast<std::int32_t>(size_));
  }

  [[nodiscard]] std::size_t size() const noexcept { return size_; }
  /// The whole bound was used: there may be more.
  [[nodiscard]] bool full() const noexcept { return size_ == Max; }
  [[nodiscard]] const Sample& operator[](std::size_t index) const noexcept {
    return *static_cast<const Sample*>(pointers_[index]);
  }
  [[nodiscard]] const dds_sample_info_t& info(std::size_t index) const noexcept { return infos_[index]; }
  /// False: only the key is there, because the instance was disposed or lost its writer.
  [[nodiscard]] bool valid(std::size_t index) const noexcept { return infos_[index].valid_data; }

 private:
  dds_entity_t reader_;
  std::array<void*, Max> pointers_{};
  std::array<dds_sample_info_t, Max> infos_{};
  std::size_t size_ = 0;
};

/// Takes all that has come, `Max` at a time. `use(sample, info)` for each, on loan as long as that runs; of
/// one that is not valid (info.valid_data) only the key is there.
template <class Sample, std::size_t Max = 64, class Function>
void take_all(dds_entity_t reader, Function use) {
  for (bool more = true; more;) {
    const Samples<Sample, Max> batch(reader);
    for (std::size_t i = 0; i < batch.size(); ++i) use(batch[i], batch.info(i));
    more = batch.full();
  }
}

/// The same, of the valid ones only.
template <class Sample, std::size_t Max = 64, class Function>
void take_valid(dds_entity_t reader, Function use) {
  take_all<Sample, Max>(reader, [&use](const Sample& sample, const dds_sample_info_t& info) {
    if (info.valid_data) use(sample, info);
  });
}

}  // namespace plchost::dds
