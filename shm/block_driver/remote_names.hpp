#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "shm/base/names.hpp"
#include "shm/base/result.hpp"
#include "shm/block_driver/node_address.hpp"
#include "shm/files/memory_file.hpp"

namespace plchost {

/// A node of another host, for those that know it by its name.
struct RemoteNode {
  FixedText<kMaxHostName> host;
  FixedText<kMaxInstanceName> name;
  std::uint32_t address = 0;  ///< a NodeAddress

  [[nodiscard]] static RemoteNode of(std::string_view host, std::string_view name, NodeAddress address);
};

struct RemoteNamesLayout;

/// The names of the nodes of other hosts, as the gateway tells them to the nodes of its own: one shared
/// memory for each base name of a pool. All values read are checked, strangers may scribble in it.
class RemoteNames {
 public:
  /// More are not found by name.
  static constexpr std::size_t kMost = 1024;

  /// Makes it if it is not there. corrupt: there is something else of that name. Set-up.
  [[nodiscard]] static Result<RemoteNames> open(std::string_view pool, std::string_view base);

  /// Takes the place of all that was there; names beyond kMost are left out. One writer, a soft thread.
  void write(std::span<const RemoteNode> nodes) noexcept;
  /// `text`: "NAME@HOST". Nothing: it is not of that form, or there is no such node. Any context: looks at up
  /// to kMost numbers.
  [[nodiscard]] std::optional<NodeAddress> find(std::string_view text) const noexcept;

 private:
  explicit RemoteNames(MemoryFile file) noexcept : file_(std::move(file)) {}
  [[nodiscard]] RemoteNamesLayout& layout() const noexcept;

  MemoryFile file_;
};

}  // namespace plchost
