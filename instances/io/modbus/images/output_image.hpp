#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <mutex>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "instances/io/modbus/images/process_image.hpp"
#include "shm/base/result.hpp"
#include "shm/base/time.hpp"

namespace plchost::modbus {

/// An image that a PLC writes. Any thread.
class OutputImage {
 public:
  [[nodiscard]] static Result<std::unique_ptr<OutputImage>> open(const std::string& pool,
                                                                 const std::string& name, std::uint32_t size);

  /// Calls `look` with the latest bytes and their age. The age is that of the image; Duration::max(): none
  /// was written yet. A process that writes an image and says more about itself would be asked here.
  template <class Look>
  void look(const Look& look) {
    const std::lock_guard lock(mutex_);
    refresh();
    look(std::span<const std::byte>(bytes_), age());
  }

 private:
  OutputImage(std::string pool, std::string name, ProcessImage image)
      : pool_(std::move(pool)),
        name_(std::move(name)),
        image_(std::move(image)),
        bytes_(image_.image().size),
        fresh_(bytes_.size()) {}
  void refresh();
  void repair();
  [[nodiscard]] Duration age() const noexcept;

  std::string pool_;
  std::string name_;
  std::mutex mutex_;
  ProcessImage image_;
  std::vector<std::byte> bytes_;
  std::vector<std::byte> fresh_;
  plc_image_i64 stamp_ns_ = 0;  ///< 0: none yet
  TimePoint looked_at_;         ///< whether the file is still there
};

}  // namespace plchost::modbus
