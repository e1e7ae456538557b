// The other side of feeder.c, in C++: takes parts out of the tray as they are fed.
//
//     gripper POOL PARTS

#include <cstdio>
#include <cstdlib>
#include <memory>
#include <stdexcept>
#include <string>

#include <plc_pool.h>

namespace {

struct Tray {
  unsigned int fed;
  unsigned int taken;
};

/// One of the library's handles, closed at the end of its life.
template <class Handle, void (*Close)(Handle*)>
struct Closer {
  void operator()(Handle* handle) const { Close(handle); }
};
template <class Handle, void (*Close)(Handle*)>
using Owned = std::unique_ptr<Handle, Closer<Handle, Close>>;

/// The value that `make` puts into its last argument.
template <class Handle, void (*Close)(Handle*), class Make>
Owned<Handle, Close> owned(const char* what, Make make) {
  Handle* handle = nullptr;
  if (make(&handle) < 0) throw std::runtime_error(std::string(what) + ": " + plc_pool_error());
  return Owned<Handle, Close>(handle);
}

void take_parts(const char* pool_name, unsigned long parts) {
  const auto pool = owned<plc_pool, plc_pool_close>(
      pool_name, [&](plc_pool** made) { return plc_pool_open(pool_name, PLC_POOL_MAKE, made); });
  const auto places = owned<plc_semaphore, plc_semaphore_close>("places", [&](plc_semaphore** made) {
    return plc_semaphore_create(pool.get(), "feeder/places", 4, nullptr, made);
  });
  const auto part = owned<plc_event, plc_event_close>(
      "part", [&](plc_event** made) { return plc_event_create(pool.get(), "feeder/part", nullptr, made); });
  const auto lock = owned<plc_mutex, plc_mutex_close>(
      "lock", [&](plc_mutex** made) { return plc_mutex_create(pool.get(), "feeder/lock", nullptr, made); });
  const auto memory = owned<plc_memory, plc_memory_close>("tray", [&](plc_memory** made) {
    return plc_memory_create(pool.get(), "feeder/tray", sizeof(Tray), nullptr, made);
  });
  Tray& tray = *static_cast<Tray*>(plc_memory_address(memory.get()));

  for (unsigned long taken = 0; taken < parts;) {
    plc_pool_u64 seen = taken;
    if (plc_event_wait(part.get(), &seen, 10'000'000'000L) < 0) throw std::runtime_error("no part for 10 s");
    for (; taken < seen; ++taken) {
      if (plc_mutex_lock(lock.get(), PLC_POOL_FOREVER) < 0) throw std::runtime_error("lock");
      ++tray.taken;
      plc_mutex_unlock(lock.get());
      plc_semaphore_post(places.get());
    }
  }
  std::printf("took %lu parts of %u\n", parts, tray.fed);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3) {
    std::fputs("usage: gripper POOL PARTS\n", stderr);
    return 2;
  }
  try {
    take_parts(argv[1], std::strtoul(argv[2], nullptr, 10));
    return EXIT_SUCCESS;
  } catch (const std::exception& problem) {
    std::fprintf(stderr, "gripper: %s\n", problem.what());
    return EXIT_FAILURE;
  }
}
