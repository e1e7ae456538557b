#pragma once

#include <concepts>
#include <cstdint>
#include <functional>
#include <initializer_list>
#include <new>
#include <string>
#include <utility>

/// The vocabulary of a model of a protocol. A model is a function that sets up a Scene: objects, and threads
/// that use them. The checker runs each execution of it that C++ allows.
namespace plchost::models {

using ThreadNumber = unsigned;

/// Of a scene. All of them bound how often something happens in one execution, at any of the moments at which
/// it can.
struct Limits {
  unsigned kills = 0;           ///< threads that may be killed are
  unsigned spurious_wakes = 0;  ///< sleepers on a futex wake for no reason (a signal)
  unsigned weak_failures = 0;   ///< a weak compare-and-swap fails for no reason
  unsigned early_timeouts = 0;  ///< a sleep with a deadline ends by it while others still run
  /// A sleep with a deadline may end by it when nothing else can run. If not, a wake was lost (unless a
  /// thread was killed).
  bool deadlines_rescue = false;
  unsigned steps = 300;  ///< of one thread; more is a fault
  /// An execution with more steps is not followed further, and is no fault: for threads that can make each
  /// other try again for ever, if they run in turns.
  bool cut = false;
};

struct ThreadOptions {
  bool may_be_killed = false;
  int after = -1;  ///< the number of the thread whose end it waits for, and then knows all that it has done
  int core =
      -1;  ///< threads of one core take turns there, and each knows all that was done on it; -1: its own
};

class Scene {
 public:
  virtual ~Scene() = default;
  /// An object that the threads share. Made anew for each execution, at the same address.
  template <class T, class... Arguments>
  T& make(Arguments&&... arguments) {
    return *new (memory(sizeof(T), alignof(T))) T(std::forward<Arguments>(arguments)...);
  }
  virtual ThreadNumber thread(const char* name, std::function<void()> body, ThreadOptions options = {}) = 0;
  /// Runs when all threads have ended or were killed; sees all stores.
  virtual void at_end(std::function<void()> check) = 0;
  /// The kernel's work when a thread was killed.
  virtual void when_killed(std::function<void(ThreadNumber)> then) = 0;
  virtual void limits(const Limits& limits) = 0;
  /// The values of observe() in all executions together must be this, bit by bit: nothing else, nothing less.
  virtual void outcomes(std::uint64_t expected) = 0;
  /// For the report of a fault.
  virtual void name(const void* object, std::size_t size, const char* name) = 0;
  template <class T>
  void name(const T& object, const char* text) {
    name(&object, sizeof(T), text);
  }

 private:
  virtual void* memory(std::size_t size, std::size_t alignment) = 0;
};

/// In a thread of a scene, or at its end: the property that the model is for.
void require(bool holds, const char* what);
/// At the end: this execution had that outcome, 0 to 63.
void observe(unsigned outcome);
/// That thread was killed. In at_end, or in a thread that began after it.
[[nodiscard]] bool was_killed(ThreadNumber thread);

struct NamedScene {
  const char* name;
  void (*set_up)(Scene&);
};

/// Runs all scenes, or the one that is named by the command line, and prints what was explored. With
/// --catches: 0 if a fault was found in one of them (a wrong variant), 1 if not.
int run(int argc, char** argv, std::initializer_list<NamedScene> scenes);

}  // namespace plchost::models
