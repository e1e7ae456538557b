#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <mutex>
#include <span>
#include <string>
#include <vector>

#include "instances/io/modbus/images/process_image.hpp"
#include "shm/base/result.hpp"

namespace plchost::modbus {

/// An image that this process writes: devices and clients of the server share it. Nobody holds its lock while
/// waiting for a device. Any thread.
class InputImage {
 public:
  /// The values of a process before stay. Set-up.
  [[nodiscard]] static Result<std::unique_ptr<InputImage>> open(const std::string& pool,
                                                                const std::string& name, std::uint32_t size);

  /// Calls `change` with the bytes, and publishes them.
  template <class Change>
  void update(const Change& change) {
    const std::lock_guard lock(mutex_);
    change(std::span(bytes_));
    plc_image_write(&image_.image(), bytes_.data());
  }
  template <class Look>
  void look(const Look& look) {
    const std::lock_guard lock(mutex_);
    look(std::span<const std::byte>(bytes_));
  }

  /// If its file was cut short, or there is another one of that name, opens it with the same values. An
  /// error: it is still so.
  [[nodiscard]] Result<void> repair();

 private:
  InputImage(std::string pool, std::string name, ProcessImage image)
      : pool_(std::move(pool)),
        name_(std::move(name)),
        image_(std::move(image)),
        bytes_(image_.image().size) {}
  std::string pool_;
  std::string name_;
  std::mutex mutex_;
  ProcessImage image_;
  std::vector<std::byte> bytes_;
};

}  // namespace plchost::modbus
