// The checker itself: small programs of which it is known what C++ allows. Each outcome that is allowed must
// be found, and no other.

#include <atomic>

#include "tests/models/checker/model.hpp"

namespace plchost::models {
namespace {

constexpr auto kRelaxed = std::memory_order_relaxed;
constexpr auto kAcquire = std::memory_order_acquire;
constexpr auto kRelease = std::memory_order_release;
constexpr auto kTotal = std::memory_order_seq_cst;

struct Shared {
  std::atomic<unsigned> x{0};
  std::atomic<unsigned> y{0};
  unsigned a = 0;
  unsigned b = 0;
  unsigned c = 0;
  unsigned d = 0;
};

// Outcome: a, b, c, d as digits of base 2, those of which a program has none being 0.
void observe_all(Scene& scene, Shared& shared, std::initializer_list<unsigned> allowed) {
  std::uint64_t expected = 0;
  for (const unsigned outcome : allowed) expected |= std::uint64_t{1} << outcome;
  scene.outcomes(expected);
  scene.at_end([&] { observe(shared.a | shared.b << 1U | shared.c << 2U | shared.d << 3U); });
}

template <std::memory_order kStore, std::memory_order kLoad>
void store_buffering(Scene& scene, std::initializer_list<unsigned> allowed, ThreadOptions options = {}) {
  auto& shared = scene.make<Shared>();
  scene.thread(
      "left",
      [&] {
        shared.x.store(1, kStore);
        shared.a = shared.y.load(kLoad);
      },
      options);
  scene.thread(
      "right",
      [&] {
        shared.y.store(1, kStore);
        shared.b = shared.x.load(kLoad);
      },
      options);
  observe_all(scene, shared, allowed);
}
void store_buffering_relaxed(Scene& scene) {
  store_buffering<kRelaxed, kRelaxed>(scene, {0, 1, 2, 3});
}
void store_buffering_acquire(Scene& scene) {
  store_buffering<kRelease, kAcquire>(scene, {0, 1, 2, 3});
}
void store_buffering_total(Scene& scene) {
  store_buffering<kTotal, kTotal>(scene, {1, 2, 3});
}

// Threads of one core take turns, whatever the orders are.
void store_buffering_on_one_core(Scene& scene) {
  store_buffering<kRelaxed, kRelaxed>(scene, {1, 2, 3}, {.core = 0});
}

// A thread of another core sees their stores in any order.
void message_from_one_core(Scene& scene) {
  auto& shared = scene.make<Shared>();
  scene.thread("x", [&] { shared.x.store(1, kRelaxed); }, {.core = 0});
  scene.thread("y, if it sees x",
               [&] {
                 if (shared.x.load(kRelaxed) == 1) shared.y.store(1, kRelaxed);
               },
               {.core = 0});
  scene.thread("reader", [&] {
    shared.a = shared.y.load(kRelaxed);
    shared.b = shared.x.load(kRelaxed);
  });
  observe_all(scene, shared, {0, 1, 2, 3});
}

// Between two steps of a thread no other one of its core runs: so a plain access there is no data race.
void plain_counts_on_one_core(Scene& scene) {
  auto& shared = scene.make<Shared>();
  for (const char* const name : {"left", "right"}) {
    scene.thread(name,
                 [&] {
                   shared.x.fetch_add(1, kRelaxed);
                   ++shared.c;
                 },
                 {.core = 0});
  }
  scene.at_end([&] { require(shared.c == 2 && shared.x.load() == 2, "a lost addition"); });
}

template <std::memory_order kStore, std::memory_order kLoad>
void message(Scene& scene, std::initializer_list<unsigned> allowed) {
  auto& shared = scene.make<Shared>();
  scene.thread("writer", [&] {
    shared.x.store(1, kRelaxed);
    shared.y.store(1, kStore);
  });
  scene.thread("reader", [&] {
    shared.a = shared.y.load(kLoad);
    shared.b = shared.x.load(kRelaxed);
  });
  observe_all(scene, shared, allowed);
}
void message_released(Scene& scene) {
  message<kRelease, kAcquire>(scene, {0, 2, 3});
}
void message_not_released(Scene& scene) {
  message<kRelaxed, kAcquire>(scene, {0, 1, 2, 3});
}
void message_not_acquired(Scene& scene) {
  message<kRelease, kRelaxed>(scene, {0, 1, 2, 3});
}

void message_by_fences(Scene& scene) {
  auto& shared = scene.make<Shared>();
  scene.thread("writer", [&] {
    shared.x.store(1, kRelaxed);
    std::atomic_thread_fence(kRelease);
    shared.y.store(1, kRelaxed);
  });
  scene.thread("reader", [&] {
    shared.a = shared.y.load(kRelaxed);
    std::atomic_thread_fence(kAcquire);
    shared.b = shared.x.load(kRelaxed);
  });
  observe_all(scene, shared, {0, 2, 3});
}

// A read-modify-write, also a relaxed one, passes on what the store before it has released.
void release_sequence(Scene& scene) {
  auto& shared = scene.make<Shared>();
  scene.thread("writer", [&] {
    shared.x.store(1, kRelaxed);
    shared.y.store(1, kRelease);
  });
  scene.thread("in between", [&] { shared.c = shared.y.fetch_add(1, kRelaxed); });
  scene.thread("reader", [&] {
    shared.a = shared.y.load(kAcquire) == 2 ? 1 : 0;
    shared.b = shared.x.load(kRelaxed);
    // 2 may also be 0 + 1, then overwritten, never read after both; so 2 says that the writer came first.
    if (shared.a == 1) require(shared.b == 1, "the release sequence is broken");
  });
  scene.at_end([&] { require(shared.y.load() == (shared.c == 1 ? 2U : 1U), "a lost addition"); });
}

// The modification order need not be that of the execution: both stores of the second lines may come first.
void two_times_two_writes(Scene& scene) {
  auto& shared = scene.make<Shared>();
  scene.thread("left", [&] {
    shared.x.store(1, kRelaxed);
    shared.y.store(2, kRelaxed);
  });
  scene.thread("right", [&] {
    shared.y.store(1, kRelaxed);
    shared.x.store(2, kRelaxed);
  });
  scene.outcomes(1U << 0U | 1U << 1U | 1U << 2U | 1U << 3U);
  scene.at_end([&] { observe((shared.x.load() - 1) | (shared.y.load() - 1) << 1U); });
}

void nothing_out_of_thin_air(Scene& scene) {
  auto& shared = scene.make<Shared>();
  scene.thread("left", [&] {
    shared.a = shared.x.load(kRelaxed);
    shared.y.store(shared.a, kRelaxed);
  });
  scene.thread("right", [&] {
    shared.b = shared.y.load(kRelaxed);
    shared.x.store(shared.b, kRelaxed);
  });
  observe_all(scene, shared, {0});
}

void coherence(Scene& scene) {
  auto& shared = scene.make<Shared>();
  scene.thread("writer", [&] { shared.x.store(1, kRelaxed); });
  scene.thread("reader", [&] {
    shared.a = shared.x.load(kRelaxed);
    shared.b = shared.x.load(kRelaxed);
  });
  observe_all(scene, shared, {0, 2, 3});
}

// Independent reads of independent writes: two readers agree on an order only if all is seq_cst.
template <std::memory_order kStore, std::memory_order kLoad>
void independent_reads(Scene& scene) {
  auto& shared = scene.make<Shared>();
  scene.thread("x", [&] { shared.x.store(1, kStore); });
  scene.thread("y", [&] { shared.y.store(1, kStore); });
  scene.thread("x, then y", [&] {
    shared.a = shared.x.load(kLoad);
    shared.b = shared.y.load(kLoad);
  });
  scene.thread("y, then x", [&] {
    shared.c = shared.y.load(kLoad);
    shared.d = shared.x.load(kLoad);
  });
  // 5: a and c, not b and d.
  std::uint64_t expected = 0xffff;
  if (kStore == kTotal) expected &= ~(1U << 5U);
  scene.outcomes(expected);
  scene.at_end([&] { observe(shared.a | shared.b << 1U | shared.c << 2U | shared.d << 3U); });
}

// A seq_cst load may read an older value although a relaxed one has told of the newer (as it is on ARM).
void total_order_beside_relaxed(Scene& scene) {
  auto& shared = scene.make<Shared>();
  scene.thread("writer", [&] {
    shared.x.store(1, kTotal);
    shared.y.store(1, kRelaxed);
  });
  scene.thread("reader", [&] {
    shared.a = shared.y.load(kRelaxed);
    shared.b = shared.x.load(kTotal);
  });
  observe_all(scene, shared, {0, 1, 2, 3});
}

}  // namespace
}  // namespace plchost::models

int main(int argc, char** argv) {
  using namespace plchost::models;
  return run(argc, argv,
             {{"store_buffering_relaxed", store_buffering_relaxed},
              {"store_buffering_acquire", store_buffering_acquire},
              {"store_buffering_total", store_buffering_total},
              {"store_buffering_on_one_core", store_buffering_on_one_core},
              {"message_from_one_core", message_from_one_core},
              {"plain_counts_on_one_core", plain_counts_on_one_core},
              {"message_released", message_released},
              {"message_not_released", message_not_released},
              {"message_not_acquired", message_not_acquired},
              {"message_by_fences", message_by_fences},
              {"release_sequence", release_sequence},
              {"two_times_two_writes", two_times_two_writes},
              {"nothing_out_of_thin_air", nothing_out_of_thin_air},
              {"coherence", coherence},
              {"independent_reads_acquire", independent_reads<kRelease, kAcquire>},
              {"independent_reads_total", independent_reads<kTotal, kTotal>},
              {"total_order_beside_relaxed", total_order_beside_relaxed}});
}
