#include "shm/block_driver/remote_names.hpp"

#include <algorithm>
#include <array>
#include <atomic>

#include <fmt/format.h>

#include "shm/base/crc32c.hpp"
#include "shm/base/seqlock.hpp"
#include "shm/files/fixed_page.hpp"
#include "shm/files/pool_files.hpp"

namespace plchost {

struct RemoteNamesLayout {
  std::uint64_t magic = 0;
  std::uint32_t version = 0;
  std::uint32_t size = 0;
  // Of each node, so that few names are looked at. 0: there is none.
  std::array<std::atomic<std::uint32_t>, RemoteNames::kMost> numbers;
  std::array<Seqlock<RemoteNode>, RemoteNames::kMost> nodes;
};

namespace {

constexpr PageKind kRemoteNames{
    .what = "list of nodes of other hosts", .magic = 0x656d616e'6b6c6270, .version = 1};  // "pblkname"

std::uint32_t number_of(std::string_view name, std::string_view host) noexcept {
  std::uint32_t number = crc32c(std::as_bytes(std::span(name)));
  number = crc32c(std::as_bytes(std::span(host)), number);
  return number == 0 ? 1 : number;
}

}  // namespace

RemoteNode RemoteNode::of(std::string_view host, std::string_view name, NodeAddress address) {
  RemoteNode node;
  node.host.assign(host);
  node.name.assign(name);
  node.address = address.number();
  return node;
}

RemoteNamesLayout& RemoteNames::layout() const noexcept {
  return *reinterpret_cast<RemoteNamesLayout*>(file_.bytes().data());
}

Result<RemoteNames> RemoteNames::open(std::string_view pool, std::string_view base) {
  const std::string name = pool_memory_name(pool, fmt::format("{}.hosts", base));
  PLCHOST_TRY_ASSIGN(auto file, in_step("nodes of other hosts", open_or_make_page<RemoteNamesLayout>(
                                                                    name, kRemoteNames, Replaces::foreign)));
  return RemoteNames(std::move(file));
}

void RemoteNames::write(std::span<const RemoteNode> nodes) noexcept {
  RemoteNamesLayout& names = layout();
  for (std::size_t i = 0; i < kMost; ++i) {
    std::uint32_t number = 0;
    if (i < nodes.size()) {
      number = number_of(nodes[i].name.view(), nodes[i].host.view());
      names.nodes[i].recover();  // the writer before may have ended in here
      names.nodes[i].write(nodes[i]);
    }
    // Release: a reader that sees the number sees the name.
    names.numbers[i].store(number, std::memory_order_release);
  }
}

std::optional<NodeAddress> RemoteNames::find(std::string_view text) const noexcept {
  const std::size_t at = text.find('@');
  if (at == std::string_view::npos) return std::nullopt;
  const std::string_view name = text.substr(0, at);
  const std::string_view host = text.substr(at + 1);
  const std::uint32_t number = number_of(name, host);
  const RemoteNamesLayout& names = layout();
  constexpr int kAttempts = 3;  // bounded also where a stranger has written
  for (std::size_t i = 0; i < kMost; ++i) {
    if (names.numbers[i].load(std::memory_order_acquire) != number) continue;
    const auto node = names.nodes[i].read(kAttempts);
    if (!node || node->name.view() != name || node->host.view() != host) continue;
    const NodeAddress address = NodeAddress::from_number(node->address);
    if (address.valid() && !address.to_all() && address.host != 0) return address;
  }
  return std::nullopt;
}

}  // namespace plchost
