#pragma once

#include <functional>
#include <string>

#include "instances/runtime/setup/options.hpp"

namespace plchost {

/// plc-instance --check-application: does all that a start with these options does, by the same functions,
/// but takes nothing from an instance of that name that runs. Then it prints the tasks, or the first thing
/// that is wrong. It starts no task, calls no hook of a component, opens no device, makes nothing in the pool
/// and writes no file. A pool that is not there is not looked at. The exit code of the program.
[[nodiscard]] int check_application(const Options& options);

/// Runs `check`, which runs code of the application, in a process of its own. The returned value is that of
/// `check`. The check may not come to its end (a crash, an exit, an endless loop, a signal to this process).
/// Then this process ends the child and all that it has forked, and says why on standard error.
/// `application`: its file, for the texts. `signals`: a signalfd; a signal from it ends this process, too. To
/// be called while the process has one thread.
[[nodiscard]] int run_trial(const std::string& application, int signals, const std::function<int()>& check);

/// Within `check`: the application has left the descriptors of the trial alone. A start has more of them, and
/// does not come up without.
[[nodiscard]] bool descriptors_are_open() noexcept;

/// Within `check`, from any thread: its verdict is `code`, though it cannot return. Its report was written.
[[noreturn]] void end_trial(int code) noexcept;

}  // namespace plchost
