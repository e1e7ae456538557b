#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <span>
#include <string>
#include <vector>

#include "instances/io/modbus/images/process_image.hpp"
#include "shm/base/result.hpp"

namespace plchost::modbus {

/// An image that this process writes: devices and clients of the server share it. Nobody holds its lock while
/// waiting for a device. Beside each image lies what PLCs see once this process was killed or stands still.
/// Any thread.
class InputImage {
 public:
  /// The values of a process before stay. Set-up.
  [[nodiscard]] static Result<std::unique_ptr<InputImage>> open(const std::string& pool,
                                                                const std::string& name, std::uint32_t size);

  /// Of the bytes that are published last, makes those that PLCs see after a sudden end. Set-up.
  using AtEnd = std::function<void(std::span<std::byte>)>;
  void at_end(AtEnd change) { at_end_.push_back(std::move(change)); }

  /// Calls `change` with the bytes, and publishes them.
  template <class Change>
  void update(const Change& change) {
    const std::lock_guard lock(mutex_);
    change(std::span(bytes_));
    publish();
  }
  template <class Look>
  void look(const Look& look) {
    const std::lock_guard lock(mutex_);
    look(std::span<const std::byte>(bytes_));
  }

  /// If its file was cut short, or there is another one of that name, opens it with the same values. An
  /// error: it is still so.
  [[nodiscard]] Result<void> repair();

  /// This process writes no more. update() would undo it.
  void end();

 private:
  InputImage(std::string pool, std::string name, ProcessImage image)
      : pool_(std::move(pool)),
        name_(std::move(name)),
        image_(std::move(image)),
        bytes_(image_.image().size),
        ended_(bytes_.size()) {}
  void publish();

  std::string pool_;
  std::string name_;
  std::mutex mutex_;
  ProcessImage image_;
  std::vector<std::byte> bytes_;
  std::vector<std::byte> ended_;
  std::vector<AtEnd> at_end_;
};

}  // namespace plchost::modbus
