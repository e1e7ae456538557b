#pragma once

#include <array>
#include <csetjmp>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include <ucontext.h>

#include "tests/models/checker/memory.hpp"
#include "tests/models/checker/model.hpp"
#include "tests/models/checker/state_map.hpp"

namespace plchost::models {

struct Report {
  std::string fault;  ///< empty: none
  std::vector<std::string> trace;
  std::uint64_t executions = 0;
  std::uint64_t states = 0;
  std::uint64_t cut = 0;  ///< executions that were not followed to their end
  unsigned longest = 0;   ///< decisions in one execution
};

/// Runs a scene again and again, each time with another list of decisions, until all lists are through (a
/// search in depth). Threads are fibers: one runs from one step to its next, a step being an operation on an
/// atomic or a futex.
///
/// Two things keep the search small. An execution that reaches a state in which another one has been is not
/// followed further. And of two steps that do not depend on each other only one order is run (sleep sets). A
/// thread whose step was run first elsewhere sleeps until another one takes a step that depends on it.
class Explorer final : public Scene, private Chooser {
 public:
  explicit Explorer(void (*set_up)(Scene&));
  /// All executions, or the first ones: enough for a small scene.
  Report explore(std::uint64_t most = ~std::uint64_t{0});
  /// So many executions with decisions by chance, until one of them has a fault. Finds most faults long
  /// before a search in depth comes to them; proves nothing if it finds none.
  Report walk(std::uint64_t executions);

  ThreadNumber thread(const char* name, std::function<void()> body, ThreadOptions options) override;
  void at_end(std::function<void()> check) override { check_ = std::move(check); }
  void when_killed(std::function<void(ThreadNumber)> then) override { when_killed_ = std::move(then); }
  void limits(const Limits& limits) override { limits_ = limits; }
  void outcomes(std::uint64_t expected) override { expected_ = expected; }
  void observe(unsigned outcome) noexcept { observed_ |= std::uint64_t{1} << outcome; }
  void name(const void* object, std::size_t size, const char* name) override;

  // The ends of the scene's threads. All but in_thread() only there.
  [[nodiscard]] bool in_thread() const noexcept { return running_ >= 0; }
  [[nodiscard]] unsigned self() const noexcept { return static_cast<unsigned>(running_); }
  /// Before each step: others may run first. The step is at `address` (0: at none, others do not depend on
  /// it).
  void step(std::uintptr_t address, bool writes);
  static constexpr std::uintptr_t kAnywhere = ~std::uintptr_t{0};
  /// A plain write to shared memory: the thread may be killed before it.
  void plain_write(std::uintptr_t address, std::size_t size);
  void plain_read(std::uintptr_t address, std::size_t size);
  [[nodiscard]] Memory& memory() noexcept { return memory_; }
  [[nodiscard]] bool weak_fails();
  /// The result of the step: the thread's further way depends on nothing else.
  void done(const char* what, std::uintptr_t address, std::uint64_t argument, std::uint64_t result);
  enum class Sleep : std::uint8_t { woken, timed_out };
  [[nodiscard]] Sleep sleep(std::uintptr_t word, bool has_deadline);
  unsigned wake(std::uintptr_t word, unsigned count);
  /// Ends the execution; returns only outside of the threads.
  void fail(std::string what);

  [[nodiscard]] bool killed(ThreadNumber thread) const { return threads_[thread].state == State::killed; }
  /// -1: none was.
  [[nodiscard]] int last_killed() const noexcept { return last_killed_; }

 private:
  enum class State : std::uint8_t { waiting, ready, asleep, ended, killed };
  struct Thread {
    const char* name = "";
    std::function<void()> body;
    ThreadOptions options;
    State state = State::ready;
    std::uintptr_t word = 0;  // it sleeps there
    bool has_deadline = false;
    bool timed_out = false;
    std::uint64_t history = 0;
    std::uintptr_t next_at = kAnywhere;  // of its next step
    bool next_writes = true;
    bool begun = false;
    ucontext_t context{};
    std::jmp_buf at{};
    std::vector<char> stack;
  };
  struct Decision {
    unsigned chosen = 0;
    unsigned of = 1;
    std::uint32_t actions = 0;  // bits of those that the decision is between; 0: it is of another kind
  };
  struct Action {
    enum class Kind : std::uint8_t { run, time_out, wake, kill } kind;
    unsigned thread;
  };

  unsigned choose(unsigned count) override;
  void* memory(std::size_t size, std::size_t alignment) override;
  void run_once();
  void collect();
  [[nodiscard]] std::uint64_t state() const;
  [[nodiscard]] bool decide(Action& action);
  [[nodiscard]] std::uint32_t worth_running();
  [[nodiscard]] bool core_is_seen(int core) const;
  [[nodiscard]] bool depend(unsigned a, unsigned b) const;
  void perform(const Action& action);
  void resume(unsigned number);
  [[noreturn]] void leave();
  void back_to_scheduler();
  void end_of(unsigned number, State how);
  bool next();
  [[nodiscard]] unsigned by_chance(unsigned count) noexcept;
  void tell_fault(Report& report);
  [[nodiscard]] std::string place(std::uintptr_t address) const;
  static void fiber_entry();

  void (*set_up_)(Scene&);
  Memory memory_;
  std::array<Thread, kMaxThreads> threads_;
  unsigned count_ = 0;
  Limits limits_;
  Limits left_;
  std::function<void()> check_;
  std::function<void(ThreadNumber)> when_killed_;
  int last_killed_ = -1;
  int running_ = -1;
  unsigned last_ = 0;
  std::vector<Decision> decisions_;
  std::size_t decided_ = 0;
  std::vector<Action> actions_;
  std::uint8_t asleep_ = 0;  // bits of threads that need not run next: that was explored elsewhere
  StateMap states_;
  ucontext_t prototype_{};
  std::jmp_buf scheduler_{};
  std::string fault_;
  std::uint64_t expected_ = 0;  // 0: the scene does not say
  std::uint64_t observed_ = 0;
  bool tracing_ = false;
  bool walking_ = false;
  std::uint64_t chance_ = 1;
  bool any_killed_ = false;
  bool cut_ = false;
  std::vector<std::string> trace_;
  struct Name {
    std::uintptr_t begin;
    std::size_t size;
    const char* text;
  };
  std::vector<Name> names_;
};

/// The one that explores now; null: none does.
Explorer*& explorer() noexcept;

/// The memory of a scene, all zero at its beginning. Objects that are made with new while `on` lie there,
/// too, at the same address in each execution.
class Arena {
 public:
  static void reset() noexcept;
  static void* take(std::size_t size, std::size_t alignment);
  [[nodiscard]] static bool holds(std::uintptr_t address) noexcept;
  [[nodiscard]] static std::uint64_t hash() noexcept;
  [[nodiscard]] static bool is_in_use() noexcept;

  /// Sets whether new takes from it, until the end of the block.
  class Use {
   public:
    explicit Use(bool on) noexcept;
    ~Use();
    Use(const Use&) = delete;
    Use& operator=(const Use&) = delete;

   private:
    bool before_;
  };
};

}  // namespace plchost::models
