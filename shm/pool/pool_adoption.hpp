#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include <dirent.h>
#include <time.h>

#include "shm/base/result.hpp"
#include "shm/files/memory_rights.hpp"
#include "shm/pool/pool_segment.hpp"

namespace plchost {

/// Where the pool's table and the files of its memories disagree. Firmware that knows only a C header
/// (shm/plc_process_image.h, shm/plc_reference_clock.h) makes a file without an entry: it becomes a kept
/// object, with the rights of the file. Somebody removes a file: its entry goes. A file of another user
/// cannot be removed from the sticky folder: its entry stays, unseen, until a process can, or it is used
/// again.
///
/// Only a file that says what it is, and whose owner may write the pool, is taken. Set-up.
class PoolAdoption {
 public:
  explicit PoolAdoption(std::shared_ptr<PoolSegment> segment) noexcept : segment_(std::move(segment)) {}

  /// For a call that has not found a memory, or not its file: repairs the entry or the file. True: look
  /// again. Waits up to 20 ms for a file that is just being made.
  [[nodiscard]] static bool reconcile(PoolSegment& segment, std::string_view name);

  /// Of a file: whether it becomes an object.
  [[nodiscard]] static bool is_for_adoption(const std::string& path, const std::string& pool);
  /// The same, or it belongs to CmpBlkDrvShm: no memory may take its name.
  [[nodiscard]] static bool is_in_use(const std::string& path, const std::string& pool);

  /// The entry is that of a memory that has gone, whose file could not be removed.
  [[nodiscard]] static bool is_left_over(const ObjectEntry& entry) noexcept;
  /// Removes it, or makes its file one of `size` zeros again, with `attributes`; null: it
  /// was removed. refused: neither is possible; the text names the users that can do it.
  [[nodiscard]] static Result<ObjectEntry*> use_again(PoolSegment& segment, PoolLock& held,
                                                      ObjectEntry& entry, std::size_t size,
                                                      const MemoryRights& rights, std::uint32_t attributes);

  // For the process that watches over the host; each call goes on where the one before ended.
  /// Some files of the pool; takes the lock where one is to become an object.
  void look_at_files();
  /// Some entries; without the lock: those that may be left over.
  [[nodiscard]] std::vector<ObjectEntry*> look_at_entries();

 private:
  struct Close {
    void operator()(DIR* folder) const noexcept { ::closedir(folder); }
  };

  std::shared_ptr<PoolSegment> segment_;
  std::unique_ptr<DIR, Close> folder_;  // null: all was looked at
  timespec changed_{};                  // the folder, before it was looked at last
  std::size_t next_entry_ = 0;
};

}  // namespace plchost
