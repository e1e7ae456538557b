#include "api/library/watcher.hpp"

#include <algorithm>
#include <utility>

#include "api/dds/text.hpp"

namespace plchost {

namespace {

// A watch that is new begins within this; changes wake the thread themselves.
constexpr auto kRound = std::chrono::milliseconds(20);
constexpr auto kReconnect = std::chrono::milliseconds(500);
constexpr std::size_t kKeptOfEach = 64;  // of each instance, as hosts do

bool is_of_one(const TransitionView& a, const TransitionView& b) {
  return dds::text_of(a.sample.host) == dds::text_of(b.sample.host) &&
         dds::text_of(a.sample.instance) == dds::text_of(b.sample.instance);
}

}  // namespace

void Client::Watch::Subscription::look(const News& news) {
  const std::lock_guard lock(calling_);
  if (!stopped()) tell(news);
}

void Client::Watch::Subscription::stop() noexcept {
  stopped_.store(true);
  if (!maker_.is_this()) return;  // its holder is not here
  const std::lock_guard lock(calling_);
}

void Client::Watcher::end() {
  {
    const std::lock_guard lock(mutex_);
    ending_ = true;
  }
  changed_.notify_all();
  if (thread_.joinable()) thread_.join();
}

void Client::Watcher::add(std::shared_ptr<Watch::Subscription> subscription) {
  {
    const std::lock_guard lock(mutex_);
    if (ending_) return;
    subscriptions_.push_back(std::move(subscription));
    if (!thread_.joinable()) thread_ = quiet_thread([this] { watch(); });
  }
  changed_.notify_all();
}

std::vector<std::shared_ptr<Client::Watch::Subscription>> Client::Watcher::wait_for_live() {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [this] { return ending_ || !subscriptions_.empty(); });
  if (ending_) return {};
  std::erase_if(subscriptions_, [](const auto& subscription) { return subscription->stopped(); });
  return subscriptions_;
}

void Client::Watcher::watch() {
  for (;;) {
    const auto subscriptions = wait_for_live();
    {
      const std::lock_guard lock(mutex_);
      if (ending_) return;
    }
    if (subscriptions.empty()) continue;
    if (const auto client = connection_.client()) {
      look(**client, subscriptions);
      (*client)->wait_for_change(MonotonicClock::now() + kRound);
      continue;
    }
    std::unique_lock lock(mutex_);
    changed_.wait_for(lock, kReconnect, [this] { return ending_; });
  }
}

void Client::Watcher::look(ControlClient& client,
                           const std::vector<std::shared_ptr<Watch::Subscription>>& subscriptions) {
  std::vector<TransitionView> fresh;
  if (std::ranges::any_of(subscriptions, [](const auto& one) { return one->wants_transitions(); })) {
    if (auto came = client.transitions()) fresh = *std::move(came);
    keep(fresh);
  }
  for (const auto& subscription : subscriptions) subscription->look({client, fresh, transitions_});
}

void Client::Watcher::keep(const std::vector<TransitionView>& fresh) {
  for (const TransitionView& transition : fresh) {
    transitions_.push_back(transition);
    const auto is_its = [&](const TransitionView& other) { return is_of_one(other, transition); };
    if (static_cast<std::size_t>(std::ranges::count_if(transitions_, is_its)) > kKeptOfEach) {
      transitions_.erase(std::ranges::find_if(transitions_, is_its));
    }
  }
}

}  // namespace plchost
