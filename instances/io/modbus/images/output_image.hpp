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

  [[nodiscard]] const std::string& name() const noexcept { return name_; }

  struct Shown {
    /// The time for which the writer is silent: if it runs and publishes nothing, or gives no sign. One that
    /// has stopped or ended is not: it says, or the manager for it, which outputs hold from then on.
    /// Duration::max(): nothing was written yet.
    Duration silence{};
    /// No task drives the outputs, and they only stay what they were: the settings of the PLC say no values.
    bool kept = false;
  };
  /// Calls `look` with the bytes that are shown, and a Shown.
  template <class Look>
  void look(const Look& look) {
    const std::lock_guard lock(mutex_);
    refresh();
    look(std::span<const std::byte>(bytes_), shown());
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
  [[nodiscard]] Shown shown() const noexcept;

  std::string pool_;
  std::string name_;
  std::mutex mutex_;
  ProcessImage image_;
  std::vector<std::byte> bytes_;
  std::vector<std::byte> fresh_;
  TimePoint looked_at_;   ///< whether the file is still there
  TimePoint tell_again_;  ///< that it cannot be opened
};

}  // namespace plchost::modbus
