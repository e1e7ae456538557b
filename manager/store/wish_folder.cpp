#include "manager/store/wish_folder.hpp"

#include <condition_variable>
#include <csignal>
#include <filesystem>
#include <mutex>
#include <optional>
#include <system_error>
#include <thread>
#include <utility>

#include <fmt/format.h>
#include <pthread.h>

#include "shm/base/replace_file.hpp"

namespace plchost {

namespace {

Result<LockFile> take_in(const std::string& folder, const WishFolderLock::Take& take_file) {
  if (auto made = make_wish_folder(folder); !made) return std::unexpected(made.error());
  return take_file(folder + "/manager.lock");
}

// Signals are for the thread that reads them.
Result<void> start_without_signals(const std::function<void()>& work) {
  sigset_t all{};
  sigset_t before{};
  ::sigfillset(&all);
  ::pthread_sigmask(SIG_SETMASK, &all, &before);
  std::error_code error;
  try {
    std::thread(work).detach();
  } catch (const std::system_error& thrown) {
    error = thrown.code();
  }
  ::pthread_sigmask(SIG_SETMASK, &before, nullptr);
  if (error) return failure(ErrorCode::system, "start a thread", error.value());
  return {};
}

}  // namespace

std::string wishes_folder(std::string_view state_directory, std::string_view host) {
  return fmt::format("{}/wishes.{}", state_directory, host);
}

Result<void> make_wish_folder(const std::string& folder) {
  std::error_code error;
  if (std::filesystem::is_directory(folder, error)) return {};
  std::filesystem::create_directories(folder, error);
  if (error) return failure(ErrorCode::system, "make folder " + folder, error.value());
  std::filesystem::permissions(folder, std::filesystem::perms::owner_all, error);
  if (error) return failure(ErrorCode::system, "set the rights of " + folder, error.value());
  return sync_directory(std::filesystem::path(folder).parent_path());
}

struct WishFolderLock::Attempt {
  std::mutex mutex;
  std::condition_variable made;
  std::optional<Result<LockFile>> outcome;
};

Result<void> WishFolderLock::take(const std::string& folder, Duration limit, const Take& take_file) {
  auto attempt = attempt_ = std::make_shared<Attempt>();
  const auto work = [attempt, folder, take_file] {
    auto outcome = take_in(folder, take_file);
    const std::scoped_lock lock(attempt->mutex);
    attempt->outcome = std::move(outcome);
    attempt->made.notify_one();
  };
  // A disk that hangs keeps that thread waiting, and nothing else.
  if (auto started = start_without_signals(work); !started) return started;
  std::unique_lock lock(attempt->mutex);
  if (!attempt->made.wait_for(lock, limit, [&] { return attempt->outcome.has_value(); })) {
    return failure(ErrorCode::timed_out,
                   fmt::format("{}: the disk has not answered within {} ms", folder,
                               std::chrono::duration_cast<std::chrono::milliseconds>(limit).count()));
  }
  const Result<LockFile>& outcome = *attempt->outcome;
  if (outcome) return {};
  if (outcome.error().code != ErrorCode::already_exists) return std::unexpected(outcome.error());
  return failure(ErrorCode::already_exists,
                 fmt::format("another manager keeps what instances are to be in {}: {}; give [host] "
                             "state_directory another folder, or [host] name another name",
                             folder, outcome.error().message));
}

}  // namespace plchost
