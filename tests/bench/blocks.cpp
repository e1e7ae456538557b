// Blocks between two processes on two cores: CmpBlkDrvShm beside iceoryx, a Unix datagram socket and memcpy.
// Each way copies what is sent in, and what is received out.

#include <algorithm>
#include <array>
#include <atomic>
#include <cstring>
#include <new>
#include <optional>

#include <fcntl.h>
#include <fmt/format.h>
#include <signal.h>
#include <spawn.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#include "shm/base/system_call.hpp"
#include "shm/base/unique_fd.hpp"
#include "shm/block_driver/block_channel.hpp"
#include "shm/block_driver/block_router.hpp"
#include "tests/bench/blocks_pipe.hpp"
#include "tests/bench/child.hpp"
#include "tests/bench/parts.hpp"

namespace plchost::bench {

namespace {

constexpr Duration kBlocksSlice = std::chrono::milliseconds(500);
constexpr std::size_t kLargest = kMaxBlockSize;
constexpr std::array<std::size_t, 3> kSizes = {64, 512, kLargest};

enum class Way : std::uint32_t { ours, iceoryx, socket, memcpy };
enum class Mode : std::uint32_t { echo, sink };

void pause_for(Duration duration) {
  const timespec time = to_timespec(duration);
  ::clock_nanosleep(CLOCK_MONOTONIC, 0, &time, nullptr);
}

/// Shared by the two processes: what the peer is to do.
struct Board {
  std::atomic<std::uint32_t> ordered{0};  // orders given so far
  std::atomic<std::uint32_t> begun{0};
  std::atomic<std::uint32_t> ended{0};
  std::atomic<Way> way{};
  std::atomic<Mode> mode{};
  std::atomic<bool> stop{false};
  std::atomic<bool> ready{false};  // the peer has all its pipes
  std::atomic<bool> quit{false};
  alignas(64) std::atomic<std::uint64_t> received{0};  // messages
};

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

/// A node with its router's thread.
class OurPipe : public BlocksPipe {
 public:
  static Result<std::unique_ptr<OurPipe>> open(const std::string& pool, BlocksSide side) {
    std::unique_ptr<OurPipe> pipe(new OurPipe);
    const NodeOptions options{.pool = pool, .entry = {.name = side == BlocksSide::bench ? "bench" : "peer"}};
    auto node = BlockNode::join(options);
    if (!node) return std::unexpected(std::move(node).error());
    pipe->node_ = *std::move(node);
    auto router = BlockRouter::create(*pipe->node_);
    if (!router) return std::unexpected(std::move(router).error());
    pipe->router_ = *std::move(router);
    auto channel = BlockChannel::open(*pipe->node_, "bench");
    if (!channel) return std::unexpected(std::move(channel).error());
    pipe->channel_.emplace(*std::move(channel));
    auto thread = Thread::start("router", {}, [to = pipe.get()] { to->router_->run(to->stop_); });
    if (!thread) return std::unexpected(std::move(thread).error());
    pipe->thread_ = *std::move(thread);
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

/// All ways of one side. iceoryx is left out where it is not installed.
struct Pipes {
  std::unique_ptr<BlocksPipe> ours;
  std::unique_ptr<BlocksPipe> iceoryx;
  std::unique_ptr<BlocksPipe> socket;

  static Result<Pipes> open(const std::string& pool, BlocksSide side, int socket, bool with_iceoryx) {
    Pipes pipes;
    auto ours = OurPipe::open(pool, side);
    if (!ours) return std::unexpected(std::move(ours).error());
    pipes.ours = *std::move(ours);
    pipes.socket = std::make_unique<SocketPipe>(socket);
    if (with_iceoryx) pipes.iceoryx = make_iceoryx_pipe(pool, side);
    return pipes;
  }
  [[nodiscard]] BlocksPipe* of(Way way) const {
    return way == Way::ours ? ours.get() : way == Way::iceoryx ? iceoryx.get() : socket.get();
  }
};

/// The peer's side of one slice.
void answer(BlocksPipe& pipe, Board& board) {
  std::vector<std::byte> buffer(kLargest);
  const bool echo = board.mode.load() == Mode::echo;
  board.begun.store(board.ordered.load());
  // What is still under way when the slice ends is taken as well.
  for (int idle = 0; !board.stop.load(std::memory_order_relaxed) || idle < 1000;) {
    const std::size_t size = pipe.receive(buffer.data(), buffer.size());
    idle = size == 0 ? idle + 1 : 0;
    if (size == 0) continue;
    if (!echo) board.received.fetch_add(1, std::memory_order_relaxed);
    while (echo && !pipe.send(buffer.data(), size) && !board.stop.load(std::memory_order_relaxed)) {
    }
  }
}

int run_peer(const Plan& plan, Board& board, const std::string& pool, int socket, bool with_iceoryx) {
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (!bind_thread({plan.poster_core})) return 1;
  const auto pipes = Pipes::open(pool, BlocksSide::peer, socket, with_iceoryx);
  if (!pipes) return 1;
  board.ready.store(true);
  for (std::uint32_t done = 0; !board.quit.load();) {
    if (board.ordered.load() == done) {
      pause_for(std::chrono::milliseconds(1));
      continue;
    }
    done = board.ordered.load();
    auto thread = Thread::start("peer", kPriority, [&] { answer(*pipes->of(board.way.load()), board); });
    if (!thread) return 1;
    thread->join();
    board.ended.store(done);
  }
  return 0;
}

/// Both sides of all ways, and who measures with them.
class Pair {
 public:
  Pair(const Plan& plan, Board& board, const Pipes& pipes) : plan_(plan), board_(board), pipes_(pipes) {}

  /// Half the time there and back.
  Result<void> latency(Way way, std::size_t size, Duration slice, Samples& into) {
    Samples samples(static_cast<std::size_t>(slice / std::chrono::nanoseconds(100)));
    auto done = with_peer(way, Mode::echo, [&](BlocksPipe& pipe) {
      std::vector<std::byte> out(size, std::byte{1});
      std::vector<std::byte> in(kLargest);
      const TimePoint begin = MonotonicClock::now();
      for (TimePoint now = begin; now - begin < slice;) {
        while (!pipe.send(out.data(), out.size())) {
        }
        while (pipe.receive(in.data(), in.size()) == 0) {
        }
        const TimePoint after = MonotonicClock::now();
        if (after - begin > kWarmUp / 4) samples.add((after - now) / 2);
        now = after;
      }
    });
    into.append(samples);
    return done;
  }

  /// The time of a message when they are sent as fast as they go; one figure for each slice.
  Result<void> throughput(Way way, std::size_t size, Duration slice, Samples& into) {
    if (way == Way::memcpy) return copy(size, slice, into);
    Duration time{};
    board_.received.store(0);
    auto done = with_peer(way, Mode::sink, [&](BlocksPipe& pipe) {
      const std::vector<std::byte> out(size, std::byte{1});
      const TimePoint begin = MonotonicClock::now();
      std::uint64_t sent = 0;
      while (MonotonicClock::now() - begin < slice) {
        if (pipe.send(out.data(), out.size())) ++sent;
      }
      while (board_.received.load(std::memory_order_relaxed) < sent) {
      }
      time = MonotonicClock::now() - begin;
    });
    const auto count = static_cast<std::int64_t>(board_.received.load());
    if (done && count > 0) into.push(time / count);
    return done;
  }

 private:
  /// In one thread, from one buffer to another: both stay in its caches.
  Result<void> copy(std::size_t size, Duration slice, Samples& into) {
    const OnCore measured(plan_.task_core);
    auto thread = Thread::start("memcpy", kPriority, [&] {
      const std::vector<std::byte> from(size, std::byte{1});
      std::vector<std::byte> to(size);
      std::int64_t count = 0;
      const TimePoint begin = MonotonicClock::now();
      for (; MonotonicClock::now() - begin < slice; ++count) {
        std::memcpy(to.data(), from.data(), size);
        asm volatile("" : : "r"(to.data()) : "memory");  // it is read
      }
      into.push((MonotonicClock::now() - begin) / count);
    });
    if (!thread) return std::unexpected(std::move(thread).error());
    thread->join();
    return {};
  }

  Result<void> with_peer(Way way, Mode mode, const std::function<void(BlocksPipe&)>& measure) {
    board_.way.store(way);
    board_.mode.store(mode);
    board_.stop.store(false);
    const std::uint32_t order = board_.ordered.fetch_add(1) + 1;
    while (board_.begun.load() != order) pause_for(std::chrono::milliseconds(1));
    const OnCore measured(plan_.task_core);
    auto thread = Thread::start("blocks", kPriority, [&] {
      measure(*pipes_.of(way));
      board_.stop.store(true);
    });
    if (!thread) return std::unexpected(std::move(thread).error());
    thread->join();
    while (board_.ended.load() != order) pause_for(std::chrono::milliseconds(1));
    return {};
  }

  const Plan& plan_;
  Board& board_;
  const Pipes& pipes_;
};

/// iceoryx's daemon. It is killed at the end: asked to end, it would first end its clients, which this is one
/// of.
class RouDi {
 public:
  RouDi() noexcept = default;
  RouDi(const RouDi&) = delete;
  RouDi& operator=(const RouDi&) = delete;
  ~RouDi() {
    if (pid_ == 0) return;
    ::kill(pid_, SIGKILL);
    int status = 0;
    ::waitpid(pid_, &status, 0);
    for (const char* left : {"/iceoryx_mgmt", "/root"}) ::shm_unlink(left);
  }
  [[nodiscard]] Result<void> start() {
    // Without monitoring: a process that measures keeps its other threads waiting.
    std::array<std::string, 5> words{"iox-roudi", "-m", "off", "-l", "off"};
    std::array<char*, 6> arguments{};
    std::ranges::transform(words, arguments.begin(), [](std::string& word) { return word.data(); });
    posix_spawn_file_actions_t files;
    posix_spawn_file_actions_init(&files);
    posix_spawn_file_actions_addopen(&files, STDOUT_FILENO, "/dev/null", O_WRONLY, 0);
    posix_spawn_file_actions_addopen(&files, STDERR_FILENO, "/dev/null", O_WRONLY, 0);
    const int error = ::posix_spawnp(&pid_, words[0].c_str(), &files, nullptr, arguments.data(), environ);
    posix_spawn_file_actions_destroy(&files);
    return check_returned(error, "start iox-roudi");
  }

 private:
  pid_t pid_ = 0;
};

std::string size_text(std::size_t size) {
  return size < 1024 ? fmt::format("{}B", size) : fmt::format("{}KiB", size / 1024);
}

constexpr const char* kNoIceoryx = "iceoryx is not installed: the floor is the Unix datagram socket";

Result<Row> measure_latency(const Plan& plan, Pair& pair, std::size_t size, bool with_iceoryx) {
  Row row{.name = fmt::format("blocks/latency/{}", size_text(size))};
  Samples socket;
  std::vector<Subject> subjects{
      [&](Duration slice) { return pair.latency(Way::ours, size, slice, row.ours); },
      [&](Duration slice) { return pair.latency(Way::socket, size, slice, socket); }};
  if (with_iceoryx) {
    subjects.emplace_back([&](Duration slice) { return pair.latency(Way::iceoryx, size, slice, row.floor); });
  }
  if (auto done = alternate(plan, subjects, kBlocksSlice); !done) {
    return std::unexpected(std::move(done).error());
  }
  row.extra = {{"socket_p50_us", summarise(socket).p50}, {"socket_p99_us", summarise(socket).p99}};
  if (!with_iceoryx) {
    row.floor = socket;
    row.note = kNoIceoryx;
  } else {
    row.targets = {{"median below iceoryx's", summarise(row.ours).p50, summarise(row.floor).p50}};
  }
  return row;
}

double gigabytes_per_second(std::size_t size, const Samples& times) {
  const double us = summarise(times).p50;
  return us > 0 ? static_cast<double>(size) / us / 1e3 : 0;
}

Result<Row> measure_throughput(const Plan& plan, Pair& pair, std::size_t size, bool with_iceoryx) {
  Row row{.name = fmt::format("blocks/throughput/{}", size_text(size))};
  Samples iceoryx;
  Samples socket;
  const auto subject = [&](Way way, Samples& into) -> Subject {
    return [&pair, size, way, &into](Duration slice) { return pair.throughput(way, size, slice, into); };
  };
  std::vector<Subject> subjects{subject(Way::ours, row.ours), subject(Way::memcpy, row.floor),
                                subject(Way::socket, socket)};
  if (with_iceoryx) subjects.push_back(subject(Way::iceoryx, iceoryx));
  if (auto done = alternate(plan, subjects, kBlocksSlice); !done) {
    return std::unexpected(std::move(done).error());
  }
  const double ours = gigabytes_per_second(size, row.ours);
  const double memcpy = gigabytes_per_second(size, row.floor);
  row.extra = {{"gb_s", ours}, {"memcpy_gb_s", memcpy}, {"socket_gb_s", gigabytes_per_second(size, socket)}};
  if (with_iceoryx) row.extra.emplace_back("iceoryx_gb_s", gigabytes_per_second(size, iceoryx));
  if (size == kLargest) row.targets = {{"half of memcpy's GB/s below ours", memcpy / 2, ours}};
  row.note = with_iceoryx ? "floor: memcpy in one thread" : kNoIceoryx;
  return row;
}

Result<std::vector<Row>> measure_all(const Plan& plan, Board& board, const std::string& pool, int socket,
                                     bool with_iceoryx) {
  const auto pipes = [&] {
    const OnCore routers_inherit_it(plan.task_core);
    return Pipes::open(pool, BlocksSide::bench, socket, with_iceoryx);
  }();
  if (!pipes) return std::unexpected(pipes.error());
  while (!board.ready.load()) pause_for(std::chrono::milliseconds(1));
  Pair pair(plan, board, *pipes);
  std::vector<Row> rows;
  for (const auto measure : {&measure_latency, &measure_throughput}) {
    for (const std::size_t size : kSizes) {
      auto row = measure(plan, pair, size, with_iceoryx);
      if (!row) return std::unexpected(std::move(row).error());
      rows.push_back(*std::move(row));
    }
  }
  board.quit.store(true);
  return rows;
}

}  // namespace

Result<std::vector<Row>> measure_blocks(const Plan& plan) {
  void* memory = ::mmap(nullptr, sizeof(Board), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
  if (memory == MAP_FAILED) return failure(ErrorCode::system, "mmap", errno);
  auto* const board = new (memory) Board;
  std::array<int, 2> ends{};
  if (::socketpair(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0, ends.data()) != 0) {
    return failure(ErrorCode::system, "socketpair", errno);
  }
  const UniqueFd mine(ends[0]);
  const UniqueFd theirs(ends[1]);
  const std::string pool = fmt::format("plchost-bench-{}", ::getpid());
  const bool with_iceoryx = has_iceoryx() && is_installed("iox-roudi");
  RouDi roudi;
  if (with_iceoryx) {
    if (auto started = roudi.start(); !started) return std::unexpected(std::move(started).error());
  }
  const pid_t peer = ::fork();
  if (peer < 0) return failure(ErrorCode::system, "fork", errno);
  if (peer == 0) ::_exit(run_peer(plan, *board, pool, theirs.get(), with_iceoryx));
  auto rows = measure_all(plan, *board, pool, mine.get(), with_iceoryx);
  if (!rows) ::kill(peer, SIGKILL);
  int status = 0;
  ::waitpid(peer, &status, 0);
  NodeDirectory::remove(pool);
  ::munmap(memory, sizeof(Board));
  return rows;
}

}  // namespace plchost::bench
