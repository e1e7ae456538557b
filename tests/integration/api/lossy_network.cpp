// Loaded with LD_PRELOAD: the network loses datagrams with the text $LOST_TEXT for $LOST_MS from the first
// one on. The file $LOST_MARK is made when that is lost.
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <span>

#include <fcntl.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <unistd.h>

namespace {

std::atomic<std::int64_t> first_ns{0};

std::int64_t now_ns() {
  timespec now{};
  ::clock_gettime(CLOCK_MONOTONIC, &now);
  return now.tv_sec * std::int64_t{1'000'000'000} + now.tv_nsec;
}

bool loses() {
  const char* const lost_ms = std::getenv("LOST_MS");  // NOLINT(concurrency-mt-unsafe): never changed
  if (lost_ms == nullptr) return false;
  const std::int64_t loss_ns = std::strtol(lost_ms, nullptr, 10) * 1'000'000;
  const std::int64_t now = now_ns();
  std::int64_t first = 0;
  if (first_ns.compare_exchange_strong(first, now)) {
    const char* const mark = std::getenv("LOST_MARK");  // NOLINT(concurrency-mt-unsafe): never changed
    if (mark != nullptr) ::close(::open(mark, O_CREAT | O_WRONLY | O_CLOEXEC, 0600));
    return true;
  }
  return now - first < loss_ns;
}

// A text is in one sample, and each sample in one piece.
bool has_lost_text(std::span<const iovec> pieces) {
  const char* const text = std::getenv("LOST_TEXT");  // NOLINT(concurrency-mt-unsafe): never changed
  if (text == nullptr) return false;
  for (const iovec& piece : pieces) {
    if (::memmem(piece.iov_base, piece.iov_len, text, std::strlen(text)) != nullptr) return true;
  }
  return false;
}

ssize_t size_of(std::span<const iovec> pieces) {
  std::size_t size = 0;
  for (const iovec& piece : pieces) size += piece.iov_len;
  return static_cast<ssize_t>(size);
}

}  // namespace

extern "C" __attribute__((visibility("default"))) ssize_t sendmsg(int socket, const msghdr* message,
                                                                  int flags) {
  const std::span<const iovec> pieces(message->msg_iov, message->msg_iovlen);
  const bool to_network = message->msg_name != nullptr;
  if (to_network && has_lost_text(pieces) && loses()) return size_of(pieces);
  return ::syscall(SYS_sendmsg, socket, message, flags);
}
