#include "tests/conformance/malloc_count.hpp"

#include <atomic>
#include <cstdlib>

// Counts every allocation of the program while it is told to. The sanitizers have a malloc of their own, with
// hooks.
#if defined(PLCHOST_ADDRESS_SANITIZER) || defined(PLCHOST_THREAD_SANITIZER)
// g++ has the function, not the header.
extern "C" int
__sanitizer_install_malloc_and_free_hooks(  // NOLINT(bugprone-reserved-identifier): the sanitizer's own
    void (*malloc_hook)(const volatile void*, std::size_t), void (*free_hook)(const volatile void*));
#define PLCHOST_COUNTS_MALLOC 0
#else
#define PLCHOST_COUNTS_MALLOC 1
#endif

namespace {

std::atomic<bool> counting{false};
std::atomic<std::uint64_t> allocations{0};

void count_one() noexcept {
  if (counting.load(std::memory_order_relaxed)) allocations.fetch_add(1, std::memory_order_relaxed);
}

}  // namespace

namespace plchost {

void MallocCount::begin() noexcept {
  allocations = 0;
  counting = true;
}

std::uint64_t MallocCount::end() noexcept {
  counting = false;
  return allocations;
}

}  // namespace plchost

#if PLCHOST_COUNTS_MALLOC
// operator new comes by here too.
extern "C" {
void* __libc_malloc(std::size_t size);  // NOLINT(bugprone-reserved-identifier): glibc's own
void* __libc_calloc(std::size_t count, std::size_t size);  // NOLINT(bugprone-reserved-identifier)
void* __libc_realloc(void* memory, std::size_t size);      // NOLINT(bugprone-reserved-identifier)
void* malloc(std::size_t size) {
  count_one();
  return __libc_malloc(size);
}
void* calloc(std::size_t count, std::size_t size) {
  count_one();
  return __libc_calloc(count, size);
}
void* realloc(void* memory, std::size_t size) {
  count_one();
  return __libc_realloc(memory, size);
}
}
#else
namespace {

[[maybe_unused]] const int hooked = __sanitizer_install_malloc_and_free_hooks(
    [](const volatile void*, std::size_t) { count_one(); }, [](const volatile void*) {});

}  // namespace
#endif
