// The functions that a compiler calls from code that it instruments for a thread sanitizer: each atomic
// operation, each plain access. Here they go to the checker, so the code that is checked is the real one,
// unchanged. No thread sanitizer is linked.

#include <cstddef>
#include <cstdint>
#include <cstdlib>

#include <time.h>

#include "tests/models/checker/explorer.hpp"

namespace plchost::models {

namespace {

// The code of a scene's thread is running, not the checker's own (whose inline functions of the standard
// library may be the instrumented ones).
Explorer* in_scene() noexcept {
  Explorer* const current = explorer();
  return Arena::is_in_use() && current != nullptr && current->in_thread() ? current : nullptr;
}

std::uintptr_t number(const volatile void* address) noexcept {
  return reinterpret_cast<std::uintptr_t>(address);
}

Order order_of(int order) noexcept {
  return static_cast<Order>(order & 0xff);
}

template <class T>
T load(const volatile T* at, int order) {
  Explorer* const scene = in_scene();
  if (scene == nullptr) return __atomic_load_n(at, __ATOMIC_SEQ_CST);
  const Arena::Use off(false);
  scene->step(number(at), false);
  const std::uint64_t value = scene->memory().load(scene->self(), number(at), sizeof(T), order_of(order));
  scene->done("load", number(at), 0, value);
  return static_cast<T>(value);
}

template <class T>
void store(volatile T* at, T value, int order) {
  Explorer* const scene = in_scene();
  if (scene == nullptr) return __atomic_store_n(at, value, __ATOMIC_SEQ_CST);
  const Arena::Use off(false);
  scene->step(number(at), true);
  scene->memory().store(scene->self(), number(at), sizeof(T), order_of(order), value);
  scene->done("store", number(at), value, 0);
}

template <class T, class Change>
T change(volatile T* at, T argument, int order, const char* what, Change change) {
  Explorer* const scene = in_scene();
  if (scene == nullptr) {
    T old = __atomic_load_n(at, __ATOMIC_SEQ_CST);
    while (!__atomic_compare_exchange_n(at, &old, change(old, argument), false, __ATOMIC_SEQ_CST,
                                        __ATOMIC_SEQ_CST)) {
    }
    return old;
  }
  const Arena::Use off(false);
  scene->step(number(at), true);
  const std::uint64_t old = scene->memory().exchange(
      scene->self(), number(at), sizeof(T), order_of(order),
      [&](std::uint64_t before) { return std::uint64_t{change(static_cast<T>(before), argument)}; });
  scene->done(what, number(at), argument, old);
  return static_cast<T>(old);
}

template <class T>
bool compare_exchange(volatile T* at, T* expected, T value, int success, int failure, bool weak) {
  Explorer* const scene = in_scene();
  if (scene == nullptr)
    return __atomic_compare_exchange_n(at, expected, value, false, __ATOMIC_SEQ_CST, __ATOMIC_SEQ_CST);
  const Arena::Use off(false);
  scene->step(number(at), true);
  std::uint64_t found = *expected;
  if (weak && scene->weak_fails()) {
    found = scene->memory().load(scene->self(), number(at), sizeof(T), order_of(failure));
    *expected = static_cast<T>(found);
    scene->done("compare and swap fails weakly", number(at), value, found);
    return false;
  }
  const bool done = scene->memory().compare_exchange(scene->self(), number(at), sizeof(T), order_of(success),
                                                     order_of(failure), found, value);
  if (!done) *expected = static_cast<T>(found);
  scene->done(done ? "compare and swap" : "compare and swap fails", number(at), value, found);
  return done;
}

void read(const void* at, std::size_t size) {
  Explorer* const scene = in_scene();
  if (scene == nullptr || size == 0 || !Arena::holds(number(at))) return;
  const Arena::Use off(false);
  scene->plain_read(number(at), size);
}

void write(const void* at, std::size_t size) {
  Explorer* const scene = in_scene();
  if (scene == nullptr || size == 0 || !Arena::holds(number(at))) return;
  const Arena::Use off(false);
  scene->plain_write(number(at), size);
}

}  // namespace

}  // namespace plchost::models

// NOLINTBEGIN(bugprone-reserved-identifier,readability-identifier-naming,bugprone-macro-parentheses): the
// names are the compiler's
using namespace plchost::models;

extern "C" {

// clang-format off
#define PLCHOST_ATOMIC_CHANGE(bits, name, expression)                                                        \
  std::uint##bits##_t __tsan_atomic##bits##_##name(volatile std::uint##bits##_t* at,                          \
                                                   std::uint##bits##_t argument, int order) {                \
    return change(at, argument, order, #name, [](std::uint##bits##_t old, std::uint##bits##_t by) {          \
      (void)old;                                                                                             \
      return static_cast<std::uint##bits##_t>(expression);                                                   \
    });                                                                                                      \
  }

