// The threads that take the processor from the tasks of a set, as far as the supervision cannot see to it by
// itself.
#include <fmt/format.h>

#include "schedulers/task_set.hpp"

namespace plchost {

namespace {

constexpr Duration kTellAgain = std::chrono::seconds(10);

long long in_ms(Duration duration) {
  return std::chrono::duration_cast<std::chrono::milliseconds>(duration).count();
}

}  // namespace

std::vector<std::string> TaskSet::look_after_processor() {
  std::vector<std::string> news;
  if (!supervision_) return news;
  const Duration limit = supervision_->starvation().limit();
  const TimePoint now = clock_.now();
  if (const auto task = supervision_->starvation().take_starved_by_others();
      task && now >= starved_told_ + kTellAgain) {
    starved_told_ = now;
    news.push_back(
        fmt::format("task '{}' was ready to run for {} ms and got no processor: programs outside of "
                    "this instance take its core",
                    tasks_[*task]->config().name, in_ms(limit)));
  }
  if (!supervision_->watches_releases()) {
    ProcessorGuard::alive();
    if (const auto taker = ProcessorGuard::take()) {
      news.push_back(
          fmt::format("{} took the processor for {} ms from all threads of the runtime. It has no "
                      "real-time priority any more",
                      taker->who.view(), in_ms(taker->lasted)));
    }
    return news;
  }
  const Duration overdue = supervision_->overdue(now);
  if (limit == Duration::zero() || overdue < limit) {
    takers_.forget();
  } else if (!takers_.begun()) {
    takers_.begin(now);
  } else if (const ThreadText who = takers_.end(now, {}); !who.view().empty()) {
    ProcessorGuard::report(who, overdue);
  }
  return news;
}

}  // namespace plchost
