// Blocks between two processes on two cores. CmpBlkDrvShm stands beside iceoryx, a Unix datagram socket, and
// memcpy both within one core and into and out of shared memory, from core to core.
// Each way copies what is sent in, and what is received out.

#include <algorithm>
#include <array>
#include <atomic>
#include <cstring>
#include <new>

#include <fmt/format.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include "shm/base/system_call.hpp"
#include "shm/base/unique_fd.hpp"
#include "shm/block_driver/node_directory.hpp"
#include "tests/bench/apart.hpp"
#include "tests/bench/blocks_pipe.hpp"
#include "tests/bench/blocks_roudi.hpp"
#include "tests/bench/blocks_ways.hpp"
#include "tests/bench/child.hpp"
#include "tests/bench/parts.hpp"
#include "tests/support/own_name.hpp"

namespace plchost::bench {

namespace {

constexpr Duration kBlocksSlice = std::chrono::milliseconds(500);
constexpr std::size_t kMostBlockSamples = 1'000'000;  // of a row, or half as many more
constexpr std::size_t kLargest = kMaxBlockSize;
constexpr std::array<std::size_t, 3> kBlockSizes = {64, 512, kLargest};

enum class Way : std::uint32_t { ours, iceoryx, socket, bare, memcpy };
enum class Mode : std::uint32_t { echo, sink };

/// Shared by the two processes: the order for the peer.
struct WaysBoard {
  std::atomic<std::uint32_t> ordered{0};  // orders given so far
  std::atomic<std::uint32_t> begun{0};
  std::atomic<std::uint32_t> ended{0};
  std::atomic<Way> way{};
  std::atomic<Mode> mode{};
  std::atomic<bool> stop{false};
  std::atomic<bool> ready{false};  // the peer has all its pipes
  std::atomic<bool> quit{false};
  alignas(64) std::atomic<std::uint64_t> received{0};  // messages
  BareRing to_peer;
  BareRing to_bench;
};

/// All ways of one side. iceoryx is left out where it is not installed.
struct Pipes {
  std::unique_ptr<BlocksPipe> ours;
  std::unique_ptr<BlocksPipe> iceoryx;
  std::unique_ptr<BlocksPipe> socket;
  std::unique_ptr<BlocksPipe> bare;

