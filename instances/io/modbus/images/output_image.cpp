#include "instances/io/modbus/images/output_image.hpp"

#include <chrono>
#include <utility>

#include "shm/log/log.hpp"

namespace plchost::modbus {

namespace {

constexpr std::chrono::milliseconds kLookPause{500};
constexpr std::chrono::seconds kTellPause{1};

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
  const unsigned state = plc_image_state(&image);
  const bool rests = state >= PLC_IMAGE_STATE_STOPPED && state <= PLC_IMAGE_STATE_ENDED;
  return {.silence = Duration(plc_image_silence_ns(&image)),
          .kept = rests && __atomic_load_n(&image.header->on_end, __ATOMIC_RELAXED) == 0};
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
  if (!opened) {
    if (now < tell_again_) return;
    tell_again_ = now + kTellPause;
    spdlog::error("{}", opened.error().describe());
    return;
  }
  if (image_.lost() || opened->is_written()) image_ = std::move(*opened);
}

}  // namespace plchost::modbus
