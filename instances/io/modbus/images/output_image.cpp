#include "instances/io/modbus/images/output_image.hpp"

#include <chrono>

namespace plchost::modbus {

namespace {

constexpr std::chrono::milliseconds kLookPause{500};

}  // namespace

Result<std::unique_ptr<OutputImage>> OutputImage::open(const std::string& pool, const std::string& name,
                                                       std::uint32_t size) {
  PLCHOST_TRY_ASSIGN(auto image, ProcessImage::open(pool, name, size, PLC_IMAGE_READ));
  return std::unique_ptr<OutputImage>(new OutputImage(pool, name, std::move(image)));
}

// A reader that was overtaken keeps what it has.
void OutputImage::refresh() {
  repair();
  const auto stamp_ns = image_.read(fresh_);
  if (!stamp_ns) return;
  std::swap(bytes_, fresh_);
  stamp_ns_ = *stamp_ns;
}

void OutputImage::repair() {
  const TimePoint now = MonotonicClock::now();
  if (now < looked_at_ + kLookPause) return;
  looked_at_ = now;
  if (!image_.gone()) return;
  auto opened = ProcessImage::open(pool_, name_, static_cast<std::uint32_t>(bytes_.size()), PLC_IMAGE_READ);
  if (opened) image_ = std::move(*opened);  // else the age tells it
}

// Only a stranger writes a stamp of the future, or a negative one.
Duration OutputImage::age() const noexcept {
  const plc_image_i64 now_ns = plc_image_now_ns();
  if (stamp_ns_ <= 0 || stamp_ns_ > now_ns) return Duration::max();
  return Duration(now_ns - stamp_ns_);
}

}  // namespace plchost::modbus
