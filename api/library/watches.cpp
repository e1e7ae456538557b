// The calls of a Client's watches: each remembers what it told last.
#include <map>
#include <set>
#include <utility>
#include <vector>

#include "api/client/client_core_status.hpp"
#include "api/library/convert.hpp"
#include "api/library/records.hpp"
#include "api/library/watcher.hpp"
#include "api/library/worker.hpp"

namespace plchost {

namespace {

std::vector<std::string> hosts_of(ControlClient& client, const std::string& host) {
  if (!host.empty()) return {host};
  std::vector<std::string> names;
  for (const HostView& view : client.hosts(MonotonicClock::now())) names.push_back(view.name);
  return names;
}

}  // namespace

namespace {

// But for what is nearly always another number.
bool is_told(const Client::Host& before, Client::Host now) {
  now.load_percent = before.load_percent;
  now.available_mib = before.available_mib;
  now.grid_offset = before.grid_offset;
  return before == now;
}

}  // namespace

class __attribute__((visibility("hidden"))) Client::HostsWatch final : public Client::LookingWatch {
 public:
  explicit HostsWatch(std::function<void(const Host&)> callback) : callback_(std::move(callback)) {}

 private:
  void tell(const News& news) override {
    std::map<std::string, Host> now;
    for (const HostView& view : news.client.hosts(MonotonicClock::now())) {
      now.emplace(view.name, to_public(view, !news.client.is_silent(view.name)));
    }
    for (auto& [name, told] : told_) {
      if (now.contains(name)) continue;
      Host gone = told;
      gone.answers = false;
      now.emplace(name, std::move(gone));
    }
    for (const auto& [name, host] : now) {
      const auto before = told_.find(name);
      if (before != told_.end() && is_told(before->second, host)) continue;
      told_[name] = host;
      if (!stopped()) callback_(host);
    }
  }

  std::function<void(const Host&)> callback_;
  std::map<std::string, Host> told_;
};

/// Of one status topic.
template <class TopicSample>
class __attribute__((visibility("hidden"))) Client::StatusWatch final : public Client::LookingWatch {
 public:
  using Item = decltype(to_public(TopicSample{}));

  StatusWatch(std::string host, std::function<void(const Item&)> callback)
      : host_(std::move(host)), callback_(std::move(callback)) {}

 private:
  using Key = std::vector<std::string>;

  void tell(const News& news) override {
    for (const std::string& host : hosts_of(news.client, host_)) {
      const auto samples = news.client.template status<TopicSample>(host, MonotonicClock::now());
      if (!samples) continue;  // not complete yet: soon
      std::set<Key> there;
      for (const TopicSample& sample : *samples) {
        Item item = to_public(sample);
        there.insert(key_of(item));
        tell_one(std::move(item));
      }
      tell_removed(host, there);
    }
  }

  void tell_removed(const std::string& host, const std::set<Key>& there) {
    for (auto known = told_.begin(); known != told_.end();) {
      if (known->second.host != host || there.contains(known->first)) {
        ++known;
        continue;
      }
      Item item = std::move(known->second);
      known = told_.erase(known);
      item.removed = true;
      if (!stopped()) callback_(item);
    }
  }

  void tell_one(Item item) {
    const auto [told, is_new] = told_.try_emplace(key_of(item));
    if (!is_new && told->second == item) return;
    told->second = std::move(item);
    if (!stopped()) callback_(told->second);
  }

  std::string host_;
  std::function<void(const Item&)> callback_;
  std::map<Key, Item> told_;
};

/// Of any status topic, by its name.
class __attribute__((visibility("hidden"))) Client::RecordsWatch final : public Client::LookingWatch {
 public:
  RecordsWatch(std::string topic, std::string host, std::function<void(const Record&)> callback)
      : topic_(std::move(topic)), host_(std::move(host)), callback_(std::move(callback)) {}

 private:
  using Key = std::vector<Value>;

  void tell(const News& news) override {
    for (const std::string& host : hosts_of(news.client, host_)) {
      auto records = news.client.wait(read_status(news.client.core(), topic_, host, MonotonicClock::now()));
      if (!records) continue;  // not complete yet: soon
      std::set<Key> there;
      for (Record& record : *records) {
        const Key key = status_key(topic_, record);
        there.insert(key);
        tell_one(host, key, std::move(record));
      }
      tell_removed(host, there);
    }
  }

