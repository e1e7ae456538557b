#include "instances/io/modbus/images/output_image.hpp"

#include <chrono>
#include <utility>

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
  if (image_.read(fresh_)) std::swap(bytes_, fresh_);
}

OutputImage::Shown OutputImage::shown() const noexcept {
  const plc_image& image = image_.image();
  const bool safe = (plc_image_control(&image) & PLC_IMAGE_SHOWS_SAFE) != 0;
  const std::uint64_t number =
      __atomic_load_n(safe ? &image.header->safe : &image.header->latest, __ATOMIC_ACQUIRE);
  return {.silence = Duration(plc_image_silence_ns(&image)),
          .ended = plc_image_state(&image) == PLC_IMAGE_STATE_ENDED,
          .word = number << 1U | static_cast<std::uint64_t>(safe)};
}

void OutputImage::repair() {
  const TimePoint now = MonotonicClock::now();
  if (now < looked_at_ + kLookPause) return;
  looked_at_ = now;
  if (!image_.gone()) return;
  // With the pool of a host that has ended its file goes. The last word of its writer holds until another one
  // has said something.
  if (!image_.lost() && !ProcessImage::exists(pool_, name_)) return;
  auto opened = ProcessImage::open(pool_, name_, static_cast<std::uint32_t>(bytes_.size()), PLC_IMAGE_READ);
  if (!opened) return;  // the age tells it
  if (image_.lost() || opened->is_written()) image_ = std::move(*opened);
}

}  // namespace plchost::modbus
