#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "manager/system/disk_thread.hpp"
#include "shm/base/result.hpp"
#include "shm/base/time.hpp"
#include "shm/files/lock_file.hpp"

namespace plchost {

/// How long the manager waits for the disk before it starts without the lock of its folder.
inline constexpr Duration kWishFolderLimit = std::chrono::seconds(2);

/// The folder of the files: "STATE_DIRECTORY/wishes.HOST".
[[nodiscard]] std::string wishes_folder(std::string_view state_directory, std::string_view host);

/// Makes the folder for good if it is missing, for this user only. May wait for the disk.
[[nodiscard]] Result<void> make_wish_folder(const std::string& folder);

/// The one manager that writes to a wishes_folder(): it holds "manager.lock" there. Two managers in one
/// folder would undo each other's stops.
class WishFolderLock {
 public:
  using Take = std::function<Result<LockFile>(const std::string& path)>;

  /// already_exists: another manager holds it; the text names the folder and the process. timed_out: the disk
  /// has not answered within `limit`. refused: the lock file is not this user's. system: the folder cannot be
  /// written. A manager starts without the lock after any of these but the first. Set-up; to be called once.
  [[nodiscard]] Result<void> take(DiskThread& disk, const std::string& folder,
                                  Duration limit = kWishFolderLimit, const Take& take_file = LockFile::take);

 private:
  // Of the disk's thread until it has answered; has the lock, also if that comes after the limit.
  std::shared_ptr<std::optional<Result<LockFile>>> outcome_;
};

}  // namespace plchost
