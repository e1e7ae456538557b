#include "api/library/watcher.hpp"

#include <algorithm>
#include <iterator>
#include <utility>

#include "api/dds/text.hpp"

namespace plchost {

namespace {

// Changes, new watches and the end wake the thread; this is for what nobody tells.
constexpr auto kRound = std::chrono::seconds(1);
constexpr auto kReconnect = std::chrono::milliseconds(500);
constexpr std::size_t kKeptOfEach = 64;  // of each instance, as hosts do

bool is_of_one(const TransitionView& a, const TransitionView& b) {
  return dds::text_of(a.sample.host) == dds::text_of(b.sample.host) &&
         dds::text_of(a.sample.instance) == dds::text_of(b.sample.instance);
}

}  // namespace

void Client::Watch::Subscription::unless_stopped(const std::function<void()>& call) {
  const std::lock_guard lock(calling_);
  if (!stopped()) call();
}

void Client::Watch::Subscription::stop() noexcept {
  stopped_.store(true);
  if (!maker_.is_this()) return;  // its holder is not here
  const std::lock_guard lock(calling_);
}

void Client::Watcher::wake() {
  changed_.notify_all();
  if (client_ != nullptr) client_->wake();
}

void Client::Watcher::end() {
  sampling_.end();
  {
    const std::lock_guard lock(mutex_);
    ending_ = true;
    wake();
  }
  if (thread_.joinable()) thread_.join();
}

void Client::Watcher::add(std::shared_ptr<LookingWatch> subscription) {
  const std::lock_guard lock(mutex_);
  if (ending_) return;
  subscriptions_.push_back(std::move(subscription));
  has_new_ = true;
  if (!thread_.joinable()) thread_ = quiet_thread([this] { watch(); });
  wake();
}

std::optional<Client::Watcher::Subscriptions> Client::Watcher::wait_for_live() {
  for (;;) {
    // They end without the mutex: a callback in Python waits for a thread that may wait for the mutex in
    // add().
    Subscriptions stopped;
    std::unique_lock lock(mutex_);
    if (ending_) return std::nullopt;
    const auto rest =
        std::ranges::stable_partition(subscriptions_, [](const auto& one) { return !one->stopped(); });
    std::ranges::move(rest, std::back_inserter(stopped));
    subscriptions_.erase(rest.begin(), rest.end());
    if (!stopped.empty()) continue;
    if (subscriptions_.empty()) {
      changed_.wait(lock);
      continue;
    }
    if (std::exchange(has_new_, false)) looked_.reset();
    return subscriptions_;
  }
}

bool Client::Watcher::connect() {
  if (client_ != nullptr) return false;
  const auto made = connection_.client();
  std::unique_lock lock(mutex_);
  if (made) {
    client_ = *made;
    return true;
  }
  changed_.wait_for(lock, kReconnect, [this] { return ending_; });
  return false;
}

void Client::Watcher::watch() {
  while (const auto subscriptions = wait_for_live()) {
    // Nobody could wake a wait for a new one, so watches that were added meanwhile are looked for first.
    if (connect() || client_ == nullptr) continue;
    look(*client_, *subscriptions);
    // The watches take samples, too: no wait would end because of these.
    if (client_->changes() != looked_) continue;
    client_->wait_for_change(std::min<TimePoint>(MonotonicClock::now() + kRound, client_->next_silence()));
  }
}

void Client::Watcher::look(ControlClient& client, const Subscriptions& subscriptions) {
  std::vector<TransitionView> fresh;
  takes_transitions_ |=
      std::ranges::any_of(subscriptions, [](const auto& one) { return one->wants_transitions(); });
  if (takes_transitions_) {
    if (auto came = client.transitions()) fresh = *std::move(came);
    keep(fresh);
  }
  const std::uint64_t changes = client.changes();
  if (changes == looked_ && fresh.empty()) return;
  looked_ = changes;
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
