#pragma once

#include <functional>
#include <memory>
#include <string>
#include <utility>

#include "shm/base/result.hpp"
#include "shm/base/time.hpp"

namespace plchost {

/// Done elsewhere, within a limit: a thread of its own for work that a disk may keep waiting for any time. It
/// has one thing to do at a time. While a disk hangs, the caller waits for it once and not for each thing:
/// the limit counts from when the disk began with what it has not answered yet. One thread calls it.
class DiskThread {
 public:
  DiskThread() = default;
  DiskThread(const DiskThread&) = delete;
  DiskThread& operator=(const DiskThread&) = delete;
  /// A thread that the disk keeps waiting is left behind; it ends when the disk answers.
  ~DiskThread();

  /// Does `work` on the thread, and waits for it. timed_out: not done within the limit; it is then not begun
  /// any more, or is still done when the disk answers, so it must own all that it uses. `what`: of which the
  /// error speaks. system: there is no thread.
  [[nodiscard]] Result<void> within(Duration limit, const std::string& what, std::function<void()> work);
  /// The same with what `work` returns.
  template <class Answer>
  [[nodiscard]] Result<Answer> ask(Duration limit, const std::string& what, std::function<Answer()> work) {
    const auto answer = std::make_shared<std::unique_ptr<Answer>>();
    PLCHOST_TRY(within(limit, what,
                       [answer, work = std::move(work)] { *answer = std::make_unique<Answer>(work()); }));
    return std::move(**answer);
  }

 private:
  struct Shared;
  [[nodiscard]] Result<void> start();

  std::shared_ptr<Shared> shared_;  // with the thread; null: it has not been needed yet
};

}  // namespace plchost
