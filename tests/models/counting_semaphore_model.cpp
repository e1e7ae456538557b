// Each post lets one waiter on, and none sleeps while there is a unit: not even until its next look.

#include "shm/base/counting_semaphore.hpp"
#include "tests/models/checker/model.hpp"

namespace plchost::models {
namespace {

struct Shared {
  CountingSemaphore semaphore;
  int written = 0;  // plain
};

void two_posts_two_waiters(Scene& scene) {
  auto& shared = scene.make<Shared>();
  scene.name(shared.semaphore, "semaphore");
  for (const char* name : {"waiter", "other waiter"}) {
    scene.thread(name, [&] { require(shared.semaphore.wait(), "a wait without a deadline ends"); });
  }
  scene.thread("poster", [&] {
    shared.semaphore.post();
    shared.semaphore.post();
  });
  scene.at_end([&] { require(shared.semaphore.value() == 0, "units are lost or made"); });
}

void what_was_written_is_seen(Scene& scene) {
  auto& shared = scene.make<Shared>();
  scene.name(shared.semaphore, "semaphore");
  scene.limits({.spurious_wakes = 1, .weak_failures = 2});
  scene.thread("poster", [&] {
    shared.written = 7;
    shared.semaphore.post();
  });
  scene.thread("waiter", [&] {
    require(shared.semaphore.wait(), "a wait without a deadline ends");
    require(shared.written == 7, "the waiter does not see what was written before the post");
  });
}

// The word comes back to what it was while a poster stands between its wake and what it does then. The mark
// is there at first, and nobody sleeps: a wait that was given up has left it.
void the_word_comes_back(Scene& scene) {
  auto& shared = scene.make<Shared>();
  scene.name(shared.semaphore, "semaphore");
  scene.limits({.steps = 9, .cut = true});
  (void)shared.semaphore.wait(TimePoint{});
  scene.thread("poster", [&] { shared.semaphore.post(); });
  scene.thread("takes, then posts", [&] {
    (void)shared.semaphore.try_wait();
    shared.semaphore.post();
    shared.semaphore.post();
  });
  for (const char* name : {"waiter", "other waiter"}) {
    scene.thread(name, [&] { require(shared.semaphore.wait(), "a wait without a deadline ends"); });
  }
}

// Killed after it was woken, or before: its unit stays, and the other one finds it at its next look.
void a_waiter_is_killed(Scene& scene) {
  auto& shared = scene.make<Shared>();
  scene.name(shared.semaphore, "semaphore");
  scene.limits({.kills = 1});
  const ThreadNumber victim =
      scene.thread("victim", [&] { (void)shared.semaphore.wait(); }, {.may_be_killed = true});
  scene.thread("waiter", [&] { require(shared.semaphore.wait(), "a wait without a deadline ends"); });
  scene.thread("poster", [&] {
    shared.semaphore.post();
    shared.semaphore.post();
  });
  scene.at_end([&shared, victim] {
    require(shared.semaphore.value() <= (was_killed(victim) ? 1 : 0), "units are lost or made");
  });
}

void a_poster_is_killed(Scene& scene) {
  auto& shared = scene.make<Shared>();
  scene.name(shared.semaphore, "semaphore");
  scene.limits({.kills = 1});
  scene.thread("victim", [&] { shared.semaphore.post(); }, {.may_be_killed = true});
  scene.thread("poster", [&] { shared.semaphore.post(); });
  scene.thread("waiter", [&] { require(shared.semaphore.wait(), "a wait without a deadline ends"); });
}

}  // namespace
}  // namespace plchost::models

int main(int argc, char** argv) {
  using namespace plchost::models;
  return run(argc, argv,
             {{"two_posts_two_waiters", two_posts_two_waiters},
              {"what_was_written_is_seen", what_was_written_is_seen},
              {"the_word_comes_back", the_word_comes_back},
              {"a_waiter_is_killed", a_waiter_is_killed},
              {"a_poster_is_killed", a_poster_is_killed}});
}
