#include "manager/store/exception_keeper.hpp"

#include <algorithm>
#include <utility>

#include "manager/store/exception_folder.hpp"
#include "shm/log/log.hpp"
#include "shm/pages/exception_history.hpp"

namespace plchost {

ExceptionKeeper::ExceptionKeeper(WishWriter& writer, DiskThread& disk, Settings settings)
    : writer_(writer), disk_(disk), settings_(std::move(settings)) {}

void ExceptionKeeper::restore(const std::string& instance) {
  const std::string from = kept_exceptions_path(settings_.folder, instance);
  const std::string to = exception_path(settings_.run_directory, instance);
  if (FileVersion::of(to).inode != 0) return;
  const auto answered =
      disk_.ask<Result<void>>(kExceptionLimit, from, [from, to] { return restore_exceptions(from, to); });
  const auto restored = and_then(answered, [](const Result<void>& done) { return done; });
  if (restored) return;
  spdlog::error("instance {}: its exceptions of before the host's start are not shown: {}", instance,
                restored.error().describe());
}

void ExceptionKeeper::look(const std::string& instance, TimePoint now) {
  Watched& watched = watched_[instance];
  if (watched.writing || now < watched.next) return;
  const std::string from = exception_path(settings_.run_directory, instance);
  const FileVersion version = FileVersion::of(from);  // before it is read
  if (version.inode == 0 || watched.kept == version) return;
  watched.writing = true;
  const auto begun = writer_.write(
      {.kind = WishOrder::Kind::exceptions,
       .path = kept_exceptions_path(settings_.folder, instance),
       .text = {},
       .from = from},
      [this, instance, version](const Result<void>& result) { written(instance, version, result); });
  if (!begun) written(instance, version, begun);
}

bool ExceptionKeeper::is_writing() const noexcept {
  return std::ranges::any_of(watched_, [](const auto& each) { return each.second.writing; });
}

void ExceptionKeeper::written(const std::string& instance, const FileVersion& version,
                              const Result<void>& result) {
  Watched& watched = watched_[instance];
  watched.writing = false;
  if (result) {
    watched.kept = version;
    if (!std::exchange(watched.problem, {}).empty())
      spdlog::info("instance {}: its exceptions are on the disk again", instance);
    return;
  }
  watched.next = MonotonicClock::now() + kExceptionRetry;
  const std::string problem = result.error().describe();
  if (std::exchange(watched.problem, problem) != problem)
    spdlog::error("instance {}: a power cut would take its newest exceptions: {}", instance, problem);
}

}  // namespace plchost
