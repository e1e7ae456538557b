#include "manager/store/wish_folder.hpp"

#include <utility>

#include <fmt/format.h>
#include <sys/stat.h>

#include "shm/files/replace_file.hpp"

namespace plchost {

namespace {

Result<LockFile> take_in(const std::string& folder, const WishFolderLock::Take& take_file) {
  PLCHOST_TRY(make_wish_folder(folder));
  return take_file(folder + "/manager.lock");
}

}  // namespace

std::string wishes_folder(std::string_view state_directory, std::string_view host) {
  return fmt::format("{}/wishes.{}", state_directory, host);
}

Result<void> make_wish_folder(const std::string& folder) {
  return make_synced_folders(folder, S_IRWXU);
}

Result<void> WishFolderLock::take(DiskThread& disk, const std::string& folder, Duration limit,
                                  const Take& take_file) {
  auto made = outcome_ = std::make_shared<std::optional<Result<LockFile>>>();
  auto answered =
      disk.within(limit, folder, [made, folder, take_file] { *made = take_in(folder, take_file); });
  if (!answered) return answered;
  const Result<LockFile>& outcome = **made;
  if (outcome) return {};
  if (outcome.error().code != ErrorCode::already_exists) return std::unexpected(outcome.error());
  return failure(ErrorCode::already_exists,
                 fmt::format("another manager keeps the wishes of its instances in {}: {}; give [host] "
                             "state_directory another folder, or [host] name another name",
                             folder, outcome.error().message));
}

}  // namespace plchost
