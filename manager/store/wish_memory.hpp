#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "manager/store/instance_wish.hpp"
#include "shm/pool/memory_file.hpp"

namespace plchost {

/// An instance's wish in the memory of the host, "POOL.wish.INSTANCE". It has two places, written in turns: a
/// manager that is killed within a write leaves the one before whole.
class WishMemory {
 public:
  /// Goes on with one that is there; makes it anew if it is damaged.
  [[nodiscard]] static Result<WishMemory> open(std::string_view pool, std::string_view instance);
  static void remove(std::string_view pool, std::string_view instance) noexcept;
  /// Of a pool: the instances that have one.
  [[nodiscard]] static std::vector<std::string> instances(std::string_view pool);

  /// The newest whole one; nothing: none was written, or it is damaged.
  [[nodiscard]] std::optional<InstanceWish> read() const { return newest().wish; }
  /// Something was written, and none of it is whole: another program has written over it.
  [[nodiscard]] bool damaged() const {
    const Found found = newest();
    return found.any && !found.wish;
  }
  /// full: the text has more than kMaxWishBytes.
  [[nodiscard]] Result<void> write(const InstanceWish& wish);

 private:
  struct Layout;
  struct Found {
    std::optional<InstanceWish> wish;
    std::uint64_t generation = 0;  ///< of `wish`
    bool any = false;              ///< something was written
  };
  [[nodiscard]] Found newest() const;
  explicit WishMemory(MemoryFile memory) noexcept : memory_(std::move(memory)) {}
  [[nodiscard]] Layout& layout() const noexcept;

  MemoryFile memory_;
  std::uint64_t generation_ = 0;
};

}  // namespace plchost
