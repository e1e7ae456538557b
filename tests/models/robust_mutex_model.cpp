// One thread at a time holds the mutex, also after its owner was killed at any instruction.

#include "shm/threads/robust_mutex.hpp"
#include "tests/models/checker/model.hpp"
#include "tests/models/checker/pi_futex.hpp"

namespace plchost::models {
namespace {

struct Shared {
  explicit Shared(Scene& scene) : kernel(scene) {
    scene.name(mutex, "mutex");
    scene.name(guarded, "the guarded value");
  }
  PiFutex kernel;
  RobustMutex mutex;
  int guarded = 0;  // plain: two threads in it at a time are a data race
  int owner_died = 0;

  void use() {
    const LockResult locked = mutex.lock();
    require(locked == LockResult::locked || locked == LockResult::owner_died,
            "a lock without a deadline fails");
    ++guarded;
    if (locked == LockResult::owner_died) ++owner_died;
    require(mutex.unlock(), "the owner cannot unlock");
  }
};

void three_threads(Scene& scene) {
  auto& shared = scene.make<Shared>(scene);
  for (const char* name : {"first", "second", "third"}) scene.thread(name, [&] { shared.use(); });
  scene.at_end([&] {
    require(shared.guarded == 3, "a use is lost");
    require(shared.owner_died == 0, "nobody has died");
    require(shared.mutex.owner() == 0, "it is held by nobody");
  });
}

void two_threads_twice(Scene& scene) {
  auto& shared = scene.make<Shared>(scene);
  for (const char* name : {"first", "second"}) {
    scene.thread(name, [&] {
      shared.use();
      shared.use();
    });
  }
  scene.at_end([&] { require(shared.guarded == 4 && shared.mutex.owner() == 0, "a use is lost"); });
}

void an_owner_is_killed(Scene& scene) {
  auto& shared = scene.make<Shared>(scene);
  scene.limits({.kills = 1});
  scene.thread("victim", [&] { shared.use(); }, {.may_be_killed = true});
  for (const char* name : {"other", "third"}) scene.thread(name, [&] { shared.use(); });
  scene.at_end([&] { require(shared.guarded >= 2, "a use is lost"); });
}

}  // namespace
}  // namespace plchost::models

int main(int argc, char** argv) {
  using namespace plchost::models;
  return run(argc, argv,
             {{"three_threads", three_threads},
              {"two_threads_twice", two_threads_twice},
              {"an_owner_is_killed", an_owner_is_killed}});
}
