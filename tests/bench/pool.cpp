// The object pool: the cost of an operation that needs no system call, beside the cheapest thing that does
// the same. Then the cost of making, opening and closing 100,000 objects, beside sem_open and shm_open.

#include <algorithm>
#include <array>
#include <atomic>
#include <string>

#include <fcntl.h>
#include <fmt/format.h>
#include <pthread.h>
#include <semaphore.h>
#include <sys/mman.h>
#include <unistd.h>

#include "shm/base/system_call.hpp"
#include "shm/files/pool_files.hpp"
#include "shm/pool/object_pool.hpp"
#include "tests/bench/parts.hpp"
#include "tests/support/own_name.hpp"

namespace plchost::bench {

namespace {

constexpr int kCalls = 1000;  // a sample is so many of them
constexpr Duration kPoolSlice = std::chrono::milliseconds(500);
constexpr std::uint32_t kMostMappings = 50'000;  // sem_open maps a page for each; a process may have 65,530
constexpr std::size_t kMemory = 4096;

template <class Call>
Subject calls(Samples& samples, Call call) {
  return [&samples, call](Duration slice) -> Result<void> {
    const TimePoint end = MonotonicClock::now() + slice;
    for (TimePoint now = MonotonicClock::now(); now < end;) {
      const TimePoint began = now;
      for (int i = 0; i < kCalls; ++i) call();
      now = MonotonicClock::now();
      samples.add(now - began);
    }
    return {};
  };
}

constexpr std::size_t kMostPoolSamples = 1'000'000;

template <class Ours, class Floor>
Result<Row> measure_calls(const Plan& plan, const char* name, const char* note, std::vector<Target> targets,
                          Ours ours, Floor floor) {
  Row row{.name = name,
          .sample = "1,000 calls",
          .ours = Samples(kMostPoolSamples),
          .floor = Samples(kMostPoolSamples),
          .note = note};
  const OnCore here(plan.task_core);
  PLCHOST_TRY(alternate(plan, {calls(row.floor, floor), calls(row.ours, ours)}, kPoolSlice));
  row.targets = std::move(targets);
  for (Target& target : row.targets) {
    target.measured = ratio_of_times(summarise(row.ours).p50, summarise(row.floor).p50);
  }
  return row;
}

Result<Row> measure_post(const Plan& plan, ObjectPool& pool) {
  PLCHOST_TRY_ASSIGN(const auto event, pool.create_shared_event("event"));
  // In shared memory like ours.
  PLCHOST_TRY_ASSIGN(auto memory, pool.create_memory("floor", 64));
  auto& word = *reinterpret_cast<std::atomic<std::uint64_t>*>(memory.object.bytes().data());
  auto& other = *reinterpret_cast<std::atomic<std::uint64_t>*>(memory.object.bytes().data() + sizeof(word));
  return measure_calls(
      plan, "pool/post", "1,000 posts that nobody waits for; floor: a relaxed atomic add and a load",
      {{"at most 1.3 of an add and a load", "ratio", 0, 1.3, true}}, [&] { (void)event.object.post(); },
      [&] {
        if (other.load(std::memory_order_relaxed) == 0) word.fetch_add(1, std::memory_order_relaxed);
      });
}

Result<Row> measure_mutex(const Plan& plan, ObjectPool& pool) {
  PLCHOST_TRY_ASSIGN(const auto mutex, pool.create_mutex("mutex"));
  pthread_mutexattr_t attributes;
  pthread_mutexattr_init(&attributes);
  pthread_mutexattr_setpshared(&attributes, PTHREAD_PROCESS_SHARED);
  pthread_mutexattr_setrobust(&attributes, PTHREAD_MUTEX_ROBUST);
  pthread_mutexattr_setprotocol(&attributes, PTHREAD_PRIO_INHERIT);
  pthread_mutex_t floor;
  PLCHOST_TRY(check_returned(pthread_mutex_init(&floor, &attributes), "mutex"));
  return measure_calls(
      plan, "pool/mutex",
      "1,000 times lock and unlock; floor: the C library's, robust and priority-inheriting", {},
      [&] {
        (void)mutex.object.lock();
        (void)mutex.object.unlock();
      },
      [&] {
        pthread_mutex_lock(&floor);
        pthread_mutex_unlock(&floor);
      });
}

Result<Row> measure_semaphore(const Plan& plan, ObjectPool& pool) {
  PLCHOST_TRY_ASSIGN(const auto semaphore, pool.create_semaphore("semaphore", 0));
  sem_t floor;
  PLCHOST_TRY(check_errno(::sem_init(&floor, 1, 0), "sem_init"));
  return measure_calls(
      plan, "pool/semaphore", "1,000 times post and wait; floor: sem_post and sem_wait", {},
      [&] {
        (void)semaphore.object.post();
        (void)semaphore.object.wait();
      },
      [&] {
        ::sem_post(&floor);
        ::sem_wait(&floor);
      });
}

/// The operation on object i of many.
struct Steps {
  std::function<bool(std::uint32_t)> make, open, close;
};

/// How long each step takes per object.
struct StepTimes {
  std::array<Samples, 3> samples;
};

constexpr std::uint32_t kBatch = 1000;

Result<void> run(const Steps& steps, std::uint32_t count, StepTimes& times) {
  const std::array all = {&steps.make, &steps.open, &steps.close};
  for (std::size_t step = 0; step < all.size(); ++step) {
    for (std::uint32_t first = 0; first < count; first += kBatch) {
      const TimePoint began = MonotonicClock::now();
      for (std::uint32_t i = first; i < first + kBatch; ++i) {
        if (!(*all[step])(i)) {
          return failure(ErrorCode::system, fmt::format("step {} of object {} of {} failed", step, i, count));
        }
      }
      times.samples[step].push((MonotonicClock::now() - began) / kBatch);
    }
  }
  return {};
}

std::string nth(const char* kind, std::uint32_t i) {
  static const std::string kOfThisRun = own_name("");
  return fmt::format("{}{}-{}", kOfThisRun, kind, i);
}

Steps pool_semaphores(ObjectPool& pool, std::vector<SharedSemaphore>& held) {
  return {.make =
              [&](std::uint32_t i) {
                auto made = pool.create_semaphore(nth("s", i), 1);
                if (made) held.push_back(std::move(made->object));
                return made.has_value();
              },
          .open = [&](std::uint32_t i) { return pool.open_semaphore(nth("s", i)).has_value(); },
          .close =
              [&](std::uint32_t i) {
                held[i].close();
                return true;
              }};
}

Steps host_semaphores(std::vector<sem_t*>& held) {
  return {.make =
              [&](std::uint32_t i) {
                held.push_back(::sem_open(("/" + nth("s", i)).c_str(), O_CREAT | O_EXCL, 0600, 1));
                return held.back() != SEM_FAILED;
              },
          .open =
              [&](std::uint32_t i) {
                sem_t* const opened = ::sem_open(("/" + nth("s", i)).c_str(), 0);
                return opened != SEM_FAILED && ::sem_close(opened) == 0;
              },
          .close =
              [&](std::uint32_t i) {
                return ::sem_close(held[i]) == 0 && ::sem_unlink(("/" + nth("s", i)).c_str()) == 0;
              }};
}

bool map_and_unmap(int fd) {
  void* const address = ::mmap(nullptr, kMemory, PROT_READ | PROT_WRITE, MAP_SHARED, fd, 0);
  ::close(fd);
  return address != MAP_FAILED && ::munmap(address, kMemory) == 0;
}

Steps pool_memories(ObjectPool& pool) {
  return {.make =
              [&](std::uint32_t i) {
                return pool.create_memory(nth("m", i), kMemory, {.keep = true}).has_value();
              },
          .open = [&](std::uint32_t i) { return pool.open_memory(nth("m", i)).has_value(); },
          .close = [&](std::uint32_t i) { return pool.remove_object(nth("m", i)).has_value(); }};
}

Steps host_memories() {
  return {.make =
              [](std::uint32_t i) {
                const int fd = ::shm_open(nth("m", i).c_str(), O_CREAT | O_EXCL | O_RDWR, 0600);
                return fd >= 0 && ::posix_fallocate(fd, 0, kMemory) == 0 && map_and_unmap(fd);
              },
          .open =
              [](std::uint32_t i) {
                const int fd = ::shm_open(nth("m", i).c_str(), O_RDWR, 0);
                return fd >= 0 && map_and_unmap(fd);
              },
          .close = [](std::uint32_t i) { return ::shm_unlink(nth("m", i).c_str()) == 0; }};
}

Result<std::vector<Row>> measure_steps(const char* what, std::uint32_t count, std::uint32_t floor_count,
                                       const char* note, const Steps& ours, const Steps& floor) {
  StepTimes our_times;
  StepTimes floor_times;
  PLCHOST_TRY(run(floor, floor_count, floor_times));
  PLCHOST_TRY(run(ours, count, our_times));
  std::vector<Row> rows;
  constexpr std::array kSteps = {"create", "open", "close"};
  for (std::size_t step = 0; step < kSteps.size(); ++step) {
    Row row{.name = fmt::format("pool/{}/{}", what, kSteps[step]),
            .sample = "the mean of 1,000 objects",
            .ours = our_times.samples[step],
            .floor = floor_times.samples[step],
            .note = note};
    const auto& values = row.ours.values();
    row.extra = {
        {"objects", count}, {"first_1000_us", to_us(values.front())}, {"last_1000_us", to_us(values.back())}};
    rows.push_back(std::move(row));
  }
  return rows;
}

}  // namespace

Result<std::vector<Row>> measure_pool(const Plan& plan) {
  const std::string name = own_name("pool");
  PLCHOST_TRY_ASSIGN(auto pool, ObjectPool::create(name, {.max_objects = plan.objects}));
  struct Removed {
    ~Removed() {
      ObjectPool::remove(name);
      remove_pool_memories(name);
    }
    const std::string& name;
  } const at_the_end{name};

  std::vector<Row> rows;
  for (auto row : {measure_post(plan, pool), measure_mutex(plan, pool), measure_semaphore(plan, pool)}) {
    if (!row) return std::unexpected(std::move(row.error()));
    rows.push_back(*std::move(row));
  }
  std::vector<SharedSemaphore> held;
  std::vector<sem_t*> floor_held;
  const std::uint32_t memories = plan.objects / 10;
  for (auto steps : {measure_steps("semaphore", plan.objects, std::min(plan.objects, kMostMappings),
                                   "per object, a sample is 1,000; floor: sem_open, sem_close",
                                   pool_semaphores(pool, held), host_semaphores(floor_held)),
                     measure_steps("memory", memories, memories,
                                   "of 4 KiB; floor: shm_open, posix_fallocate, mmap, shm_unlink",
                                   pool_memories(pool), host_memories())}) {
    if (!steps) return std::unexpected(std::move(steps.error()));
    for (Row& row : *steps) rows.push_back(std::move(row));
  }
  return rows;
}

}  // namespace plchost::bench
