#include "shm/pool/pool_clients.hpp"

#include <cerrno>

#include <fmt/format.h>

#include "shm/base/names.hpp"
#include "shm/base/wrapping.hpp"
#include "shm/threads/process_start.hpp"

namespace plchost {

namespace {

bool is_gone(ClientSlot& client, const ClientLocks* locks, TimePoint now, bool thoroughly) noexcept {
  if (client.ended.load(kRelaxed) != 0) return true;
  const std::int64_t age =
      wrapping_difference(now.time_since_epoch().count(), client.looked_ns.load(kRelaxed));
  const bool looked_lately = age >= 0 && age < PoolClients::kLook.count();
  const ProcessLook look = looked_lately && !thoroughly ? ProcessLook::quick : ProcessLook::thorough;
  if (look == ProcessLook::thorough) client.looked_ns.store(now.time_since_epoch().count(), kRelaxed);
  return client_has_ended({.pid = static_cast<pid_t>(client.pid.load(kRelaxed)),
                           .image = client.image.load(kRelaxed),
                           .start = client.start.load(kRelaxed)},
                          locks, look);
}

}  // namespace

bool client_has_ended(const ProcessIdentity& client, const ClientLocks* locks, ProcessLook look) noexcept {
  if (locks == nullptr) return process_has_ended(client, look);
  return client.start > ClientMutex::kMaxClient || !locks->lives(static_cast<std::uint32_t>(client.start));
}

ClientSlot* PoolClients::join(const ProcessIdentity& self, std::string_view name) noexcept {
  for (ClientSlot& client : view_.clients()) {
    if (client.pid.load(kRelaxed) != 0) continue;
    client.generation.fetch_add(1, kRelaxed);
    client.start.store(self.start, kRelaxed);
    client.image.store(self.image, kRelaxed);
    client.ended.store(0, kRelaxed);
    client.looked_ns.store(MonotonicClock::now().time_since_epoch().count(), kRelaxed);
    client.released.store(0, kRelaxed);
    client.reference_count.store(0, kRelaxed);
    client.name.assign(name);
    journal_.set(client.pid, static_cast<std::uint32_t>(self.pid));
    const std::uint32_t link = view_.link_to(client);
    Link& high_water = view_.header().client_high_water;
    if (high_water.load(kRelaxed) < link) journal_.set(high_water, link);
    return &client;
  }
  return nullptr;
}

bool PoolClients::sweep(TimePoint now, bool thoroughly, const std::function<bool(ClientSlot&)>& bury) {
  bool all = true;
  for (ClientSlot& client : view_.used_clients()) {
    if (client.pid.load(kRelaxed) == 0) continue;
    if (!is_gone(client, locks_, now, thoroughly)) continue;
    client.ended.store(1, kRelaxed);
    if (!bury(client)) {
      all = false;
      continue;
    }
    journal_.set(client.pid, 0);
    journal_.commit();
    view_.header().departed.fetch_add(1, kRelaxed);
  }
  return all;
}

// Its slot may be another one's while it is read: the name is checked, the rest does not matter.
std::string PoolClients::describe(std::uint32_t number) const {
  const pid_t seen = locks_ == nullptr ? 0 : locks_->seen_as(number);
  std::string name;
  for (const ClientSlot& client : view_.used_clients()) {
    if (client.pid.load(kRelaxed) == 0 || client.start.load(kRelaxed) != number) continue;
    name = shown(client.name.view());
  }
  if (seen > 0) return fmt::format("process {} ({})", seen, name.empty() ? "no client" : name);
  return name.empty() ? "a process of another container"
                      : fmt::format("program '{}' of another container", name);
}

std::string_view program_name() noexcept {
  return ::program_invocation_short_name;
}

}  // namespace plchost
