#pragma once

namespace plchost {

/// Gives this process an oom_score_adj of at least `own`, and its children the right to go down to `lowest`.
/// False: neither CAP_SYS_RESOURCE nor the score that the process was started with allows that, and the score
/// stays as it was. Before threads are made.
[[nodiscard]] bool take_oom_score(int lowest, int own) noexcept;

}  // namespace plchost
