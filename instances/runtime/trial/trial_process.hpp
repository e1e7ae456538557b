#pragma once

#include <functional>
#include <string>

namespace plchost {

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
