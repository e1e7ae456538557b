// A post and what is kept of its source are one step, whichever instruction a kill of the API server hits,
// while others post to the same event.

#include "api/server/posts/post_intent.hpp"
#include "tests/models/checker/model.hpp"

namespace plchost::models {
namespace {

struct Shared {
  PostIntent intent;
  std::array<KeptState, 2> sources;
  std::array<CountedEvent, 2> events;
  std::uint64_t count_when_taken = 0;
};

Shared& make(Scene& scene) {
  auto& shared = scene.make<Shared>();
  scene.name(shared.intent, "intent");
  scene.name(shared.sources, "sources");
  scene.name(shared.events, "events");
  return shared;
}

/// As an API server does it: a number that the source has behind it is posted no more.
void post(Shared& shared, std::uint32_t source, std::uint64_t number, std::uint32_t event) {
  KeptState& kept = shared.sources[source];
  if (number <= kept.state().last) return;
  const auto made = shared.intent.post(
      {.entry = source, .event = event}, kept, [&] { return &shared.events[event]; },
      [&](const CountedEvent::Snapshot& seen) {
        SourceState after = kept.state();
        after.last = number;
        after.last_count = seen.count() + 1;
        ++after.counters.accepted;
        if (!seen.taken()) ++after.counters.no_task;
        return after;
      });
  require(made.has_value(), "an event that is there is not posted to");
}

void finish(Shared& shared) {
  shared.intent.finish([&](std::uint32_t entry) { return &shared.sources[entry]; },
                       [&](std::uint32_t event) { return &shared.events[event]; });
}

void require_state(const Shared& shared, std::uint32_t source, std::uint64_t posts) {
  const SourceState& state = shared.sources[source].state();
  require(state.last == posts, "a source was not told of its post");
  require(state.counters.accepted == posts, "the record of the source is not of its last post");
}

/// The work of a server: it ends the post of the one before, and makes the first one of source 0.
auto first_post(Shared& shared) {
  return [&shared] {
    finish(shared);
    post(shared, 0, 1, 0);
  };
}

/// A server that may be killed, and the one after it.
void add_servers(Scene& scene, const std::function<void()>& serve) {
  const ThreadNumber victim = scene.thread("server", serve, {.may_be_killed = true});
  scene.thread("next server", serve, {.after = static_cast<int>(victim)});
}

// The next server does what is left, and the client repeats what it was not told of.
void a_server_is_killed(Scene& scene) {
  Shared& shared = make(scene);
  scene.limits({.kills = 1});
  add_servers(scene, first_post(shared));
  for (const char* name : {"poster", "other poster"}) scene.thread(name, [&] { shared.events[0].post(); });
  scene.at_end([&] {
    require(shared.events[0].count() == 3, "a post is lost or doubled");
    require_state(shared, 0, 1);
  });
}

// Nobody posts after it: the task that waits is woken by the server that was killed, or by the next one.
void a_task_waits(Scene& scene) {
  Shared& shared = make(scene);
  scene.limits({.kills = 1});
  add_servers(scene, first_post(shared));
  scene.thread("task", [&] {
    for (;;) {
      const CountedEvent::Snapshot seen = shared.events[0].snapshot();
      if (seen.count() == 1) return;
      require(seen.count() == 0, "a post is doubled");
      shared.events[0].wait(seen);
    }
  });
  scene.at_end([&] { require_state(shared, 0, 1); });
}

void two_servers_are_killed(Scene& scene) {
  Shared& shared = make(scene);
  scene.limits({.kills = 2});
  const auto serve = first_post(shared);
  const ThreadNumber first = scene.thread("server", serve, {.may_be_killed = true});
  const ThreadNumber second =
      scene.thread("next server", serve, {.may_be_killed = true, .after = static_cast<int>(first)});
  scene.thread("third server", serve, {.after = static_cast<int>(second)});
  scene.thread("poster", [&] { shared.events[0].post(); });
  scene.at_end([&] {
    require(shared.events[0].count() == 2, "a post is lost or doubled");
    require_state(shared, 0, 1);
  });
}

// Of each post the intent names another source, event and mark.
void posts_of_two_sources(Scene& scene) {
  Shared& shared = make(scene);
  scene.limits({.kills = 1});
  const auto serve = [&] {
    finish(shared);
    post(shared, 0, 1, 0);
    post(shared, 1, 1, 1);
    post(shared, 0, 2, 1);
    post(shared, 0, 3, 0);
  };
  add_servers(scene, serve);
  scene.thread("poster", [&] { shared.events[1].post(); });
  scene.at_end([&] {
    require(shared.events[0].count() == 2, "a post is lost or doubled");
    require(shared.events[1].count() == 3, "a post is lost or doubled");
    require_state(shared, 0, 3);
    require_state(shared, 1, 1);
  });
}

// Tasks begin to take posts: a post before that is told that no task runs for it, one after it is not.
void tasks_begin_to_take_posts(Scene& scene) {
  Shared& shared = make(scene);
  scene.limits({.kills = 1});
  add_servers(scene, first_post(shared));
  scene.thread("instance", [&] { shared.count_when_taken = shared.events[0].set_taken(true).count(); });
  scene.thread("poster", [&] { shared.events[0].post(); });
  scene.at_end([&] {
    const SourceState& state = shared.sources[0].state();
    const bool before = state.last_count <= shared.count_when_taken;
    require((state.counters.no_task == 1) == before, "a source was told the wrong thing of its post");
    observe(before ? 1 : 0);
  });
  scene.outcomes(3);
}

}  // namespace
}  // namespace plchost::models

int main(int argc, char** argv) {
  using namespace plchost::models;
  return run(argc, argv,
             {{"a_server_is_killed", a_server_is_killed},
              {"a_task_waits", a_task_waits},
              {"two_servers_are_killed", two_servers_are_killed},
              {"posts_of_two_sources", posts_of_two_sources},
              {"tasks_begin_to_take_posts", tasks_begin_to_take_posts}});
}
