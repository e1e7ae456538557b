#pragma once

#include <cstddef>
#include <cstdint>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "instances/io/modbus/config/modbus_config.hpp"
#include "shm/base/time.hpp"
#include "shm/files/memory_file.hpp"

namespace plchost::modbus {

/// A memory area of an instance that lies in the pool, as it is at the moment: tasks write it whenever they
/// like. Of values with an address that is a multiple of their size no half is seen, in either direction. Any
/// thread.
class MemoryImage {
 public:
  MemoryImage(std::string pool, std::string name, std::uint32_t size)
      : pool_(std::move(pool)), name_(std::move(name)), bytes_(size) {}

  /// There is a process image of this name. Set-up.
  [[nodiscard]] static bool is_process_image(const std::string& pool, const std::string& name);

  /// It will be written, too. Set-up.
  void make_writable() noexcept { access_ = MemoryFile::Access::read_write; }

  /// Writes values of a map that lies in it, and no bit beside them: tasks may write there meanwhile.
  /// `first`: of them, within the map. False: as look().
  [[nodiscard]] bool put_registers(const RegisterMap& map, std::uint32_t first,
                                   std::span<const std::uint16_t> registers);
  [[nodiscard]] bool put_bits(const RegisterMap& map, std::uint32_t first,
                              std::span<const std::uint8_t> bits);

  /// Calls `look` with the bytes. False: there is no such memory, it is shorter, or it is a process image;
  /// the log says why.
  template <class Look>
  bool look(const Look& look) {
    const std::lock_guard lock(mutex_);
    if (!refresh()) return false;
    look(std::span<const std::byte>(bytes_));
    return true;
  }

 private:
  bool refresh();
  void repair();

  std::string pool_;
  std::string name_;
  MemoryFile::Access access_ = MemoryFile::Access::read_only;
  std::mutex mutex_;
  std::optional<MemoryFile> memory_;
  std::vector<std::byte> bytes_;
  TimePoint looked_at_;   ///< whether the name leads to another file
  TimePoint tell_again_;  ///< that there is none
  std::string told_;      ///< why
};

}  // namespace plchost::modbus
