#include "shm/pages/host_page.hpp"

#include <algorithm>
#include <cassert>
#include <cstddef>
#include <cstring>
#include <type_traits>

#include <fmt/format.h>

#include "shm/files/fixed_page.hpp"

namespace plchost {

namespace {

constexpr PageKind kHostPageKind{.what = "host page",
                                 .magic = 0x65676170'74736f68,  // "hostpage"
                                 .version = 4};  // 1: first; 2: InstancePlan; 3: removed; 4: schedulers

static_assert(offsetof(HostPageLayout, version) == 8 && offsetof(HostPageLayout, changes) == 16);
static_assert(sizeof(InstancePlan) == 2616 && sizeof(InstanceStatus) == 3224 && sizeof(HostStatus) == 624);

HostPageLayout& host_layout_of(const MemoryFile& memory) noexcept {
  return *reinterpret_cast<HostPageLayout*>(memory.bytes().data());
}

template <class Status>
bool holds(const Seqlock<Status>& place, const Status& status) noexcept {
  static_assert(std::has_unique_object_representations_v<Status>);
  const auto seen = place.read();
  return seen && place.is_written() && std::memcmp(&*seen, &status, sizeof status) == 0;
}

// Readers refuse a status with other texts: a path may be of any bytes, and a long text is cut within a
// letter.
template <std::size_t Max>
void make_printable(FixedText<Max>& text) noexcept {
  if (is_printable_utf8(text.view())) return;
  const auto strange = [](char c) { return c != '\0' && (c < ' ' || c > '~'); };
  std::ranges::replace_if(text.bytes, strange, '?');
}

bool is_printable(const HostStatus& status) noexcept {
  return is_printable_utf8(status.name.view()) && is_printable_utf8(status.version.view()) &&
         is_printable_utf8(status.schedulers.view());
}

bool is_printable(const InstancePlan& plan) noexcept {
  return is_printable_utf8(plan.priority_band.view()) && is_printable_utf8(plan.settings.view()) &&
         is_printable_utf8(plan.application.view()) && is_printable_utf8(plan.after.view());
}

bool is_printable(const InstanceStatus& status) noexcept {
  return is_printable_utf8(status.name.view()) && is_printable_utf8(status.scheduler.view()) &&
         is_printable_utf8(status.application.view()) && is_printable_utf8(status.problem.view()) &&
         is_printable(status.plan);
}

}  // namespace

std::string_view to_string(InstanceState state) noexcept {
  switch (state) {
    case InstanceState::offline:
      return "offline";
    case InstanceState::starting:
      return "starting";
    case InstanceState::running:
      return "running";
    case InstanceState::stopped:
      return "stopped";
    case InstanceState::stopping:
      return "stopping";
    case InstanceState::waiting:
      return "waiting";
    case InstanceState::safe_mode:
      return "safe mode";
    case InstanceState::failed:
      return "failed";
    case InstanceState::exception:
      return "exception";
  }
  return "unknown";
}

std::string host_page_name(std::string_view pool) {
  return fmt::format("{}.host", pool);
}

Result<HostPageWriter> HostPageWriter::create(std::string_view pool) {
  const std::string name = host_page_name(pool);
  PLCHOST_TRY_ASSIGN(auto memory,
                     open_or_make_page<HostPageLayout>(name, kHostPageKind, Replaces::anything,
                                                       leave_empty<HostPageLayout>, managers_page()));
  HostPageLayout& page = host_layout_of(memory);  // of a manager that ended while it wrote, perhaps
  page.host.recover();
  for (auto& instance : page.instances) instance.recover();
  return HostPageWriter(name, std::move(memory));
}

void HostPageWriter::remove(std::string_view pool) noexcept {
  MemoryFile::remove(host_page_name(pool));
}

void HostPageWriter::write_host(const HostStatus& status) noexcept {
  host_ = status;
  make_printable(host_.name);
  make_printable(host_.version);
  make_printable(host_.schedulers);
  HostPageLayout& page = host_layout_of(memory_);
  for (std::uint32_t index = 0; index < std::min(host_.instance_count, kMaxInstances); ++index) {
    if (!page.instances[index].is_written()) page.instances[index].write(instances_[index]);
  }
  page.host.write(host_);
  page.changes.fetch_add(1, std::memory_order_release);
}

void HostPageWriter::write_instance(std::uint32_t index, const InstanceStatus& status) noexcept {
  assert(index < kMaxInstances);
  InstanceStatus& kept = instances_[index];
  kept = status;
  make_printable(kept.name);
  make_printable(kept.scheduler);
  make_printable(kept.application);
  make_printable(kept.problem);
  make_printable(kept.plan.priority_band);
  make_printable(kept.plan.settings);
  make_printable(kept.plan.application);
  make_printable(kept.plan.after);
  HostPageLayout& page = host_layout_of(memory_);
  page.instances[index].write(kept);
  page.changes.fetch_add(1, std::memory_order_release);
}

bool HostPageWriter::keep() {
  if (!holds(host_layout_of(memory_).host, host_) && memory_.lost()) {
    auto fresh = MemoryFile::replace(name_, sizeof(HostPageLayout), new_page<HostPageLayout>(kHostPageKind),
                                     managers_page().memory);
    if (!fresh) return true;
    memory_ = std::move(*fresh);
  }
  HostPageLayout& page = host_layout_of(memory_);
  bool changed = !is_described(page, kHostPageKind);
  if (changed) describe_page(page, kHostPageKind);
  if (!holds(page.host, host_)) {
    page.host.recover();
    write_host(host_);
    changed = true;
  }
  for (std::uint32_t index = 0; index < std::min(host_.instance_count, kMaxInstances); ++index) {
    if (holds(page.instances[index], instances_[index])) continue;
    page.instances[index].recover();
    write_instance(index, instances_[index]);
    changed = true;
  }
  return changed;
}

Result<HostPageReader> HostPageReader::open(std::string_view pool) {
  PLCHOST_TRY_ASSIGN(auto memory,
                     open_fixed_page<HostPageLayout>(host_page_name(pool), kHostPageKind,
                                                     MemoryFile::Access::read_only, is_own_or_roots));
  return HostPageReader(std::move(memory));
}

std::uint64_t HostPageReader::changes() const noexcept {
  return host_layout_of(memory_).changes.load(std::memory_order_acquire);
}

std::optional<HostStatus> HostPageReader::host() const noexcept {
  const auto& place = host_layout_of(memory_).host;
  auto status = place.read();
  if (!place.is_written() || memory_.lost()) return std::nullopt;
  if (status && (status->instance_count > kMaxInstances || !is_printable(*status))) return std::nullopt;
  return status;
}

std::optional<InstanceStatus> HostPageReader::instance(std::uint32_t index) const noexcept {
  if (index >= kMaxInstances) return std::nullopt;
  const auto& place = host_layout_of(memory_).instances[index];
  auto status = place.read();
  if (!place.is_written() || memory_.lost()) return std::nullopt;
  if (status && !is_printable(*status)) return std::nullopt;
  return status;
}

std::uint64_t HostPageReader::host_sequence() const noexcept {
  return host_layout_of(memory_).host.sequence();
}

std::uint64_t HostPageReader::instance_sequence(std::uint32_t index) const noexcept {
  assert(index < kMaxInstances);
  return host_layout_of(memory_).instances[index].sequence();
}

}  // namespace plchost
