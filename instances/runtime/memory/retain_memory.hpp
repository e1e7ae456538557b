#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "instances/plc_app.h"
#include "instances/runtime/memory/retain_group.hpp"
#include "instances/runtime/memory/retain_image.hpp"
#include "instances/runtime/memory/task_areas.hpp"
#include "shm/base/result.hpp"
#include "shm/pool/object_pool.hpp"

namespace plchost {

/// The memory in which the variables of retain areas lie while the application runs: a memory of the pool, so
/// that it outlives the process. Its header is checked before use: strangers can write to it.
class RetainMemory {
 public:
  /// The data that the process before left under that name. not_found: there is none. corrupt: none that is
  /// whole. Set-up.
  struct Left {
    RetainImage image;         ///< its generation: that of the last one that was written to a file
    std::size_t in_cycle = 0;  ///< tasks that were within a cycle when the process ended
  };
  [[nodiscard]] static Result<Left> left_behind(const std::string& pool, const std::string& name);

  /// The one that was left behind, with all that was written into it until now; it has this layout. Set-up.
  [[nodiscard]] static Result<RetainMemory> take_over(ObjectPool& pool, const std::string& name,
                                                      const RetainLayout& layout);
  /// A new one with these data. Until publish() no other process sees it. wrong_type: another object has the
  /// name. Set-up.
  [[nodiscard]] static Result<RetainMemory> prepare(ObjectPool& pool, const std::string& name,
                                                    const RetainImage& image);
  /// It has the name from now on, and the one before goes. Nothing happens to one that was taken over.
  /// Set-up.
  [[nodiscard]] Result<void> publish(ObjectPool& pool, const std::string& name);

  /// Of the whole memory, for so many bytes of data.
  [[nodiscard]] static std::size_t bytes_for(std::uint64_t data) noexcept;
  [[nodiscard]] std::span<std::byte> data() const noexcept;
  /// For a task's cycles. Set-up.
  [[nodiscard]] CycleCounter& counter(std::size_t task) const noexcept;
  /// Of the file that is written next. Soft thread.
  void set_generation(std::uint64_t generation) const noexcept;

  /// The data at `offset` are those of `live`, where the settings of the instance have an area: it is given
  /// them now, and they are taken from there. Set-up.
  void live_elsewhere(std::size_t offset, std::span<std::byte> live);

  /// Data that these tasks may change, and no others: stretches of offset and bytes, one for each area.
  /// Set-up, after live_elsewhere().
  void add_group(const std::vector<std::size_t>& tasks,
                 const std::vector<std::pair<std::size_t, std::size_t>>& stretches);
  /// Each stretch of the data is in one of them.
  [[nodiscard]] std::deque<RetainGroup>& groups() noexcept { return groups_; }
  /// False: another program has cut or overwritten the memory, or one in which an area lies elsewhere. Its
  /// contents are worth nothing, and so is a copy that was made before this was asked. Soft thread.
  [[nodiscard]] bool is_whole() const noexcept;
  /// Areas that lie elsewhere are in the memory as they were copied. Soft thread.
  void copy_elsewhere(std::span<const std::byte> taken) const noexcept;

  /// Copies the data as they are at the end of cycles: no task was within one meanwhile. false: one was, and
  /// the copy is worth nothing. Soft thread.
  [[nodiscard]] bool snapshot(std::span<std::byte> copy) const noexcept;

 private:
  struct Header;
  explicit RetainMemory(SharedMemory memory) noexcept : memory_(std::move(memory)), bytes_(memory_.bytes()) {}
  explicit RetainMemory(UnnamedMemory prepared) noexcept
      : prepared_(std::move(prepared)), bytes_(prepared_->bytes()) {}
  [[nodiscard]] Header& header() const noexcept;

  struct Elsewhere {
    std::size_t offset;
    std::span<std::byte> live;
  };
  SharedMemory memory_;
  std::optional<UnnamedMemory> prepared_;  // until publish()
  std::span<std::byte> bytes_;             // of one of them
  std::vector<Elsewhere> elsewhere_;
  std::deque<RetainGroup> groups_;
};

}  // namespace plchost
