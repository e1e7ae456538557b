#pragma once

#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "shm/base/result.hpp"
#include "shm/block_driver/block_link.hpp"
#include "shm/block_driver/directory_layout.hpp"
#include "shm/block_driver/node_locks.hpp"
#include "shm/files/memory_file.hpp"
#include "shm/threads/process_start.hpp"

namespace plchost {

/// A base name in a pool, if `[CmpBlkDrvShm] BaseName` says nothing else.
inline constexpr std::string_view kDefaultBlockBase = "blocks";
inline constexpr std::size_t kMaxBlockBase = 31;

/// A node's claims when it joins.
struct NodeEntry {
  std::string name;                ///< 1 to kMaxInstanceName characters, see check_name
  std::uint16_t forced_address{};  ///< 1 to kMaxNodes; 0: any that is free
  bool forwards = true;
  std::uint32_t queue_slots = 1024;
  std::vector<HostRange> hosts = {};  ///< that are reached through it; at most kMaxHostRanges
};

/// The nodes of a pool that talk under one base name. All functions are set-up (soft threads) unless they say
/// otherwise.
class NodeDirectory {
 public:
  /// Makes it if it is not there, and mends what it says of itself. corrupt: there is something else of that
  /// name, or a directory that is in use by nodes of another version.
  [[nodiscard]] static Result<NodeDirectory> open(std::string_view pool,
                                                  std::string_view base = kDefaultBlockBase);
  /// Only to look at. not_found: no node has ever joined.
  [[nodiscard]] static Result<NodeDirectory> open_to_read(std::string_view pool,
                                                          std::string_view base = kDefaultBlockBase);
  /// Removes it with all links; processes that have them mapped keep them.
  static void remove(std::string_view pool, std::string_view base = kDefaultBlockBase) noexcept;

  /// Takes an address for this process: the forced one, or the one that the name had before, or a free one
  /// from the upper half of the numbers first. already_exists: the address or the name is taken; the
  /// text names the process that has it. full: all addresses are taken.
  [[nodiscard]] Result<NodeLife> join(const NodeEntry& entry);
  /// Gives the address back.
  void leave(const NodeLife& life);
  /// Writes the record of a node of this process again if it is not what it should be, and what the directory
  /// says of itself.
  /// busy: others cannot see any more that the process runs, as this program has closed the file of its lock.
  [[nodiscard]] Result<void> keep(const NodeLife& life, const NodeEntry& entry);
  /// Takes the addresses from nodes whose processes have ended, and removes their links. Returns the number
  /// of these nodes.
  std::uint32_t reclaim();

  /// Whether the process of that node has ended, by its lock. `look`: at one of a version before, which had
  /// none. False: there is no node.
  [[nodiscard]] bool has_ended(std::uint16_t node, ProcessLook look = ProcessLook::thorough) const;

  /// "process 4711", as the caller sees the one of that node; or why there is no number.
  [[nodiscard]] std::string owner_text(std::uint16_t node) const;

  /// Nothing: the address is free, or the record is not valid. Any context.
  [[nodiscard]] std::optional<NodeRecord> record(std::uint16_t node) const noexcept;
  /// Any context: looks at all of them.
  [[nodiscard]] std::optional<std::uint16_t> find(std::string_view name) const noexcept;
  [[nodiscard]] NodeSlot& slot(std::uint16_t node) const noexcept { return layout().slots[node - 1U]; }
  [[nodiscard]] DirectoryLayout& layout() const noexcept;
  /// Tells all nodes that something has changed.
  void announce() noexcept;

  [[nodiscard]] std::string link(std::uint16_t from, std::uint16_t to) const {
    return link_name(pool_, base_, from, to);
  }
  /// Its file was cut short or removed by a stranger.
  [[nodiscard]] bool lost() const noexcept { return file_.lost(); }

 private:
  NodeDirectory(std::string pool, std::string base, MemoryFile file,
                std::shared_ptr<NodeLocks> locks) noexcept
      : pool_(std::move(pool)), base_(std::move(base)), file_(std::move(file)), locks_(std::move(locks)) {}
  Result<std::uint16_t> choose(const NodeEntry& entry) const;
  Result<std::uint16_t> choose_free(std::string_view name) const;
  void write(std::uint16_t node, const NodeRecord& record) noexcept;
  /// Whether the address is to be had. Its record may have been wiped out while its process runs.
  [[nodiscard]] bool is_free(std::uint16_t node) const noexcept {
    return !record(node) && !locks_->is_taken(node);
  }
  [[nodiscard]] std::shared_ptr<NodeLocks> locks() const;
  bool reclaim_one(std::uint16_t node);
  std::uint32_t reclaim_locked();
  void remove_links(std::uint16_t node) const noexcept;

  std::string pool_;
  std::string base_;
  MemoryFile file_;
  std::shared_ptr<NodeLocks> locks_;  // null: it only reads, and looks for them when it is asked
};

}  // namespace plchost
