#include "shm/pool/host_page.hpp"

#include <cassert>
#include <cstddef>
#include <new>

#include <fmt/format.h>

#include "shm/pool/fixed_page.hpp"

namespace plchost {

namespace {

constexpr PageKind kKind{.what = "host page",
                         .magic = 0x65676170'74736f68,  // "hostpage"
                         .version = 1};                 // 1: first

static_assert(offsetof(HostPageLayout, version) == 8 && offsetof(HostPageLayout, changes) == 16);
static_assert(sizeof(InstanceStatus) == 600 && sizeof(HostStatus) == 112);

HostPageLayout& layout_of(const MemoryFile& memory) noexcept {
  return *reinterpret_cast<HostPageLayout*>(memory.bytes().data());
}

Result<MemoryFile> open_page(const std::string& name, MemoryFile::Access access) {
  return open_fixed_page<HostPageLayout>(name, kKind, access);
}

Result<void> fill(std::span<std::byte> bytes) {
  auto* const page = new (bytes.data()) HostPageLayout;
  page->version = kKind.version;
  page->size = sizeof(HostPageLayout);
  page->magic = kKind.magic;
  return {};
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
  if (auto found = open_page(name, MemoryFile::Access::read_write)) {
    HostPageLayout& page = layout_of(*found);
    page.host.recover();
    for (auto& instance : page.instances) instance.recover();
    return HostPageWriter(std::move(*found));
  }
  auto memory = MemoryFile::replace(name, sizeof(HostPageLayout), fill);
  if (!memory) return std::unexpected(memory.error());
  return HostPageWriter(std::move(*memory));
}

void HostPageWriter::remove(std::string_view pool) noexcept {
  MemoryFile::remove(host_page_name(pool));
}

void HostPageWriter::write_host(const HostStatus& status) noexcept {
  HostPageLayout& page = layout_of(memory_);
  page.host.write(status);
  page.changes.fetch_add(1, std::memory_order_release);
}

void HostPageWriter::write_instance(std::uint32_t index, const InstanceStatus& status) noexcept {
  assert(index < kMaxInstances);
  HostPageLayout& page = layout_of(memory_);
  page.instances[index].write(status);
  page.changes.fetch_add(1, std::memory_order_release);
}

Result<HostPageReader> HostPageReader::open(std::string_view pool) {
  auto memory = open_page(host_page_name(pool), MemoryFile::Access::read_only);
  if (!memory) return std::unexpected(memory.error());
  return HostPageReader(std::move(*memory));
}

std::uint64_t HostPageReader::changes() const noexcept {
  return layout_of(memory_).changes.load(std::memory_order_acquire);
}

std::optional<HostStatus> HostPageReader::host() const noexcept {
  auto status = layout_of(memory_).host.read();
  if (status && status->instance_count > kMaxInstances) return std::nullopt;
  return status;
}

std::optional<InstanceStatus> HostPageReader::instance(std::uint32_t index) const noexcept {
  if (index >= kMaxInstances) return std::nullopt;
  return layout_of(memory_).instances[index].read();
}

}  // namespace plchost
