// Included before all C++ that STruC++ has written: its library, with parts that suit a host.
#ifndef PLCHOST_STRUCPP_HPP
#define PLCHOST_STRUCPP_HPP

#include <cstddef>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <exception>
#include <initializer_list>
#include <memory>
#include <mutex>
#include <new>
#include <type_traits>
#include <utility>

#include <pthread.h>

#include "plchost_adapter.h"

extern "C" timespec* plchost_now(void);
extern "C" void plc_log(int level, const char* text);  // of plc_app.h, whose other names the program may have

// Each access to a global takes its mutex. The library's own has no priority inheritance: a task that waits
// for a task of lower priority would wait for all tasks between them, too.
namespace std {
class plchost_mutex {
 public:
  plchost_mutex() noexcept {
    pthread_mutexattr_t attributes;
    pthread_mutexattr_init(&attributes);
    pthread_mutexattr_setprotocol(&attributes, PTHREAD_PRIO_INHERIT);
    pthread_mutex_init(&mutex_, &attributes);
    pthread_mutexattr_destroy(&attributes);
  }
  plchost_mutex(const plchost_mutex&) = delete;
  plchost_mutex& operator=(const plchost_mutex&) = delete;
  ~plchost_mutex() { pthread_mutex_destroy(&mutex_); }
  void lock() { pthread_mutex_lock(&mutex_); }
  void unlock() { pthread_mutex_unlock(&mutex_); }

 private:
  pthread_mutex_t mutex_;
};
}  // namespace std
#define mutex plchost_mutex
#define GlobalVar plchost_global
#include "iec_global.hpp"
#undef GlobalVar
#undef mutex
#include "iec_array.hpp"
#include "iec_enum.hpp"
#include "iec_std_lib.hpp"

// An assignment to a located variable, or to a global. Other variables may share its bits.
template <class T>
class plchost_assigned {
 public:
  explicit plchost_assigned(strucpp::IECVar<T>& variable) noexcept : variable_(variable) {}
  template <class Value>
  void operator=(Value&& value) noexcept {
    strucpp::IECVar<T> next;
    next = std::forward<Value>(value);
    const T now = next.get();
    if (!std::is_arithmetic_v<T> || !plchost_assign(variable_.raw_ptr(), &now)) variable_.set(now);
  }

 private:
  strucpp::IECVar<T>& variable_;
};
template <class T>
plchost_assigned<T> plchost_to(strucpp::IECVar<T>& variable) noexcept {
  return plchost_assigned<T>(variable);
}
template <class Variable>
Variable& plchost_to(Variable& variable) noexcept;  // not evaluated
namespace strucpp {
template <class V>
class GlobalVar : public plchost_global<V> {
 public:
  using plchost_global<V>::plchost_global;
  template <class T>
  void write(T now) {
    if constexpr (std::is_same_v<decltype(plchost_to(this->value)), V&>) {
      plchost_global<V>::write(now);
    } else {
      this->with_lock([&](V* value) { plchost_to(*value) = now; });
    }
  }
};
}  // namespace strucpp

// The library's clock is a variable of each thread, which takes memory at its first use. This one is that of
// the begin of the task's cycle.
namespace strucpp {
inline IEC_TIME plchost_time() {
  const timespec* const now = plchost_now();
  return IEC_TIME(static_cast<TIME_t>(now->tv_sec * 1000000000LL + now->tv_nsec));
}
}  // namespace strucpp
#define TIME(...) plchost_time(__VA_ARGS__)

// Functions of texts, of which each is a literal: the library knows those of variables only.
namespace strucpp {
using plchost_text = IECString<254>;
inline plchost_text LEFT(const char* text, std::size_t count) {
  return LEFT(plchost_text(text), count);
}
inline plchost_text RIGHT(const char* text, std::size_t count) {
  return RIGHT(plchost_text(text), count);
}
inline plchost_text MID(const char* text, std::size_t count, std::size_t from) {
  return MID(plchost_text(text), count, from);
}
template <class... Others>
inline auto CONCAT(const char* first, const char* second, const Others&... others) {
  return CONCAT(plchost_text(first), plchost_text(second), plchost_text(others)...);
}
inline plchost_text DELETE_STR(const char* text, std::size_t count, std::size_t from) {
  return DELETE_STR(plchost_text(text), count, from);
}
inline plchost_text INSERT(const char* text, const char* other, std::size_t at) {
  return INSERT(plchost_text(text), plchost_text(other), at);
}
inline plchost_text REPLACE(const char* text, const char* other, std::size_t count, std::size_t from) {
  return REPLACE(plchost_text(text), plchost_text(other), count, from);
}
inline std::size_t FIND(const char* text, const char* part) {
  return FIND(plchost_text(text), plchost_text(part));
}
inline std::size_t LEN(const char* text) {
  return LEN(plchost_text(text));
}
// Numbers of such texts, and of enumerations.
#define PLCHOST_NUMBER(name)                                  \
  inline IEC_##name TO_##name(const char* text) {             \
    return TO_##name(plchost_text(text));                     \
  }                                                           \
  template <class E>                                          \
  inline IEC_##name TO_##name(const IEC_ENUM_Var<E>& value) { \
    return TO_##name(static_cast<E>(value));                  \
  }
