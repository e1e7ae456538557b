#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "instances/plc_app.h"
#include "instances/runtime/areas/area_memory.hpp"
#include "instances/runtime/areas/task_areas.hpp"
#include "instances/runtime/retain/retain_image.hpp"
#include "shm/base/result.hpp"

namespace plchost {

/// The memory in which the variables of retain areas lie while the application runs: a memory of the pool, so
/// that it outlives the process. What it says about itself is checked before use: strangers can write to it.
class KeptMemory {
 public:
  /// "INSTANCE.retain"
  [[nodiscard]] static std::string name_for(const std::string& instance);

  /// What the process before left under that name; nothing: there is none, or none that is whole. Set-up.
  struct Left {
    RetainImage image;         ///< its generation: that of the last one that was written to a file
    std::size_t in_cycle = 0;  ///< tasks that were within a cycle when the process ended
  };
  [[nodiscard]] static std::optional<Left> left_behind(const std::string& pool, const std::string& name);

  /// The one that was left behind, with all that was written into it until now; it has this layout. Set-up.
  [[nodiscard]] static Result<KeptMemory> take_over(const std::string& pool, const std::string& name,
                                                    const RetainLayout& layout);
  /// A new one with these data; what was there under the name goes. It has its name only when it is whole.
  /// Set-up.
  [[nodiscard]] static Result<KeptMemory> make(const std::string& pool, const std::string& name,
                                               const RetainImage& image);

  [[nodiscard]] std::span<std::byte> data() const noexcept;
  /// For a task's cycles. Set-up.
  [[nodiscard]] CycleCounter& counter(std::size_t task) const noexcept;
  /// Of the file that is written next. Soft thread.
  void set_generation(std::uint64_t generation) const noexcept;

  /// The data at `offset` are those of `live`, where the settings of the instance have an area: it is given
  /// them now, and they are taken from there. Set-up.
  void live_elsewhere(std::size_t offset, std::span<std::byte> live);

  /// Copies the data as they are at the end of cycles: no task was within one meanwhile. false: one was, and
  /// the copy is worth nothing. Soft thread.
  [[nodiscard]] bool snapshot(std::span<std::byte> copy) const noexcept;

 private:
  struct Header;
  explicit KeptMemory(AreaMemory memory) : memory_(std::move(memory)) {}
  [[nodiscard]] Header& header() const noexcept;
  static std::size_t bytes_for(std::uint64_t data) noexcept;

  struct Elsewhere {
    std::size_t offset;
    std::span<std::byte> live;
  };
  AreaMemory memory_;
  std::vector<Elsewhere> elsewhere_;
};

}  // namespace plchost
