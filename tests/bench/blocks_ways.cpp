#include "tests/bench/blocks_ways.hpp"

#include <algorithm>
#include <cstring>
#include <optional>
#include <span>
#include <vector>

#include <sys/socket.h>
#include <time.h>

#include "shm/block_driver/block_channel.hpp"
#include "shm/block_driver/block_router.hpp"
#include "shm/threads/thread.hpp"
#include "tests/bench/child.hpp"

namespace plchost::bench {

void pause_for(Duration duration) {
  const timespec time = to_timespec(duration);
  ::clock_nanosleep(CLOCK_MONOTONIC, 0, &time, nullptr);
}

namespace {

class SocketPipe : public BlocksPipe {
 public:
  explicit SocketPipe(int fd) noexcept : fd_(fd) {}
  bool send(const void* data, std::size_t size) override {
    return ::send(fd_, data, size, MSG_DONTWAIT) == static_cast<ssize_t>(size);
  }
  std::size_t receive(void* buffer, std::size_t size) override {
    const ssize_t got = ::recv(fd_, buffer, size, MSG_DONTWAIT);
    return got > 0 ? static_cast<std::size_t>(got) : 0;
  }

 private:
  int fd_;
};

class BarePipe : public BlocksPipe {
 public:
  BarePipe(BareRing& out, BareRing& in) noexcept : out_(out), in_(in) {}
  bool send(const void* data, std::size_t size) override {
    const std::uint64_t sent = out_.sent.load(std::memory_order_relaxed);
    if (sent - out_.taken.load(std::memory_order_acquire) == BareRing::kMessages) return false;
    std::memcpy(out_.bytes[sent % BareRing::kMessages].data(), data, size);
    out_.sizes[sent % BareRing::kMessages] = size;
    out_.sent.store(sent + 1, std::memory_order_release);
    return true;
  }
  std::size_t receive(void* buffer, std::size_t size) override {
    const std::uint64_t taken = in_.taken.load(std::memory_order_relaxed);
    if (in_.sent.load(std::memory_order_acquire) == taken) return 0;
    const std::size_t got = std::min<std::size_t>(in_.sizes[taken % BareRing::kMessages], size);
    std::memcpy(buffer, in_.bytes[taken % BareRing::kMessages].data(), got);
    in_.taken.store(taken + 1, std::memory_order_release);
    return got;
  }

 private:
  BareRing& out_;
  BareRing& in_;
};

/// A node with its router's thread.
class OurPipe : public BlocksPipe {
 public:
  static Result<std::unique_ptr<BlocksPipe>> open(const std::string& pool, BlocksSide side) {
    std::unique_ptr<OurPipe> pipe(new OurPipe);
    const NodeOptions options{.pool = pool, .entry = {.name = side == BlocksSide::bench ? "bench" : "peer"}};
    PLCHOST_TRY_ASSIGN(pipe->node_, BlockNode::join(options));
    PLCHOST_TRY_ASSIGN(pipe->router_, BlockRouter::create(*pipe->node_));
    PLCHOST_TRY_ASSIGN(auto channel, BlockChannel::open(*pipe->node_, "bench"));
    pipe->channel_.emplace(std::move(channel));
    PLCHOST_TRY_ASSIGN(pipe->thread_,
                       Thread::start("router", {}, [to = pipe.get()] { to->router_->run(to->stop_); }));
    const std::string_view other = side == BlocksSide::bench ? "peer" : "bench";
    while (pipe->to_ == NodeAddress{}) pipe->to_ = pipe->node_->find(other);
    // One message each way, so that both links are there.
    while (pipe->channel_->send(pipe->to_, {}) != SendResult::sent) pause_for(std::chrono::milliseconds(1));
    Received received;
    while (pipe->channel_->receive({}, received) != TakeResult::taken) {
      pause_for(std::chrono::milliseconds(1));
    }
    return pipe;
  }
  ~OurPipe() override {
    stop_.store(true);
    if (router_) router_->wake();
    thread_.join();
  }
  bool send(const void* data, std::size_t size) override {
    return channel_->send(to_, std::span(static_cast<const std::byte*>(data), size)) == SendResult::sent;
  }
  std::size_t receive(void* buffer, std::size_t size) override {
    Received received;
    const std::span into(static_cast<std::byte*>(buffer), size);
    return channel_->receive(into, received) == TakeResult::taken ? received.size : 0;
  }

 private:
  OurPipe() = default;
  std::unique_ptr<BlockNode> node_;
  std::unique_ptr<BlockRouter> router_;
  std::optional<BlockChannel> channel_;
  NodeAddress to_;
  std::atomic<bool> stop_{false};
  Thread thread_;
};

}  // namespace

std::unique_ptr<BlocksPipe> make_socket_pipe(int fd) {
  return std::make_unique<SocketPipe>(fd);
}

std::unique_ptr<BlocksPipe> make_bare_pipe(BareRing& out, BareRing& in) {
  return std::make_unique<BarePipe>(out, in);
}

Result<std::unique_ptr<BlocksPipe>> make_our_pipe(const std::string& pool, BlocksSide side) {
  return OurPipe::open(pool, side);
}

}  // namespace plchost::bench
