#include "instances/io/modbus/images/output_image.hpp"

#include <algorithm>
#include <chrono>

namespace plchost::modbus {

namespace {

constexpr std::chrono::milliseconds kLookPause{500};
constexpr Duration kHeartbeat = std::chrono::milliseconds(100);  // of an instance

}  // namespace

Result<std::unique_ptr<OutputImage>> OutputImage::open(const std::string& pool, const std::string& name,
                                                       std::uint32_t size) {
  PLCHOST_TRY_ASSIGN(auto image, ProcessImage::open(pool, name, size, PLC_IMAGE_READ));
  return std::unique_ptr<OutputImage>(new OutputImage(pool, name, std::move(image)));
}

// A reader that was overtaken keeps what it has.
void OutputImage::refresh() {
  repair();
  if (image_.read(fresh_)) std::swap(bytes_, fresh_);
}

void OutputImage::repair() {
  const TimePoint now = MonotonicClock::now();
  if (now < looked_at_ + kLookPause) return;
  looked_at_ = now;
  if (!image_.gone()) return;
  auto opened = ProcessImage::open(pool_, name_, static_cast<std::uint32_t>(bytes_.size()), PLC_IMAGE_READ);
  if (opened) image_ = std::move(*opened);  // else the age tells it
}

// As instances/examples/io_terminal does it. PLC_IMAGE_NEVER is Duration::max().
Duration OutputImage::silence() const noexcept {
  const plc_image* const image = &image_.image();
  switch (plc_image_state(image)) {
    case PLC_IMAGE_STATE_ENDED:
      return Duration::zero();
    case PLC_IMAGE_STATE_STOPPED:
    case PLC_IMAGE_STATE_EXCEPTION:
    case PLC_IMAGE_STATE_HALTED:
      return std::max(Duration(plc_image_heartbeat_age_ns(image)) - kHeartbeat, Duration::zero());
    default:
      return Duration(plc_image_age_ns(image));
  }
}

}  // namespace plchost::modbus