#define PLCHOST_ATOMIC(bits)                                                                                 \
  std::uint##bits##_t __tsan_atomic##bits##_load(const volatile std::uint##bits##_t* at, int order) {        \
    return load(at, order);                                                                                  \
  }                                                                                                          \
  void __tsan_atomic##bits##_store(volatile std::uint##bits##_t* at, std::uint##bits##_t value, int order) { \
    store(at, value, order);                                                                                 \
  }                                                                                                          \
  bool __tsan_atomic##bits##_compare_exchange_strong(volatile std::uint##bits##_t* at,                       \
                                                     std::uint##bits##_t* expected,                          \
                                                     std::uint##bits##_t value, int success, int failure) {  \
    return compare_exchange(at, expected, value, success, failure, false);                                   \
  }                                                                                                          \
  bool __tsan_atomic##bits##_compare_exchange_weak(volatile std::uint##bits##_t* at,                         \
                                                   std::uint##bits##_t* expected,                            \
                                                   std::uint##bits##_t value, int success, int failure) {    \
    return compare_exchange(at, expected, value, success, failure, true);                                    \
  }                                                                                                          \
  std::uint##bits##_t __tsan_atomic##bits##_compare_exchange_val(                                            \
      volatile std::uint##bits##_t* at, std::uint##bits##_t expected, std::uint##bits##_t value,             \
      int success, int failure) {                                                                            \
    compare_exchange(at, &expected, value, success, failure, false);                                         \
    return expected;                                                                                         \
  }                                                                                                          \
  PLCHOST_ATOMIC_CHANGE(bits, exchange, by)                                                                  \
  PLCHOST_ATOMIC_CHANGE(bits, fetch_add, old + by)                                                           \
  PLCHOST_ATOMIC_CHANGE(bits, fetch_sub, old - by)                                                           \
  PLCHOST_ATOMIC_CHANGE(bits, fetch_and, old & by)                                                           \
  PLCHOST_ATOMIC_CHANGE(bits, fetch_or, old | by)                                                            \
  PLCHOST_ATOMIC_CHANGE(bits, fetch_xor, old ^ by)

PLCHOST_ATOMIC(8)
PLCHOST_ATOMIC(16)
PLCHOST_ATOMIC(32)
PLCHOST_ATOMIC(64)

#define PLCHOST_PLAIN(size)                                                   \
  void __tsan_read##size(void* at) { read(at, size); }                        \
  void __tsan_write##size(void* at) { write(at, size); }                      \
  void __tsan_unaligned_read##size(void* at) { read(at, size); }              \
  void __tsan_unaligned_write##size(void* at) { write(at, size); }

PLCHOST_PLAIN(1)
PLCHOST_PLAIN(2)
PLCHOST_PLAIN(4)
PLCHOST_PLAIN(8)
PLCHOST_PLAIN(16)
// clang-format on

void __tsan_read_range(void* at, std::size_t size) {
  read(at, size);
}
void __tsan_write_range(void* at, std::size_t size) {
  write(at, size);
}
void __tsan_vptr_update(void* at, void* /*value*/) {
  write(at, sizeof(void*));
}
void __tsan_vptr_read(void* at) {
  read(at, sizeof(void*));
}

void __tsan_atomic_thread_fence(int order) {
  Explorer* const scene = in_scene();
  if (scene == nullptr) return;
  const Arena::Use off(false);
  scene->step(0, false);
  scene->memory().fence(scene->self(), order_of(order));
  scene->done("fence", 0, static_cast<std::uint64_t>(order), 0);
}
void __tsan_atomic_signal_fence(int /*order*/) {}

void __tsan_init() {}
void __tsan_func_entry(void* /*caller*/) {}
void __tsan_func_exit() {}

// Copies of a size that the compiler does not know; the linker leads memcpy here (--wrap).
void* __real_memcpy(void* to, const void* from, std::size_t size);
void* __wrap_memcpy(void* to, const void* from, std::size_t size) {
  read(from, size);
  write(to, size);
  return __real_memcpy(to, from, size);
}
void* __real_memset(void* to, int value, std::size_t size);
void* __wrap_memset(void* to, int value, std::size_t size) {
  write(to, size);
  return __real_memset(to, value, size);
}

// C code of a scene has its memory in the arena, too.
void* __real_calloc(std::size_t count, std::size_t size);
void* __wrap_calloc(std::size_t count, std::size_t size) {
  if (!Arena::is_in_use()) return __real_calloc(count, size);
  return Arena::take(count * size, alignof(std::max_align_t));  // all zero
}
void __real_free(void* taken);
void __wrap_free(void* taken) {
  if (!Arena::holds(number(taken))) __real_free(taken);
}

// The clock of a scene stands still: an execution depends on nothing but the decisions.
int __real_clock_gettime(clockid_t clock, timespec* time);
int __wrap_clock_gettime(clockid_t clock, timespec* time) {
  if (!Arena::is_in_use()) return __real_clock_gettime(clock, time);
  *time = {.tv_sec = 1000, .tv_nsec = 0};
  return 0;
}

void* __tsan_memcpy(void* to, const void* from, std::size_t size) {
  return __wrap_memcpy(to, from, size);
}
void* __tsan_memset(void* to, int value, std::size_t size) {
  return __wrap_memset(to, value, size);
}

}  // extern "C"
// NOLINTEND(bugprone-reserved-identifier,readability-identifier-naming,bugprone-macro-parentheses)
