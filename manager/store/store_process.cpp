#include "manager/store/store_process.hpp"

#include <algorithm>
#include <csignal>
#include <utility>

#include <fmt/format.h>
#include <sys/epoll.h>

#include "manager/system/application_trial.hpp"

namespace plchost {

StoreProcess::StoreProcess(Reactor& reactor, Settings settings)
    : reactor_(reactor), settings_(std::move(settings)), timer_(reactor, [this] {
        timed_out_ = true;
        if (process_) (void)signal_process(*process_, SIGKILL);  // ended() says the rest
      }) {}

Result<void> StoreProcess::keep(const ApplicationOrder& order, const std::string& name,
                                const std::string& before, const LaunchOptions& launch, Done done) {
  StoreOrder store;
  store.folder = settings_.folder;
  // A number and no path: what the API server names is a shared memory of ours, whatever it says.
  store.source = download_file_name(settings_.pool, order.source);
  store.size = order.size;
  store.digest = order.digest;
  store.name = name;
  store.by = order.by;
  store.from = order.from;
  store.before = before;
  store.keep = settings_.keep();
  store.trial = trial_arguments(settings_.plc_instance, launch);
  return start(store, std::move(done));
}

Result<void> StoreProcess::set_boot(const std::string& path, const std::string& configured, Done done) {
  StoreOrder store;
  store.folder = settings_.folder;
  store.boot = path;
  store.configured = configured;
  return start(store, std::move(done));
}

std::string StoreProcess::boot() {
  return read_boot(settings_.folder);
}

std::optional<ApplicationVersion> StoreProcess::version_at(const std::string& path) {
  return plchost::version_at(settings_.folder, path);
}

Result<void> StoreProcess::start(const StoreOrder& order, Done done) {
  if (process_) return failure(ErrorCode::busy, "another application is being stored");
  auto pipe = make_output_pipe();
  if (!pipe) return std::unexpected(pipe.error());
  auto process = spawn_process(
      {.arguments = {settings_.helper, kStoreOption, encode(order)}, .output_fd = pipe->write_end.get()});
  if (!process) return std::unexpected(process.error());
  auto watch = reactor_.watch(process->pidfd.get(), EPOLLIN, [this](std::uint32_t) { ended(); });
  if (!watch) {
    (void)signal_process(*process, SIGKILL);
    return std::unexpected(watch.error());
  }
  process_ = std::move(*process);
  watch_ = std::move(*watch);
  output_ = std::move(pipe->read_end);
  done_ = std::move(done);
  timed_out_ = false;
  timer_.set(MonotonicClock::now() + kStoreLimit);
  return {};
}

void StoreProcess::ended() {
  constexpr std::size_t kShown = 4000;
  const ExitStatus status = reap_process(*process_);
  const std::string output = read_available(output_.get(), kShown);
  timer_.cancel();
  watch_.reset();
  output_.reset();
  process_.reset();
  const Done done = std::exchange(done_, nullptr);
  if (status.success()) return done(output);
  if (timed_out_) {
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
