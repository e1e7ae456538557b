#include "api/dds/log_sink.hpp"

#include <mutex>
#include <string>
#include <string_view>

#include <dds/dds.h>
#include <dds/ddsrt/log.h>

#include "shm/base/names.hpp"
#include "shm/base/time.hpp"
#include "shm/log/log.hpp"

namespace plchost::dds {

namespace {

class RateLimit {
 public:
  /// Whether one more may pass; `dropped` is how many did not in the seconds before.
  bool pass(unsigned& dropped) {
    const std::lock_guard lock(mutex_);
    const TimePoint now = MonotonicClock::now();
    dropped = 0;
    if (now - since_ >= std::chrono::seconds(1)) {
      since_ = now;
      passed_ = 0;
      dropped = std::exchange(dropped_, 0);
    }
    if (passed_ < kMaxDdsLogLines) {
      ++passed_;
      return true;
    }
    ++dropped_;
    return false;
  }

 private:
  std::mutex mutex_;
  TimePoint since_;
  unsigned passed_ = 0;
  unsigned dropped_ = 0;
};

void write_line(void* /*context*/, const dds_log_data_t* line) {
  static RateLimit limit;
  unsigned dropped = 0;
  if (!limit.pass(dropped)) return;
  std::string_view text(line->message, line->size);
  while (!text.empty() && text.back() == '\n') text.remove_suffix(1);
  const bool severe = (line->priority & (DDS_LC_FATAL | DDS_LC_ERROR)) != 0;
  spdlog::log(severe ? spdlog::level::err : spdlog::level::warn, "DDS: {}", printable(std::string(text)));
  if (dropped > 0) spdlog::warn("DDS: {} not shown", count_text(dropped, "more line was", "more lines were"));
}

}  // namespace

void install_log_sink() {
  dds_set_log_mask(DDS_LC_FATAL | DDS_LC_ERROR | DDS_LC_WARNING);
  dds_set_log_sink(write_line, nullptr);
  dds_set_trace_sink(write_line, nullptr);
}

}  // namespace plchost::dds
