#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

#include "shm/base/result.hpp"
#include "shm/guard/memory_guard.hpp"
#include "shm/plc_process_image.h"

namespace plchost::modbus {

/// One opened image of the pool, also if its file is removed or cut short by others. Not for several threads.
class ProcessImage {
 public:
  /// `access`: PLC_IMAGE_READ or PLC_IMAGE_WRITE. busy: another process writes it. Set-up.
  [[nodiscard]] static Result<ProcessImage> open(const std::string& pool, const std::string& name,
                                                 std::uint32_t size, int access);
  ProcessImage(ProcessImage&& other) noexcept;
  ProcessImage& operator=(ProcessImage&& other) noexcept;
  ProcessImage(const ProcessImage&) = delete;
  ProcessImage& operator=(const ProcessImage&) = delete;
  ~ProcessImage();

  /// The name leads to another file, or to none, or the file was cut short: open it anew.
  [[nodiscard]] bool gone() const;
  /// Its memory was taken away: nothing that is read or written counts.
  [[nodiscard]] bool lost() const noexcept { return guard_.lost(); }
  /// The name leads to a file.
  [[nodiscard]] static bool exists(const std::string& pool, const std::string& name);
  /// Another image of this name can be opened for writing meanwhile, or not any more.
  void unlock() const noexcept;
  void lock() const noexcept;
  [[nodiscard]] const plc_image& image() const noexcept { return image_; }
  /// Some image was published.
  [[nodiscard]] bool is_written() const noexcept { return plc_image_age_ns(&image_) != PLC_IMAGE_NEVER; }
  /// The image that is shown. False: none yet, or it was overtaken each time.
  [[nodiscard]] bool read(std::span<std::byte> bytes) const noexcept {
    return plc_image_read(&image_, bytes.data(), nullptr) == PLC_IMAGE_OK;
  }

 private:
  ProcessImage(std::string pool, std::string name, const plc_image& image);
  std::string pool_;
  std::string name_;
  plc_image image_{};
  MemoryGuard guard_;
};

}  // namespace plchost::modbus
