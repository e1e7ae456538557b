#include "manager/store/store_process.hpp"

#include <algorithm>
#include <utility>

#include <fmt/format.h>
#include <unistd.h>

#include "manager/system/application_trial.hpp"
#include "shm/log/log.hpp"

namespace plchost {

StoreProcess::StoreProcess(Reactor& reactor, DiskThread& disk, Settings settings)
    : disk_(disk), settings_(std::move(settings)), helper_(reactor) {}

Result<void> StoreProcess::keep(const ApplicationOrder& order, const std::string& name, const Loaded& loaded,
                                const LaunchOptions& launch, Done done) {
  StoreOrder store;
  store.folder = settings_.folder;
  // A number and no path: so the API server can only name a shared memory of ours.
  store.source = download_file_name(settings_.pool, order.source);
  store.size = order.size;
  store.digest = order.digest;
  store.name = name;
  store.by = order.by;
  store.from = order.from;
  store.before = loaded.now;
  store.earlier = loaded.earlier;
  store.keep = settings_.keep();
  LaunchOptions trial = launch;
  trial.control_group = settings_.trial_group.begin();
  store.trial = trial_arguments(settings_.plc_instance, trial);
  store.trial_group = trial.control_group;
  auto started = start(store, std::move(done));
  if (!started) settings_.trial_group.end();
  return started;
}

Result<void> StoreProcess::set_boot(const std::string& path, const std::string& configured, Done done) {
  StoreOrder store;
  store.folder = settings_.folder;
  store.boot = path;
  store.configured = configured;
  return start(store, std::move(done));
}

// As if there was nothing, if the disk does not answer.
template <class Answer>
Answer StoreProcess::look(std::function<Answer()> at_folder) const {
  auto answer = disk_.ask<Answer>(kStoreLookLimit, settings_.folder, std::move(at_folder));
  if (answer) return *std::move(answer);
  spdlog::error("the kept applications are not known: {}", answer.error().describe());
  return {};
}

std::string StoreProcess::boot() {
  return look<std::string>([folder = settings_.folder] { return read_boot(folder); });
}

std::optional<ApplicationVersion> StoreProcess::version_at(const std::string& path) {
  return look<std::optional<ApplicationVersion>>(
      [folder = settings_.folder, path] { return plchost::version_at(folder, path); });
}

Result<void> StoreProcess::start(StoreOrder order, Done done) {
  constexpr std::size_t kShown = 4000;
  order.parent = ::getpid();
  return helper_.start({settings_.helper, kStoreOption, encode(order)}, kStoreLimit, kShown,
                       [this, done = std::move(done)](const HelperEnd& end) { ended(end, done); });
}

void StoreProcess::ended(const HelperEnd& end, const Done& done) const {
  settings_.trial_group.end();
  const auto& [status, in_time, output] = end;
  if (status.success()) return done(output);
  if (!in_time) {
    return done(failure(ErrorCode::timed_out,
                        fmt::format("storing it took longer than {} s",
                                    std::chrono::duration_cast<std::chrono::seconds>(kStoreLimit).count())));
  }
  const bool told = status.known && status.kind == ExitStatus::Kind::exited &&
                    status.value <= static_cast<int>(ErrorCode::wrong_size) && !output.empty();
  if (told) return done(failure(static_cast<ErrorCode>(status.value), output));
  done(failure(ErrorCode::system, fmt::format("storing it ended with {}{}{}", status.describe(),
                                              output.empty() ? "" : ": ", output)));
}

}  // namespace plchost
