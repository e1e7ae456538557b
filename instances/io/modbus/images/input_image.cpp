#include "instances/io/modbus/images/input_image.hpp"

#include <algorithm>
#include <utility>

namespace plchost::modbus {

Result<std::unique_ptr<InputImage>> InputImage::open(const std::string& pool, const std::string& name,
                                                     std::uint32_t size) {
  PLCHOST_TRY_ASSIGN(auto image, ProcessImage::open(pool, name, size, PLC_IMAGE_WRITE));
  std::unique_ptr<InputImage> opened(new InputImage(pool, name, std::move(image)));
  if (!opened->image_.read(opened->bytes_)) std::ranges::fill(opened->bytes_, std::byte{0});
  return opened;
}

Result<void> InputImage::repair() {
  const std::lock_guard lock(mutex_);
  if (!image_.gone()) return {};
  // With the pool of a host that has ended its file goes; the next one makes it anew.
  if (!image_.lost() && !ProcessImage::exists(pool_, name_)) return {};
  const auto size = static_cast<std::uint32_t>(bytes_.size());
  image_.unlock();  // it may be the same file, cut short
  auto opened = ProcessImage::open(pool_, name_, size, PLC_IMAGE_WRITE);
  if (!opened) {
    image_.lock();
    return std::unexpected(std::move(opened).error());
  }
  image_ = std::move(*opened);
  publish();
  return {};
}

void InputImage::publish() {
  std::ranges::copy(bytes_, ended_.begin());
  for (const AtEnd& change : at_end_) change(ended_);
  plc_image_write_watched(&image_.image(), bytes_.data(), ended_.data());
}

void InputImage::end() {
  const std::lock_guard lock(mutex_);
  plc_image_tell(&image_.image(), PLC_IMAGE_STATE_ENDED, 1);
}

}  // namespace plchost::modbus
