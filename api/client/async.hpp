#pragma once

#include <coroutine>
#include <exception>
#include <expected>
#include <optional>
#include <utility>

// g++ 12 says these of what it makes of each coroutine; clang still checks these files.
#ifndef __clang__
#pragma GCC diagnostic ignored "-Wzero-as-null-pointer-constant"
#pragma GCC diagnostic ignored "-Wsubobject-linkage"
#endif

namespace plchost {

/// A call that is under way: a coroutine that co_returns a T, a Result<...> as a rule. It begins when it is
/// first awaited or started, goes on where its Pump wakes it, and ends early, without a result, when it is
/// destroyed. One thread.
template <class T>
class [[nodiscard]] Async {
 public:
  struct promise_type;  // NOLINT(readability-identifier-naming): the language names it
  using Handle = std::coroutine_handle<promise_type>;

  struct promise_type {  // NOLINT(readability-identifier-naming)
    std::optional<T> result;
    std::exception_ptr error;
    std::coroutine_handle<> awaiting = std::noop_coroutine();

    Async get_return_object() noexcept { return Async(Handle::from_promise(*this)); }
    std::suspend_always initial_suspend() noexcept { return {}; }
    auto final_suspend() noexcept {
      struct GoOn {
        bool await_ready() noexcept { return false; }
        std::coroutine_handle<> await_suspend(Handle ended) noexcept { return ended.promise().awaiting; }
        void await_resume() noexcept {}
      };
      return GoOn{};
    }
    template <class Value>
    void return_value(Value&& value) {
      result.emplace(std::forward<Value>(value));
    }
    void unhandled_exception() noexcept { error = std::current_exception(); }
  };

  Async() noexcept = default;
  Async(Async&& other) noexcept : handle_(std::exchange(other.handle_, {})) {}
  Async& operator=(Async&& other) noexcept {
    std::swap(handle_, other.handle_);
    return *this;
  }
  Async(const Async&) = delete;
  Async& operator=(const Async&) = delete;
  ~Async() {
    if (handle_) handle_.destroy();
  }

  /// Runs to its first wait.
  void start() { handle_.resume(); }
  [[nodiscard]] bool done() const noexcept { return handle_.done(); }
  /// Its result, once it is done.
  [[nodiscard]] T take() {
    promise_type& promise = handle_.promise();
    if (promise.error) std::rethrow_exception(promise.error);
    return *std::move(promise.result);
  }

  /// By another one, once.
  auto operator co_await() noexcept {
    struct Await {
      Async& call;
      bool await_ready() noexcept { return false; }
      std::coroutine_handle<> await_suspend(std::coroutine_handle<> awaiting) noexcept {
        call.handle_.promise().awaiting = awaiting;
        return call.handle_;
      }
      T await_resume() { return call.take(); }
    };
    return Await{*this};
  }

 private:
  explicit Async(Handle handle) noexcept : handle_(handle) {}
  Handle handle_;
};

}  // namespace plchost

// PLCHOST_TRY and PLCHOST_TRY_ASSIGN in an Async.
#define PLCHOST_CO_TRY(...)                                                                      \
  do {                                                                                           \
    if (auto tried = (__VA_ARGS__); !tried) co_return std::unexpected(std::move(tried).error()); \
  } while (false)
#define PLCHOST_CO_TRY_ASSIGN(variable, ...) \
  PLCHOST_CO_TRY_ASSIGN_AS(PLCHOST_TRY_JOIN(plchost_try_, __COUNTER__), variable, __VA_ARGS__)
#define PLCHOST_CO_TRY_ASSIGN_AS(result, variable, ...)              \
  auto result = (__VA_ARGS__);                                       \
  if (!result) co_return std::unexpected(std::move(result).error()); \
  variable = *std::move(result)