PLCHOST_NUMBER(SINT)
PLCHOST_NUMBER(INT)
PLCHOST_NUMBER(DINT)
PLCHOST_NUMBER(LINT)
PLCHOST_NUMBER(USINT)
PLCHOST_NUMBER(UINT)
PLCHOST_NUMBER(UDINT)
PLCHOST_NUMBER(ULINT)
PLCHOST_NUMBER(REAL)
PLCHOST_NUMBER(LREAL)
#undef PLCHOST_NUMBER
}  // namespace strucpp

// INSERT puts a text behind position P, and that of the library before it.
namespace strucpp {
template <class Text, class Other>
inline auto plchost_insert(const Text& text, const Other& other, long behind) {
  return INSERT(text, other, behind < 0 ? 0 : static_cast<size_t>(behind) + 1);
}
}  // namespace strucpp
#define INSERT plchost_insert

// A temporary variable, which the library keeps from call to call, has its initial value again.
template <class T, class... Values>
inline void plchost_renew(T& variable, Values&&... values) {
  std::destroy_at(&variable);
  ::new (static_cast<void*>(&variable)) T(std::forward<Values>(values)...);
}
// Of an array: "{1, 2, 3}" has no type of its own.
template <class T, class Element>
inline void plchost_renew(T& variable, std::initializer_list<Element> elements) {
  std::destroy_at(&variable);
  ::new (static_cast<void*>(&variable)) T(elements);
}

// The part of a copy that is exchanged at a time: of an array an element. Not evaluated.
template <class T>
T& plchost_piece(T& value);
template <class T, class Bounds>
T& plchost_piece(strucpp::IEC_ARRAY_1D<T, Bounds>& array);
template <class T, class First, class Second>
T& plchost_piece(strucpp::IEC_ARRAY_2D<T, First, Second>& array);
template <class T, class First, class Second, class Third>
T& plchost_piece(strucpp::IEC_ARRAY_3D<T, First, Second, Third>& array);

// An index outside of its array, or a reference to nothing: the library throws. The task gets an exception.
template <class Program>
inline void plchost_run(Program& program) noexcept {
  try {
    program.run();
  } catch (const std::exception& error) {
    plc_log(2, error.what());
    std::abort();
  } catch (...) {
    plc_log(2, "the program threw something that is no std::exception");
    std::abort();
  }
}

// The value of a variable as it lies in memory. The library's own forcing is not used: it would hold a value
// within a cycle, too.
template <class T>
T& plchost_value(T& plain) noexcept {
  return plain;
}
template <class T>
T& plchost_value(strucpp::IECVar<T>& variable) noexcept {
  return *variable.raw_ptr();
}
template <class T>
const T& plchost_value(const strucpp::IECVar<T>& variable) noexcept {
  return *variable.raw_ptr();
}
// These have it as their first member.
template <std::size_t N>
strucpp::IECString<N>& plchost_value(strucpp::IECStringVar<N>& variable) noexcept {
  static_assert(std::is_standard_layout_v<strucpp::IECStringVar<N>>);
  return reinterpret_cast<strucpp::IECString<N>&>(variable);
}
template <std::size_t N>
strucpp::IECWString<N>& plchost_value(strucpp::IECWStringVar<N>& variable) noexcept {
  static_assert(std::is_standard_layout_v<strucpp::IECWStringVar<N>>);
  return reinterpret_cast<strucpp::IECWString<N>&>(variable);
}
template <class E>
strucpp::IEC_ENUM_Value<E>& plchost_value(strucpp::IEC_ENUM_Var<E>& variable) noexcept {
  static_assert(std::is_standard_layout_v<strucpp::IEC_ENUM_Var<E>>);
  return reinterpret_cast<strucpp::IEC_ENUM_Value<E>&>(variable);
}

// An element of an array, or of an array of arrays.
template <class A>
auto plchost_at(A& a, long i) -> decltype((a[i])) {
  return a[i];
}
template <class A>
auto plchost_at(A& a, long i, long j) -> decltype((a(i, j))) {
  return a(i, j);
}
template <class A>
auto plchost_at(A& a, long i, long j) -> decltype((a[i][j])) {
  return a[i][j];
}
template <class A>
auto plchost_at(A& a, long i, long j, long k) -> decltype((a(i, j, k))) {
  return a(i, j, k);
}
template <class A>
auto plchost_at(A& a, long i, long j, long k) -> decltype((a(i, j)[k])) {
  return a(i, j)[k];
}
template <class A>
auto plchost_at(A& a, long i, long j, long k) -> decltype(plchost_at(a[i], j, k)) {
  return plchost_at(a[i], j, k);
}

