#include "manager/system/helper_process.hpp"

#include <algorithm>
#include <csignal>
#include <utility>

#include <fcntl.h>
#include <sys/epoll.h>

namespace plchost {

Result<void> HelperProcess::start(const std::vector<std::string>& arguments, Duration limit,
                                  std::size_t most_output, Done done) {
  if (process_) return failure(ErrorCode::busy, "the helper before has not ended: it may wait for a disk");
  PLCHOST_TRY_ASSIGN(auto pipe, make_output_pipe());
  // Its output is read when it has ended: there must be room for it.
  constexpr std::size_t kRoom = std::size_t{1} << 16;
  const auto room = static_cast<int>(std::max(most_output, kRoom));
  (void)::fcntl(pipe.write_end.get(), F_SETPIPE_SZ, room);  // NOLINT: variadic
  PLCHOST_TRY_ASSIGN(auto process,
                     spawn_process({.arguments = arguments, .output_fd = pipe.write_end.get()}));
  auto watch = reactor_.watch(process.pidfd.get(), EPOLLIN, [this](std::uint32_t) { ended(); });
  if (!watch) {
    (void)signal_process(process, SIGKILL);
    return std::unexpected(watch.error());
  }
  process_ = std::move(process);
  watch_ = std::move(*watch);
  output_ = std::move(pipe.read_end);
  most_output_ = most_output;
  in_time_ = true;
  done_ = std::move(done);
  timer_.set(MonotonicClock::now() + limit);
  return {};
}

void HelperProcess::on_limit() {
  if (!std::exchange(in_time_, false)) {  // killed, and has not ended
    if (const Done done = std::exchange(done_, nullptr)) {
      done({.status = {.known = false}, .in_time = false, .output = {}});
    }
    return;
  }
  (void)signal_process(*process_, SIGKILL);
  timer_.set(MonotonicClock::now() + kKillLimit);
}

void HelperProcess::ended() {
  end_session(*process_);
  const HelperEnd end{.status = reap_process(*process_),
                      .in_time = in_time_,
                      .output = read_available(output_.get(), most_output_)};
  timer_.cancel();
  watch_.reset();
  output_.reset();
  process_.reset();
  if (const Done done = std::exchange(done_, nullptr)) done(end);
}

void HelperProcess::give_up() {
  done_ = nullptr;
  timer_.cancel();
  if (process_) (void)signal_process(*process_, SIGKILL);
}

}  // namespace plchost
