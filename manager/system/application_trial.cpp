#include "manager/system/application_trial.hpp"

#include <algorithm>
#include <csignal>
#include <string_view>
#include <utility>

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <unistd.h>

#include "instances/launch/launch_contract.hpp"

namespace plchost {

namespace {

// Nobody reads before the end: the output of an application at its start has to fit.
constexpr int kTrialOutputRoom = 1 << 20;
constexpr std::size_t kShown = 2000;

// In an answer a line break would be shown as a damaged character.
std::string one_line(std::string_view text) {
  std::string line;
  for (const char c : text) {
    if (c == '\n') {
      line += "; ";
    } else {
      line += c;
    }
  }
  return line;
}

}  // namespace

std::vector<std::string> trial_arguments(const std::string& plc_instance, LaunchOptions options) {
  options.application.clear();
  options.report_fd = -1;
  std::vector<std::string> arguments = to_arguments(plc_instance, options);
  arguments.emplace_back("--check-application");
  return arguments;
}

Result<ApplicationTrial> ApplicationTrial::start(std::vector<std::string> arguments, const std::string& path,
                                                 const std::string& group) {
  PLCHOST_TRY_ASSIGN(auto pipe, make_output_pipe());
  (void)::fcntl(pipe.write_end.get(), F_SETPIPE_SZ, kTrialOutputRoom);
  const GroupCounts before = counts_of_group(group);
  arguments.insert(arguments.end(), {path, "--parent", fmt::format("{}", ::getpid())});
  PLCHOST_TRY_ASSIGN(auto process,
                     spawn_process({.arguments = std::move(arguments), .output_fd = pipe.write_end.get()}));
  return ApplicationTrial(path, {group, before}, std::move(process), std::move(pipe.read_end));
}

Duration ApplicationTrial::time_left() const {
  return limit_.left(MonotonicClock::now(), processor_share_of(process_.pid));
}

void ApplicationTrial::await_end() {
  pollfd end{.fd = fd(), .events = POLLIN, .revents = 0};
  const auto ends_within = [&end](Duration time) {
    const auto wait = std::chrono::ceil<std::chrono::milliseconds>(time).count();
    return ::poll(&end, 1, static_cast<int>(wait)) == 1;
  };
  for (Duration left = time_left(); left > Duration::zero(); left = time_left()) {
    if (ends_within(left)) return;
  }
  give_up();
  (void)ends_within(kTrialLimit);
}

void ApplicationTrial::give_up() {
  gave_up_ = true;
  (void)signal_process(process_, SIGKILL);
}

std::string ApplicationTrial::met_limits() const {
  const auto& [folder, before] = group_;
  const GroupCounts now = counts_of_group(folder);
  std::string text;
  if (now.oom_kills > before.oom_kills) text += "; it needs more memory than memory_max_mib of its instance";
  if (now.pids_refused > before.pids_refused)
    text += "; it needs more threads and processes than pids_max of its instance";
  return text;
}

Result<void> ApplicationTrial::verdict() {
  end_session(process_);
  const ExitStatus status = reap_process(process_);
  std::string output = read_available(output_.get(), kTrialOutputRoom);
  // The exit code alone says nothing: the application can end the process.
  const bool valid = status.success() && output.find(kValidApplication) != std::string::npos;
  if (valid) return {};
  if (gave_up_) {
    return failure(ErrorCode::timed_out,
                   fmt::format("trying it took longer than {} s: does it return from its set-up?",
                               std::chrono::duration_cast<std::chrono::seconds>(kTrialLimit).count()));
  }
  if (status.success()) {
    return failure(ErrorCode::invalid_argument, "it ends its process in its set-up (exit code 0)");
  }
  output.resize(std::min(output.size(), kShown));
  while (output.ends_with('\n')) output.pop_back();
  output = one_line(output);
  if (const std::string name = path_ + ": "; output.starts_with(name)) output.erase(0, name.size());
  if (output.empty()) output = fmt::format("the process that tried it has ended: {}", status.describe());
  return failure(ErrorCode::invalid_argument, output + met_limits());
}

}  // namespace plchost
