// Loaded into plchost-dds with LD_PRELOAD: writes how many bytes of its heap are in use into the file
// $HEAP_METER, ten times a second. Blocks with pages of their own, such as Cyclone's receive buffers, are not
// counted: one more of them is no leak.
#include <chrono>
#include <cstdint>
#include <cstdlib>
#include <thread>

#include <fcntl.h>
#include <malloc.h>
#include <signal.h>
#include <sys/mman.h>
#include <unistd.h>

namespace {

void measure(volatile std::uint64_t* used) {
  sigset_t all;  // they are for the threads of the server
  ::sigfillset(&all);
  ::pthread_sigmask(SIG_BLOCK, &all, nullptr);
  for (;; std::this_thread::sleep_for(std::chrono::milliseconds(100))) {
    const auto heap = ::mallinfo2();
    *used = heap.uordblks;
  }
}

[[gnu::constructor]] void start() {
  const char* const path =
      std::getenv("HEAP_METER");  // NOLINT(concurrency-mt-unsafe): no thread is there yet
  const int file = path == nullptr ? -1 : ::open(path, O_RDWR | O_CLOEXEC);
  if (file < 0) return;
  void* const place = ::mmap(nullptr, sizeof(std::uint64_t), PROT_READ | PROT_WRITE, MAP_SHARED, file, 0);
  ::close(file);
  if (place != MAP_FAILED) std::thread(measure, static_cast<volatile std::uint64_t*>(place)).detach();
}

}  // namespace
