#pragma once

#include <array>

#include "tests/models/checker/model.hpp"

namespace plchost::models {

/// Linux's work for a priority-inheriting futex, and at the end of a thread that holds one: as far as
/// RobustMutex asks for it. One futex in a scene; handed on in the order of arrival. A timeout passes when
/// nothing else can run. The calls come by syscall() and clock_nanosleep(), which the linker leads here
/// (--wrap).
class PiFutex {
 public:
  explicit PiFutex(Scene& scene);

  [[nodiscard]] static std::uint32_t id_of(ThreadNumber thread) noexcept { return 100 + thread; }

  int lock(std::uintptr_t word);
  int unlock(std::uintptr_t word);

 private:
  struct Waiter {
    ThreadNumber thread = 0;
    bool granted = false;
    bool owner_died = false;
  };
  static constexpr int kGone = -1;

  void thread_was_killed(ThreadNumber thread);
  void grant(bool owner_died);
  Waiter leave(ThreadNumber thread);
  [[nodiscard]] static std::uintptr_t sleeping_place(ThreadNumber thread) noexcept;

  std::array<Waiter, 5> queue_{};
  unsigned waiting_ = 0;
  int owner_ = kGone;  // the thread for which they wait
};

}  // namespace plchost::models