// A symbol without its place.
struct plchost_shown {
  const char* name;
  unsigned int type;   // PLC_TYPE_...
  unsigned int bytes;  // of that type; 0: of a string
  unsigned int read_only;
  const char* task;
  const char* area;
  struct {
    int first;
    unsigned int count;
  } dimension[3];
};

template <class E>
inline constexpr unsigned int plchost_enumeration = sizeof(E) == 1   ? 2
                                                    : sizeof(E) == 2 ? 3
                                                    : sizeof(E) == 4 ? 4
                                                                     : 5;  // PLC_TYPE_SINT to _LINT

// How a value in memory is to be read; 0: it is not as the table for debuggers has it.
template <class T>
struct plchost_type {
  static constexpr unsigned int of(const plchost_shown& shown) {
    // Arrays and aliases of an enumeration have it bare.
    if constexpr (std::is_enum_v<T>) return plchost_enumeration<T>;
    return std::is_arithmetic_v<T> && sizeof(T) == shown.bytes ? shown.type : 0;
  }
};
template <class Text>
struct plchost_text_type {
  static constexpr unsigned int of(const plchost_shown& shown) {
    return shown.bytes == 0 && sizeof(Text) <= 4096 ? shown.type : 0;  // PLC_MAX_STRING
  }
};
template <std::size_t N>
struct plchost_type<strucpp::IECString<N>> : plchost_text_type<strucpp::IECString<N>> {};
template <std::size_t N>
struct plchost_type<strucpp::IECWString<N>> : plchost_text_type<strucpp::IECWString<N>> {};
template <class E>
struct plchost_type<strucpp::IEC_ENUM_Value<E>> {
  static constexpr unsigned int of(const plchost_shown&) { return plchost_enumeration<E>; }
};

// Where a local variable has its value, in a debug build, and how many bytes a string has there.
template <class T>
void* plchost_local(T& variable) noexcept {
  return const_cast<void*>(static_cast<const void*>(&plchost_value(variable)));
}
template <class T>
inline constexpr unsigned int plchost_bytes = sizeof(plchost_value(std::declval<T&>()));

template <std::size_t... D, class Root, class Path>
bool plchost_find(std::index_sequence<D...>, void (*use)(const plchost_symbol*), Root& root, Path path,
                  const plchost_shown& shown) {
  if constexpr (std::is_invocable_v<Path, Root&, decltype(static_cast<void>(D), 0L)...>) {
    long index[] = {shown.dimension[D].first..., 0};
    auto& first = plchost_value(path(root, index[D]...));
    using Value = std::remove_reference_t<decltype(first)>;
    plchost_symbol symbol = {};
    symbol.name = shown.name;
    symbol.type = plchost_type<std::remove_const_t<Value>>::of(shown);
    symbol.value = const_cast<void*>(static_cast<const void*>(&first));
    symbol.bytes = sizeof first;
    symbol.read_only = shown.read_only != 0 || std::is_const_v<Value>;
    symbol.dimensions = sizeof...(D);
    symbol.task = shown.task;
    symbol.area = shown.area;
    for (std::size_t d = 0; d < sizeof...(D); ++d) {
      symbol.dimension[d].first = shown.dimension[d].first;
      symbol.dimension[d].count = shown.dimension[d].count;
      symbol.dimension[d].stride = sizeof first;
      if (shown.dimension[d].count < 2) continue;
      ++index[d];
      const auto* const next = reinterpret_cast<const char*>(&plchost_value(path(root, index[D]...)));
      symbol.dimension[d].stride = static_cast<unsigned int>(next - static_cast<const char*>(symbol.value));
      --index[d];
    }
    if (symbol.type != 0) use(&symbol);
    return symbol.type != 0;
  } else {
    return false;
  }
}

// `path` finds a variable in `root`, by the indexes of its dimensions.
template <std::size_t Dimensions, class Root, class Path>
void plchost_show(void (*use)(const plchost_symbol*), Root& root, Path path, const plchost_shown& shown) {
  if (plchost_find(std::make_index_sequence<Dimensions>(), use, root, path, shown)) return;
  char text[200];
  std::snprintf(text, sizeof text, "%s cannot be seen from outside: STruC++ keeps it %s", shown.name,
                shown.bytes == 0 ? "as a text of more than 4096 bytes" : "in another way");
  plc_log(1, text);
}

#endif
