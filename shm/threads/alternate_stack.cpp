#include <algorithm>
#include <utility>

#include <sys/mman.h>
#include <unistd.h>

#include "shm/base/system_call.hpp"
#include "shm/threads/thread.hpp"

namespace plchost {

namespace {

std::size_t page() noexcept {
  return static_cast<std::size_t>(::sysconf(_SC_PAGESIZE));
}

// The processor's state as the kernel stores it, twice: the handler may read a stack that has a fault itself.
// And room for the handlers.
std::size_t usable_size() noexcept {
#if defined(PLCHOST_THREAD_SANITIZER) || defined(PLCHOST_ADDRESS_SANITIZER)
  constexpr std::size_t kHandler = std::size_t{128} << 10;
#else
  constexpr std::size_t kHandler = std::size_t{16} << 10;
#endif
  const auto frame = static_cast<std::size_t>(std::max(::sysconf(_SC_MINSIGSTKSZ), 0L));
  return (2 * frame + kHandler + page() - 1) / page() * page();
}

}  // namespace

Result<AlternateStack> AlternateStack::make() {
  const std::size_t size = usable_size() + 2 * page();
  void* const memory =
      ::mmap(nullptr, size, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS | MAP_STACK, -1, 0);
  if (memory == MAP_FAILED)
    return failure(ErrorCode::system, "cannot allocate the alternate signal stack", errno);
  AlternateStack stack(static_cast<std::byte*>(memory), size);
  for (std::byte* const guard : {stack.memory_, stack.memory_ + size - page()}) {
    PLCHOST_TRY(check_errno(::mprotect(guard, page(), PROT_NONE), "cannot guard the signal stack"));
  }
  return stack;
}

AlternateStack::AlternateStack(AlternateStack&& other) noexcept
    : memory_(std::exchange(other.memory_, nullptr)), size_(other.size_) {}

AlternateStack::~AlternateStack() {
  if (memory_ != nullptr) ::munmap(memory_, size_);
}

// Neither can fail: the memory is there and large enough, and no handler runs on it here.
AlternateStack::Use::Use(const AlternateStack& stack) noexcept {
  const stack_t wanted{.ss_sp = stack.memory_ + page(), .ss_flags = 0, .ss_size = stack.size_ - 2 * page()};
  ::sigaltstack(&wanted, &before_);
}

AlternateStack::Use::~Use() {
  ::sigaltstack(&before_, nullptr);
}

}  // namespace plchost
