#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "shm/base/result.hpp"
#include "shm/files/memory_rights.hpp"

namespace plchost {

/// Outputs that an instance has, as they are told to another process for the case that it ends before it can
/// put them into their safe state itself.
struct LeftOutputs {
  std::string object;  ///< an image in the pool, which holds its safe values; empty: registers
  std::string device;  ///< registers: the device or file
  std::uint64_t address = 0;
  std::vector<std::byte> values;  ///< for the registers
};

/// The outputs of one instance, in a file that outlives a process which is killed. Only the user of the
/// process can write it: another process opens the devices that it names.
class OutputsPage {
 public:
  /// At most: one for each area that an application can declare.
  static constexpr std::size_t kMost = 64;

  /// Takes the place of the page of the process before. Set-up.
  [[nodiscard]] static Result<OutputsPage> create(std::string_view pool, std::string_view instance,
                                                  std::span<const LeftOutputs> outputs);
  OutputsPage(OutputsPage&& other) noexcept : name_(std::exchange(other.name_, std::string())) {}
  OutputsPage& operator=(OutputsPage&& other) noexcept {
    std::swap(name_, other.name_);
    return *this;
  }
  /// Removes it: the outputs are safe.
  ~OutputsPage();

  /// It stays where it is: the outputs may be written once more before the process has ended.
  void leave() noexcept { name_.clear(); }
  static void remove(std::string_view pool, std::string_view instance) noexcept;

 private:
  explicit OutputsPage(std::string name) noexcept : name_(std::move(name)) {}
  std::string name_;  // empty: nothing to remove
};

[[nodiscard]] std::string outputs_page_name(std::string_view pool, std::string_view instance);

/// Puts the outputs of an instance whose process has ended into their safe state, and removes its page. If
/// there is none, the process has done so itself, or has no outputs; while it runs, nothing is done.
/// Outputs that cannot be put there are logged. A page of another owner than `owners` is not used. Takes
/// microseconds for images. Set-up.
void end_outputs(std::string_view pool, std::string_view instance,
                 const OwnerCheck& owners = is_trusted_owner);

}  // namespace plchost
