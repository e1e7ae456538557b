#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "manager/store/instance_wish.hpp"
#include "shm/files/memory_file.hpp"

namespace plchost {

/// An instance's wish in the memory of the host, "POOL.wish.INSTANCE". It has two places, and each write goes
/// to both, one after the other. So a manager that is killed within a write leaves a whole one. If another
/// program damages one place, the other one counts.
class WishMemory {
 public:
  /// Goes on with one that is there; makes it anew if it is damaged. corrupt: it is damaged, and cannot be
  /// made anew.
  [[nodiscard]] static Result<WishMemory> open(std::string_view pool, std::string_view instance);
  static void remove(std::string_view pool, std::string_view instance) noexcept;
  /// Of a pool: the instances that have one.
  [[nodiscard]] static std::vector<std::string> instances(std::string_view pool);

  /// The newest whole one; nothing: none was written, or it is damaged.
  [[nodiscard]] std::optional<InstanceWish> read() const { return newest().wish; }
  /// Something was written, and none of it is whole: another program has written over it, or over the head
  /// of the memory, so that open() has made it anew. Until the next write() each open() finds it so.
  [[nodiscard]] bool damaged() const {
    const Found found = newest();
    return !found.wish && found.any;
  }
  /// It is in both places when this returns. full: the text has more than kMaxWishBytes.
  [[nodiscard]] Result<void> write(const InstanceWish& wish);
  /// Looks at what this object has found or written last, and writes it anew where another program has
  /// written over it. Whether one had. system: the memory was cut short, and cannot be made anew.
  [[nodiscard]] Result<bool> mend();

 private:
  struct Layout;
  struct Found {
    std::optional<InstanceWish> wish;
    std::string text;              ///< of `wish`
    std::uint64_t generation = 0;  ///< of `wish`
    std::size_t place = 0;         ///< of `wish`
    bool any = false;              ///< something was written
  };
  [[nodiscard]] Found newest() const;
  WishMemory(std::string name, MemoryFile memory) noexcept
      : name_(std::move(name)), memory_(std::move(memory)) {}
  [[nodiscard]] Layout& layout() const noexcept;
  [[nodiscard]] bool holds(std::size_t place) const;
  void fill(std::size_t place);

  std::string name_;
  MemoryFile memory_;
  std::uint64_t generation_ = 0;
  std::string text_;  // as it was found or written last; empty: never
};

}  // namespace plchost
