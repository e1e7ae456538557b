#include "schedulers/supervision/taker_search.hpp"

#include <algorithm>

namespace plchost {

void TakerSearch::begin(TimePoint now) noexcept {
  std::array<pid_t, kMost> found{};
  count_ = times_.real_time_threads(found);
  for (std::size_t i = 0; i < count_; ++i) {
    threads_[i] = {.id = found[i], .used = times_.of_thread(found[i])};
  }
  began_ = now;
  begun_ = true;
}

ThreadText TakerSearch::end(TimePoint now, std::span<const pid_t> spared) noexcept {
  constexpr int kPart = 10;
  begun_ = false;
  ThreadText busiest;
  Duration most{};
  for (const Thread& thread : std::span(threads_).first(count_)) {
    const Duration used = times_.of_thread(thread.id) - thread.used;
    if (used <= (now - began_) / kPart || std::ranges::find(spared, thread.id) != spared.end()) continue;
    const ThreadText who = times_.demote(thread.id);
    if (who.view().empty() || used <= most) continue;
    busiest = who;
    most = used;
  }
  return busiest;
}

}  // namespace plchost
