// The application of the campaigns and of the soak. It counts its cycles, and the runs for each post, in a
// file that no process of plchost knows, by a clock of its own. So the figures of plchost are held against
// another count. Its other events are faults that an application can have beyond those of task_faults.

#include <array>
#include <atomic>
#include <chrono>
#include <csignal>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include "instances/plc_app.hpp"

namespace {

using namespace std::chrono_literals;

// As tests/campaigns/host.py reads it.
constexpr std::size_t kEvents = 8;
constexpr std::size_t kTasks = 40;
struct Board {
  std::atomic<std::uint64_t> starts;
  std::atomic<std::uint64_t> cycles;   // of Fast
  std::atomic<std::uint64_t> lost;     // of its releases, by its own clock
  std::atomic<std::uint64_t> longest;  // ns between two starts of it
  std::array<std::atomic<std::uint64_t>, 4> unused;
  std::array<std::atomic<std::uint64_t>, kEvents> runs;
  std::array<std::atomic<std::uint64_t>, kTasks> others;  // cycles of the other tasks
};
static_assert(sizeof(Board) == (8 + kEvents + kTasks) * 8);

constexpr auto kInterval = 2ms;

Board* map_board() {
  const char* const folder = std::getenv("PLC_CAMPAIGN");
  const std::string path =
      std::string(folder != nullptr ? folder : "") + "/" + std::string(plc::instance_name()) + ".board";
  const int file = ::open(path.c_str(), O_RDWR | O_CLOEXEC);
  if (file < 0) return nullptr;
  void* const memory = ::mmap(nullptr, sizeof(Board), PROT_READ | PROT_WRITE, MAP_SHARED, file, 0);
  ::close(file);
  return memory == MAP_FAILED ? nullptr : static_cast<Board*>(memory);
}

Board* board = nullptr;
plc::Area<std::uint64_t> retained;  // cycles of Fast

void fast() {
  static std::chrono::steady_clock::time_point before{};
  const auto now = std::chrono::steady_clock::now();
  if (before.time_since_epoch().count() != 0) {
    const auto ns = static_cast<std::uint64_t>((now - before).count());
    const auto interval = static_cast<std::uint64_t>(std::chrono::nanoseconds(kInterval).count());
    // Late by less than half of an interval is no loss.
    if (ns > interval + interval / 2) board->lost += (ns + interval / 2) / interval - 1;
    if (ns > board->longest) board->longest = ns;
  }
  before = now;
  ++board->cycles;
  ++*retained;
}

// ---- Faults
// ------------------------------------------------------------------------------------------------

// Bounded: the machine has other programs.
constexpr std::size_t kMebibytes = 192;
constexpr int kChildren = 20;
constexpr int kThreads = 100;
constexpr int kDescriptors = 100'000;

void grow() {
  for (std::size_t i = 0; i < kMebibytes; ++i) {
    constexpr std::size_t kSize = std::size_t{1} << 20;
    void* const memory = ::mmap(nullptr, kSize, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    if (memory == MAP_FAILED) return;
    std::memset(memory, 1, kSize);
  }
}

void open_all() {
  for (int i = 0; i < kDescriptors; ++i) {
    if (::open("/dev/null", O_RDONLY | O_CLOEXEC) < 0) return;
  }
}

void fork_many() {
  for (int i = 0; i < kChildren; ++i) {
    if (::fork() == 0) {
      for (;;) ::pause();
    }
  }
}

void start_threads() {
  for (int i = 0; i < kThreads; ++i) {
    std::thread([] {
      for (;;) std::this_thread::sleep_for(1s);
    }).detach();
  }
}

// Begin and end of a line of /proc/self/maps.
bool parse(const std::string& line, std::uintptr_t& first, std::uintptr_t& last) {
  unsigned long begin = 0;
  unsigned long end = 0;
  if (std::sscanf(line.c_str(), "%lx-%lx", &begin, &end) != 2) return false;
  first = begin;
  last = end;
  return true;
}

// All memory that it may write and `chosen` names by its line.
template <class Chosen>
void overwrite(Chosen chosen) {
  std::ifstream maps("/proc/self/maps");
  std::vector<std::pair<std::uintptr_t, std::uintptr_t>> parts;
  std::uintptr_t first = 0;
  std::uintptr_t last = 0;
  for (std::string line; std::getline(maps, line);) {
    if (line.find(" rw-") != std::string::npos && chosen(line) && parse(line, first, last)) {
      parts.emplace_back(first, last);
    }
  }
  std::uint32_t value = 2463534242;
  for (const auto& [begin, end] : parts) {
    for (std::uintptr_t at = begin; at < end; at += 64) {
      value ^= value << 13;
      value ^= value >> 17;
      value ^= value << 5;
      *reinterpret_cast<volatile std::uint8_t*>(at) =  // NOLINT(performance-no-int-to-ptr)
          static_cast<std::uint8_t>(value);
    }
  }
}

// The pages of this instance: "POOL.page.INSTANCE". Not the pool, which belongs to all.
void overwrite_own_pages() {
  const std::string end = "." + std::string(plc::instance_name());
  overwrite([&end](const std::string& line) {
    return line.find("/dev/shm/") != std::string::npos && line.size() >= end.size() &&
           line.compare(line.size() - end.size(), end.size(), end) == 0;
  });
}

void overwrite_heap() {
  overwrite([](const std::string& line) { return line.find("[heap]") != std::string::npos; });
}

void declare_faults(plc::Application& app) {
  app.external("Grow", 6, "grow", grow);
  app.external("Descriptors", 6, "descriptors", open_all);
  app.external("Forks", 6, "forks", fork_many);
  app.external("Threads", 6, "threads", start_threads);
  app.external("Halt", 6, "halt", [] { ::kill(::getpid(), SIGSTOP); });
  app.external("Exit", 6, "exit", [] { std::exit(0); });
  app.external("ExitAtOnce", 6, "exit_at_once", [] { ::_exit(3); });
  app.external("Throw", 6, "throw", [] { throw std::runtime_error("the valve is stuck"); });
  app.external("Pages", 6, "pages", overwrite_own_pages);
  app.external("Heap", 6, "heap", overwrite_heap);
}

void setup(plc::Application& app) {
  board = map_board();
  if (board == nullptr) throw std::runtime_error("there is no board of this instance in PLC_CAMPAIGN");
  ++board->starts;
  app.cyclic("Fast", 1, kInterval, fast);
  retained = app.area<std::uint64_t>("retained", PLC_AREA_RETAIN);
  for (std::size_t i = 0; i < kEvents; ++i) {
    const std::string number = std::to_string(i);
    app.external("Run" + number, 5, "e" + number, [i] { ++board->runs[i]; });
  }
  const auto tasks = plc::parameter("Tasks");
  const std::size_t more = tasks ? std::min<std::size_t>(std::stoul(std::string(*tasks)), kTasks) : 0;
  for (std::size_t i = 0; i < more; ++i) {
    app.cyclic("T" + std::to_string(i), static_cast<int>(7 + i % 8),
               std::chrono::milliseconds(10 + 10 * (i % 4)), [i] { ++board->others[i]; });
  }
  if (plc::parameter("Faults")) declare_faults(app);
}

}  // namespace

PLC_APPLICATION("CountingLine", setup)
