// One writer, and readers that never disturb it.

#include "shm/base/seqlock.hpp"
#include "tests/models/checker/model.hpp"

namespace plchost::models {
namespace {

struct Value {
  std::uint64_t first = 0;
  std::uint64_t second = 0;
};

struct Shared {
  Seqlock<Value> lock;
  std::atomic<std::uint64_t> told{0};  // how far the writer has come, told another way
};

// `attempts` of them; each value read is whole and not older than the one before.
void read(Shared& shared, int reads) {
  std::uint64_t last = 0;
  for (int i = 0; i < reads; ++i) {
    const std::uint64_t told = shared.told.load(std::memory_order_acquire);
    const std::optional<Value> value = shared.lock.read(2);
    if (!value) continue;
    require(value->first == value->second, "half of another value");
    require(value->first >= last, "an older value than before");
    require(value->first >= told, "an older value than the writer has told of");
    last = value->first;
  }
}

void one_writer_two_readers(Scene& scene) {
  auto& shared = scene.make<Shared>();
  scene.name(shared.lock, "lock");
  scene.thread("writer", [&] { shared.lock.write({.first = 1, .second = 1}); });
  for (const char* name : {"reader", "other reader"}) scene.thread(name, [&] { read(shared, 1); });
}

void one_reader_reads_twice(Scene& scene) {
  auto& shared = scene.make<Shared>();
  scene.name(shared.lock, "lock");
  scene.thread("writer", [&] {
    for (std::uint64_t i = 1; i <= 2; ++i) {
      shared.lock.write({.first = i, .second = i});
      shared.told.store(i, std::memory_order_release);
    }
  });
  scene.thread("reader", [&] { read(shared, 2); });
}

// The writer is killed at any moment; another one recovers the lock and writes on.
void a_writer_is_killed(Scene& scene) {
  auto& shared = scene.make<Shared>();
  scene.name(shared.lock, "lock");
  scene.limits({.kills = 1});
  const ThreadNumber victim =
      scene.thread("victim", [&] { shared.lock.write({.first = 1, .second = 1}); }, {.may_be_killed = true});
  scene.thread("successor",
               [&] {
                 shared.lock.recover();
                 require(shared.lock.read(1).has_value(), "the recovered lock cannot be read");
                 shared.lock.write({.first = 2, .second = 2});
                 const std::optional<Value> value = shared.lock.read(1);
                 require(value && value->first == 2, "the successor's value is not there");
               },
               {.after = static_cast<int>(victim)});
  scene.thread("reader", [&] {
    // Between recover() and the successor's write the value may be half of two.
    const std::optional<Value> value = shared.lock.read(2);
    if (value && value->first == 2) require(value->second == 2, "half of the successor's value");
  });
}

}  // namespace
}  // namespace plchost::models

int main(int argc, char** argv) {
  using namespace plchost::models;
  return run(argc, argv,
             {{"one_writer_two_readers", one_writer_two_readers},
              {"one_reader_reads_twice", one_reader_reads_twice},
              {"a_writer_is_killed", a_writer_is_killed}});
}
