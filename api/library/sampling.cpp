#include "api/library/sampling.hpp"

#include <chrono>
#include <list>

namespace plchost {

namespace {

constexpr auto kConnectAgain = std::chrono::milliseconds(500);

}  // namespace

void Sampling::end() {
  {
    const std::lock_guard lock(mutex_);
    ending_ = true;
    changed_.notify_all();
    if (client_ != nullptr) client_->wake();
  }
  if (thread_.joinable()) thread_.join();
  std::vector<Asking> never;
  const std::lock_guard lock(mutex_);
  std::swap(never, new_);
}

bool Sampling::is_here() {
  const std::lock_guard lock(mutex_);
  return thread_.get_id() == std::this_thread::get_id();
}

void Sampling::begin(Asking asking) {
  const std::lock_guard lock(mutex_);
  if (ending_) return;
  new_.push_back(std::move(asking));
  if (!thread_.joinable()) thread_ = quiet_thread([this] { work(); });
  changed_.notify_all();
  if (client_ != nullptr) client_->wake();
}

std::optional<std::vector<Sampling::Asking>> Sampling::take_new(bool wait) {
  std::unique_lock lock(mutex_);
  if (wait) changed_.wait(lock, [this] { return ending_ || !new_.empty(); });
  if (ending_) return std::nullopt;
  return std::exchange(new_, {});
}

ControlClient* Sampling::connect() {
  for (;;) {
    const auto made = connection_.client();
    std::unique_lock lock(mutex_);
    if (made) return client_ = *made;
    if (changed_.wait_for(lock, kConnectAgain, [this] { return ending_; })) return nullptr;
  }
}

void Sampling::work() {
  std::list<Async<Over>> under_way;
  while (const auto begun = take_new(under_way.empty())) {
    ControlClient* const client = connect();
    if (client == nullptr) return;
    for (const Asking& asking : *begun) under_way.emplace_back(asking(client->core())).start();
    client->core().pump().round(TimePoint::max());
    std::erase_if(under_way, [](const Async<Over>& asking) { return asking.done(); });
  }
}

}  // namespace plchost