  void tell_one(const std::string& host, const Key& key, Record record) {
    record.emplace_back("removed", false);
    const auto [told, is_new] = told_[host].try_emplace(key);
    if (!is_new && told->second == record) return;
    told->second = std::move(record);
    if (!stopped()) callback_(told->second);
  }

  void tell_removed(const std::string& host, const std::set<Key>& there) {
    auto& told = told_[host];
    for (auto known = told.begin(); known != told.end();) {
      if (there.contains(known->first)) {
        ++known;
        continue;
      }
      Record record = std::move(known->second);
      known = told.erase(known);
      record.back().second = true;
      if (!stopped()) callback_(record);
    }
  }

  std::string topic_;
  std::string host_;
  std::function<void(const Record&)> callback_;
  std::map<std::string, std::map<Key, Record>> told_;  // by host
};

class __attribute__((visibility("hidden"))) Client::TransitionsWatch final : public Client::LookingWatch {
 public:
  TransitionsWatch(std::string host, std::function<void(const Transition&)> callback)
      : host_(std::move(host)), callback_(std::move(callback)) {}
  [[nodiscard]] bool wants_transitions() const noexcept override { return true; }

 private:
  void tell(const News& news) override {
    for (const TransitionView& view : std::exchange(began_, true) ? news.fresh : news.kept) {
      const Transition transition = to_public(view);
      if (!host_.empty() && transition.host != host_) continue;
      if (!stopped()) callback_(transition);
    }
  }

  std::string host_;
  std::function<void(const Transition&)> callback_;
  bool began_ = false;
};

Client::Watch::Watch() noexcept = default;
Client::Watch::Watch(std::shared_ptr<Subscription> subscription) noexcept
    : subscription_(std::move(subscription)) {}
Client::Watch::Watch(Watch&& other) noexcept = default;

Client::Watch& Client::Watch::operator=(Watch&& other) noexcept {
  if (this != &other) {
    stop();
    subscription_ = std::move(other.subscription_);
  }
  return *this;
}

Client::Watch::~Watch() {
  stop();
}

void Client::Watch::stop() noexcept {
  if (const auto subscription = std::move(subscription_)) subscription->stop();
}

Client::Watch Client::begin_watch(std::shared_ptr<LookingWatch> subscription) {
  if (const auto ours = worker_->maker().check(); !ours) throw_client_error(ours.error());
  watcher_->add(subscription);
  return Watch(std::move(subscription));
}

Client::Watch Client::watch_hosts(std::function<void(const Host&)> callback) {
  check_callback(static_cast<bool>(callback));
  return begin_watch(std::make_shared<HostsWatch>(std::move(callback)));
}

template <class TopicSample, class Item>
Client::Watch Client::watch_items(const std::string& host, std::function<void(const Item&)> callback) {
  check_callback(static_cast<bool>(callback));
  if (!host.empty()) worker_->check_watched(host);
  return begin_watch(std::make_shared<StatusWatch<TopicSample>>(host, std::move(callback)));
}

Client::Watch Client::watch_instances(const std::string& host,
                                      std::function<void(const Instance&)> callback) {
  return watch_items<plc_InstanceStatus>(host, std::move(callback));
}

Client::Watch Client::watch_tasks(const std::string& host, std::function<void(const Task&)> callback) {
  return watch_items<plc_TaskStatus>(host, std::move(callback));
}

Client::Watch Client::watch_events(const std::string& host, std::function<void(const Event&)> callback) {
  return watch_items<plc_EventStatus>(host, std::move(callback));
}

Client::Watch Client::watch_applications(const std::string& host,
                                         std::function<void(const Application&)> callback) {
  return watch_items<plc_ApplicationStatus>(host, std::move(callback));
}

Client::Watch Client::watch_exceptions(const std::string& host,
                                       std::function<void(const Exception&)> callback) {
  return watch_items<plc_ExceptionStatus>(host, std::move(callback));
}

Client::Watch Client::watch_status(const std::string& topic, const std::string& host,
                                   std::function<void(const Record&)> callback) {
  check_callback(static_cast<bool>(callback));
  if (const auto known = check_status_name(topic); !known) throw_client_error(known.error());
  if (!host.empty()) worker_->check_watched(host);
  return begin_watch(std::make_shared<RecordsWatch>(topic, host, std::move(callback)));
}

Client::Watch Client::watch_transitions(const std::string& host,
                                        std::function<void(const Transition&)> callback) {
  check_callback(static_cast<bool>(callback));
  if (!host.empty()) worker_->check_watched(host);
  return begin_watch(std::make_shared<TransitionsWatch>(host, std::move(callback)));
}

}  // namespace plchost