  static Result<Pipes> open(const std::string& pool, WaysBoard& board, BlocksSide side, int socket,
                            bool with_iceoryx) {
    Pipes pipes;
    PLCHOST_TRY_ASSIGN(pipes.ours, make_our_pipe(pool, side));
    pipes.socket = make_socket_pipe(socket);
    const bool here = side == BlocksSide::bench;
    pipes.bare = make_bare_pipe(here ? board.to_peer : board.to_bench, here ? board.to_bench : board.to_peer);
    if (with_iceoryx) pipes.iceoryx = make_iceoryx_pipe(pool, side);
    return pipes;
  }
  [[nodiscard]] BlocksPipe* of(Way way) const {
    if (way == Way::bare) return bare.get();
    return way == Way::ours ? ours.get() : way == Way::iceoryx ? iceoryx.get() : socket.get();
  }
};

/// The peer's side of one slice.
void answer(BlocksPipe& pipe, WaysBoard& board) {
  std::vector<std::byte> buffer(kLargest);
  const bool echo = board.mode.load() == Mode::echo;
  board.begun.store(board.ordered.load());
  // A block that is still under way when the slice ends is taken as well.
  for (int idle = 0; !board.stop.load(std::memory_order_relaxed) || idle < 1000;) {
    const std::size_t size = pipe.receive(buffer.data(), buffer.size());
    idle = size == 0 ? idle + 1 : 0;
    if (size == 0) continue;
    if (!echo) board.received.fetch_add(1, std::memory_order_relaxed);
    while (echo && !pipe.send(buffer.data(), size) && !board.stop.load(std::memory_order_relaxed)) {
    }
  }
}

int run_peer(const Plan& plan, WaysBoard& board, const std::string& pool, int socket, bool with_iceoryx) {
  if (!bind_thread({plan.poster_core})) return 1;
  const auto pipes = Pipes::open(pool, board, BlocksSide::peer, socket, with_iceoryx);
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

/// Both sides of all ways, and the measurement with them.
class Pair {
 public:
  Pair(const Plan& plan, WaysBoard& board, const Pipes& pipes) : plan_(plan), board_(board), pipes_(pipes) {}

  /// Half the time there and back.
  Result<void> latency(Way way, std::size_t size, Duration slice, Samples& into) {
    Samples samples(kMostBlockSamples / 2);
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
    if (into.size() < kMostBlockSamples) into.append(samples);
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
    PLCHOST_TRY_ASSIGN(auto thread, Thread::start("blocks", kPriority, [&] {
                         measure(*pipes_.of(way));
                         board_.stop.store(true);
                       }));
    thread.join();
    while (board_.ended.load() != order) pause_for(std::chrono::milliseconds(1));
    return {};
  }

  const Plan& plan_;
  WaysBoard& board_;
  const Pipes& pipes_;
};

std::string size_text(std::size_t size) {
  return size < 1024 ? fmt::format("{}B", size) : fmt::format("{}KiB", size / 1024);
}

constexpr const char* kNoIceoryx = "iceoryx is not installed: the floor is the Unix datagram socket";

Result<Row> measure_latency(const Plan& plan, Pair& pair, std::size_t size, bool with_iceoryx) {
  Row row{.name = fmt::format("blocks/latency/{}", size_text(size)), .sample = "a block, one way"};
  Samples socket;
  Samples bare;
  std::vector<Subject> subjects{
      [&](Duration slice) { return pair.latency(Way::ours, size, slice, row.ours); },
      [&](Duration slice) { return pair.latency(Way::bare, size, slice, bare); },
      [&](Duration slice) { return pair.latency(Way::socket, size, slice, socket); }};
  if (with_iceoryx) {
    subjects.emplace_back([&](Duration slice) { return pair.latency(Way::iceoryx, size, slice, row.floor); });
  }
  PLCHOST_TRY(alternate(plan, subjects, kBlocksSlice));
  row.extra = {{"socket_p50_us", summarise(socket).p50},
               {"socket_p99_us", summarise(socket).p99},
               {"bare_p50_us", summarise(bare).p50},
               {"bare_p99_us", summarise(bare).p99}};
  if (!with_iceoryx) {
    row.floor = socket;
    row.note = kNoIceoryx;
  } else {
    row.targets = {{"median below iceoryx's", "us", summarise(row.ours).p50, summarise(row.floor).p50}};
  }
  return row;
}

double gigabytes_per_second(std::size_t size, const Samples& times) {
  const double us = summarise(times).p50;
  return ratio(static_cast<double>(size), us) / 1e3;
}

Result<Row> measure_throughput(const Plan& plan, Pair& pair, std::size_t size, bool with_iceoryx) {
  Row row{.name = fmt::format("blocks/throughput/{}", size_text(size)),
          .sample = "a slice's mean of a block"};
  Samples iceoryx;
  Samples socket;
  Samples bare;
  const auto subject = [&](Way way, Samples& into) -> Subject {
    return [&pair, size, way, &into](Duration slice) { return pair.throughput(way, size, slice, into); };
  };
  std::vector<Subject> subjects{subject(Way::ours, row.ours), subject(Way::memcpy, row.floor),
                                subject(Way::bare, bare), subject(Way::socket, socket)};
  if (with_iceoryx) subjects.push_back(subject(Way::iceoryx, iceoryx));
  PLCHOST_TRY(alternate(plan, subjects, kBlocksSlice));
  const double ours = gigabytes_per_second(size, row.ours);
  const double memcpy = gigabytes_per_second(size, row.floor);
  const double across = gigabytes_per_second(size, bare);
  row.extra = {{"gb_s", ours},
               {"memcpy_gb_s", memcpy},
               {"memcpy_across_gb_s", across},
               {"socket_gb_s", gigabytes_per_second(size, socket)}};
  if (with_iceoryx) row.extra.emplace_back("iceoryx_gb_s", gigabytes_per_second(size, iceoryx));
  if (size == kLargest) {
    row.targets = {{"half of memcpy's GB/s, from core to core, below ours", "GB/s", across / 2, ours},
                   {"half of memcpy's GB/s, within one core's caches, below ours", "GB/s", memcpy / 2, ours}};
  }
  row.note = with_iceoryx ? "floor: memcpy in one thread" : kNoIceoryx;
  return row;
}

Result<std::vector<Row>> measure_all(const Plan& plan, WaysBoard& board, const std::string& pool, int socket,
                                     bool with_iceoryx) {
  const auto pipes = [&] {
    const OnCore routers_inherit_it(plan.task_core);
    return Pipes::open(pool, board, BlocksSide::bench, socket, with_iceoryx);
  }();
  if (!pipes) return std::unexpected(pipes.error());
  while (!board.ready.load()) pause_for(std::chrono::milliseconds(1));
  Pair pair(plan, board, *pipes);
  std::vector<Row> rows;
  for (const auto measure : {&measure_latency, &measure_throughput}) {
    for (const std::size_t size : kBlockSizes) {
      PLCHOST_TRY_ASSIGN(auto row, measure(plan, pair, size, with_iceoryx));
      rows.push_back(std::move(row));
    }
  }
  board.quit.store(true);
  return rows;
}

Result<std::vector<Row>> measure_pair(const Plan& plan, const std::string& pool) {
  void* memory =
      ::mmap(nullptr, sizeof(WaysBoard), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
  if (memory == MAP_FAILED) return failure(ErrorCode::system, "mmap", errno);
  auto* const board = new (memory) WaysBoard;
  std::array<int, 2> ends{};
  if (::socketpair(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0, ends.data()) != 0) {
    return failure(ErrorCode::system, "socketpair", errno);
  }
  const UniqueFd mine(ends[0]);
  const UniqueFd theirs(ends[1]);
  const bool with_iceoryx = has_iceoryx() && is_installed("iox-roudi");
  RouDi roudi(pool);
  if (with_iceoryx) {
    PLCHOST_TRY(roudi.start());
  }
  const pid_t parent = ::getpid();
  const pid_t peer = ::fork();
  if (peer < 0) return failure(ErrorCode::system, "fork", errno);
  if (peer == 0) {
    end_with(parent, SIGKILL);
    ::_exit(run_peer(plan, *board, pool, theirs.get(), with_iceoryx));
  }
  auto rows = measure_all(plan, *board, pool, mine.get(), with_iceoryx);
  if (!rows) ::kill(peer, SIGKILL);
  int status = 0;
  ::waitpid(peer, &status, 0);
  NodeDirectory::remove(pool);
  ::munmap(memory, sizeof(WaysBoard));
  return rows;
}

}  // namespace

Result<std::vector<Row>> measure_blocks(const Plan& plan) {
  // iceoryx can be used once in a process: it does not part from its daemon.
  const std::string pool = own_name("bench");
  return measure_apart([&] { return measure_pair(plan, pool); });
}

}  // namespace plchost::bench
