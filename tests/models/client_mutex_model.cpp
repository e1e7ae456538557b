// One thread at a time holds the mutex, also after its owner was killed at any instruction, or has ended.

#include "shm/threads/client_mutex.hpp"
#include "tests/models/checker/client_roll.hpp"
#include "tests/models/checker/model.hpp"

namespace plchost::models {
namespace {

struct Shared {
  explicit Shared(Scene& scene) {
    scene.name(mutex, "mutex");
    scene.name(guarded, "the guarded value");
  }
  KilledRoll roll;
  ClientMutex mutex;
  int guarded = 0;  // plain: two threads in it at a time are a data race
  int owner_died = 0;

  void take(ThreadNumber self) {
    const LockResult locked = mutex.lock(KilledRoll::client_of(self), roll);
    require(locked == LockResult::locked || locked == LockResult::owner_died,
            "a lock without a deadline fails");
    ++guarded;
    if (locked == LockResult::owner_died) ++owner_died;
  }
  void use(ThreadNumber self) {
    take(self);
    require(mutex.unlock(KilledRoll::client_of(self)), "the owner cannot unlock");
  }
};

void three_threads(Scene& scene) {
  auto& shared = scene.make<Shared>(scene);
  ThreadNumber number = 0;
  for (const char* name : {"first", "second", "third"}) {
    scene.thread(name, [&shared, number] { shared.use(number); });
    ++number;
  }
  scene.at_end([&] {
    require(shared.guarded == 3, "a use is lost");
    require(shared.owner_died == 0, "nobody has died");
    require(shared.mutex.client() == 0, "it is held by nobody");
  });
}

void two_threads_twice(Scene& scene) {
  auto& shared = scene.make<Shared>(scene);
  ThreadNumber number = 0;
  for (const char* name : {"first", "second"}) {
    scene.thread(name, [&shared, number] {
      shared.use(number);
      shared.use(number);
    });
    ++number;
  }
  scene.at_end([&] { require(shared.guarded == 4 && shared.mutex.client() == 0, "a use is lost"); });
}

void an_owner_is_killed(Scene& scene) {
  auto& shared = scene.make<Shared>(scene);
  scene.limits({.kills = 1});
  scene.thread("victim", [&shared] { shared.use(0); }, {.may_be_killed = true});
  scene.thread("other", [&shared] { shared.use(1); });
  scene.thread("third", [&shared] { shared.use(2); });
  scene.at_end([&] { require(shared.guarded >= 2, "a use is lost"); });
}

void an_owner_ends(Scene& scene) {
  auto& shared = scene.make<Shared>(scene);
  scene.thread("ends", [&shared] {
    shared.take(0);
    shared.mutex.abandon(KilledRoll::client_of(0));
  });
  scene.thread("other", [&shared] { shared.use(1); });
  scene.thread("third", [&shared] { shared.use(2); });
  scene.at_end([&] {
    require(shared.guarded == 3, "a use is lost");
    const bool last = shared.mutex.client() != 0;
    require(shared.owner_died == (last ? 0 : 1), "one death is told once");
  });
}

}  // namespace
}  // namespace plchost::models

int main(int argc, char** argv) {
  using namespace plchost::models;
  return run(argc, argv,
             {{"three_threads", three_threads},
              {"two_threads_twice", two_threads_twice},
              {"an_owner_is_killed", an_owner_is_killed},
              {"an_owner_ends", an_owner_ends}});
}
