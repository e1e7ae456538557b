// The ring of the flight recorder: one writer that goes round and round, and a reader that it never waits
// for.

#include <array>

#include "shm/base/flight_ring.hpp"
#include "tests/models/checker/model.hpp"

namespace plchost::models {
namespace {

constexpr std::uint64_t kCapacity = 2;

struct Shared {
  FlightRing::Word written{0};
  std::array<FlightRing::Word, kCapacity * FlightRing::kWordsOfEntry> words{};
  std::atomic<std::uint64_t> told{0};  // how far the writer has come, told another way
};

// Entry number i, from 0 on, has i + 1 as its time and as its figure.
void write(Shared& shared, std::uint64_t entries) {
  FlightRing ring(shared.written, shared.words);
  for (std::uint64_t i = 1; i <= entries; ++i) {
    ring.put(TimePoint(Duration(static_cast<Duration::rep>(i))), FlightKind::start,
             static_cast<std::int64_t>(i));
    shared.told.store(i, std::memory_order_release);
  }
}

// Each entry is whole and the one of its number; the last one that was told of is known.
void read(Shared& shared, int reads) {
  std::uint64_t next = 0;
  for (int i = 0; i < reads; ++i) {
    const std::uint64_t told = shared.told.load(std::memory_order_acquire);
    const FlightRing::Read found = FlightRing::read(shared.written, shared.words, next);
    require(found.next >= told, "an entry that was told of is not counted");
    require(found.next == next + found.skipped + found.entries.size(), "entries are lost without a word");
    auto number = static_cast<std::int64_t>(next + found.skipped);
    for (const FlightEntry& entry : found.entries) {
      ++number;
      require(entry.kind == FlightKind::start, "an entry that nobody has written");
      require(entry.figure == entry.time_ns, "half of another entry");
      require(entry.time_ns == number, "an entry in the place of another one");
    }
    next = found.next;
  }
}

void a_reader_is_overtaken(Scene& scene) {
  auto& shared = scene.make<Shared>();
  scene.thread("writer", [&] { write(shared, 4); });
  scene.thread("reader", [&] { read(shared, 1); });
}

void a_reader_reads_twice(Scene& scene) {
  auto& shared = scene.make<Shared>();
  scene.thread("writer", [&] { write(shared, 3); });
  scene.thread("reader", [&] { read(shared, 2); });
}

void two_readers(Scene& scene) {
  auto& shared = scene.make<Shared>();
  scene.thread("writer", [&] { write(shared, 3); });
  for (const char* name : {"reader", "other reader"}) scene.thread(name, [&] { read(shared, 1); });
}

// All entries that a killed writer has left are whole.
void a_writer_is_killed(Scene& scene) {
  auto& shared = scene.make<Shared>();
  scene.limits({.kills = 1});
  const ThreadNumber victim = scene.thread("victim", [&] { write(shared, 3); }, {.may_be_killed = true});
  scene.thread("its heir", [&] { read(shared, 1); }, {.after = static_cast<int>(victim)});
}

}  // namespace
}  // namespace plchost::models

int main(int argc, char** argv) {
  using namespace plchost::models;
  return run(argc, argv,
             {{"a_reader_is_overtaken", a_reader_is_overtaken},
              {"a_reader_reads_twice", a_reader_reads_twice},
              {"two_readers", two_readers},
              {"a_writer_is_killed", a_writer_is_killed}});
}
