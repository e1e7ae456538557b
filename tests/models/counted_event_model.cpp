// Posters of an event and its waiters, each with a cursor of its own. Two waiters that announce themselves in
// turns make each other look again, so executions are cut where a thread has looked often enough.

#include "shm/base/counted_event.hpp"
#include "tests/models/checker/model.hpp"

namespace plchost::models {
namespace {

struct Shared {
  CountedEvent event;
  int written = 0;  // plain: a poster's data for the thread that it wakes
  std::atomic<bool> stop{false};
};

// As an activation source does it.
std::uint64_t wait_for(CountedEvent& event, std::uint64_t cursor) {
  for (;;) {
    const CountedEvent::Snapshot seen = event.snapshot();
    if (seen.count() != cursor) return seen.count();
    event.wait(seen);
  }
}

void wait_for_all(CountedEvent& event, std::uint64_t posts) {
  for (std::uint64_t cursor = 0; cursor < posts;) {
    const std::uint64_t count = wait_for(event, cursor);
    require(count > cursor && count <= posts, "a count that was never posted");
    cursor = count;
  }
}

void one_poster_two_waiters(Scene& scene) {
  auto& shared = scene.make<Shared>();
  scene.name(shared.event, "event");
  scene.limits({.steps = 9, .cut = true});
  scene.thread("poster", [&] {
    shared.written = 7;
    shared.event.post();
  });
  for (const char* name : {"waiter", "other waiter"}) {
    scene.thread(name, [&] {
      wait_for(shared.event, 0);
      require(shared.written == 7, "the woken thread does not see all writes before the post");
    });
  }
}

void one_waiter_wakes_for_no_reason(Scene& scene) {
  auto& shared = scene.make<Shared>();
  scene.name(shared.event, "event");
  scene.limits({.spurious_wakes = 2});
  scene.thread("poster", [&] {
    shared.event.post();
    shared.event.post();
  });
  scene.thread("waiter", [&] { wait_for_all(shared.event, 2); });
}

void two_posters_one_waiter(Scene& scene) {
  auto& shared = scene.make<Shared>();
  scene.name(shared.event, "event");
  for (const char* name : {"poster", "other poster"}) scene.thread(name, [&] { shared.event.post(); });
  scene.thread("waiter", [&] { wait_for_all(shared.event, 2); });
  scene.at_end([&] { require(shared.event.count() == 2, "posts are lost"); });
}

// A poster that is killed, before or after it has posted, costs nothing but its own wake: the next post wakes
// all that sleep.
void a_poster_is_killed(Scene& scene) {
  auto& shared = scene.make<Shared>();
  scene.name(shared.event, "event");
  scene.limits({.kills = 1});
  scene.thread("victim", [&] { shared.event.post(); }, {.may_be_killed = true});
  scene.thread("waiter", [&] { wait_for(shared.event, 0); });
  scene.thread("poster", [&] { shared.event.post(); });
}

void a_waiter_is_killed(Scene& scene) {
  auto& shared = scene.make<Shared>();
  scene.name(shared.event, "event");
  scene.limits({.kills = 1, .steps = 9, .cut = true});
  scene.thread("victim", [&] { wait_for(shared.event, 0); }, {.may_be_killed = true});
  scene.thread("waiter", [&] { wait_for(shared.event, 0); });
  scene.thread("poster", [&] { shared.event.post(); });
}

// A nudge ends the wait of a waiter with a stop flag, and counts as no post.
void a_nudge_stops_a_waiter(Scene& scene) {
  auto& shared = scene.make<Shared>();
  scene.name(shared.event, "event");
  scene.limits({.weak_failures = 1});
  scene.thread("stopper", [&] {
    shared.stop.store(true, std::memory_order_relaxed);
    shared.event.nudge();
  });
  scene.thread("poster", [&] { shared.event.post(); });
  scene.thread("waiter", [&] {
    for (;;) {
      const CountedEvent::Snapshot seen = shared.event.snapshot();
      if (shared.stop.load(std::memory_order_relaxed)) return;
      shared.event.wait(seen);
    }
  });
  scene.at_end([&] { require(shared.event.count() == 1, "a nudge counted as a post, or undid one"); });
}

}  // namespace
}  // namespace plchost::models

int main(int argc, char** argv) {
  using namespace plchost::models;
  return run(argc, argv,
             {{"one_waiter_wakes_for_no_reason", one_waiter_wakes_for_no_reason},
              {"one_poster_two_waiters", one_poster_two_waiters},
              {"two_posters_one_waiter", two_posters_one_waiter},
              {"a_poster_is_killed", a_poster_is_killed},
              {"a_waiter_is_killed", a_waiter_is_killed},
              {"a_nudge_stops_a_waiter", a_nudge_stops_a_waiter}});
}
