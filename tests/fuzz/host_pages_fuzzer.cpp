#include <array>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "shm/pages/debug_page.hpp"
#include "shm/pages/flight_page.hpp"
#include "shm/pages/host_page.hpp"
#include "shm/pages/host_page_copy.hpp"
#include "shm/pages/log_ring.hpp"
#include "shm/pages/transition_ring.hpp"
#include "tests/support/own_name.hpp"

namespace {

using namespace plchost;

constexpr std::string_view kInstance = "line1";

const std::string& pool_name() {
  static const std::string kName = own_name("fuzz");
  return kName;
}

std::vector<MemoryFile>& memories() {
  static std::vector<MemoryFile> all;
  return all;
}

template <class T>
T made(Result<T> result) {
  if (!result) std::abort();
  return *std::move(result);
}

bool is_printable(std::string_view text) {
  return text.find('\n') == std::string_view::npos && text.find('\x1b') == std::string_view::npos;
}

/// The shared memories of a host with one instance, and how others read them.
class Host {
 public:
  Host() {
    HostStatus host;
    host.name.assign("host");
    host.instance_count = 2;
    InstanceStatus status;
    status.name.assign(kInstance);
    page_.write_instance(0, status);
    page_.write_host(host);
    for (std::uint32_t i = 0; i < 3; ++i) {
      transitions_.add(TransitionSource::application, i, i + 1, 0, "a reason");
      log_.add({.text = "a line"});
    }
    debug_.write("a state");
    for (std::size_t number = 0; number < kFirstTaskRing + 1; ++number) {
      FlightRing ring = flight_.ring(number);
      for (std::int64_t time = 0; time < 600; ++time) ring.put(TimePoint(Duration(time)), FlightKind::start);
    }
    for (const std::string& name :
         {host_page_name(pool_name()), transition_ring_name(pool_name(), kInstance),
          log_ring_name(pool_name(), kInstance), debug_page_name(pool_name(), kInstance),
          flight_page_name(pool_name(), kInstance)}) {
      memories().push_back(made(MemoryFile::open(name, 1, MemoryFile::Access::read_write)));
    }
  }
  Host(const Host&) = delete;
  Host& operator=(const Host&) = delete;
  ~Host() {
    HostPageWriter::remove(pool_name());
    TransitionRing::remove(pool_name(), kInstance);
    LogRing::remove(pool_name(), kInstance);
    DebugPage::remove(pool_name(), kInstance);
    FlightPage::remove(pool_name(), kInstance);
  }

  void read(std::size_t which) {
    switch (which) {
      case 0:
        return read_page();
      case 1:
        return read_transitions();
      case 2:
        return read_log();
      case 3:
        return read_debug_state();
      default:
        return read_flight_recorder();
    }
  }

 private:
  static void read_page() {
    HostPageCopy copy(pool_name());
    (void)copy.refresh();
    if (const HostStatus* host = copy.host(); host != nullptr && !is_printable(host->name.view()))
      std::abort();
    if (copy.instances().size() > kMaxInstances) std::abort();
    for (const InstanceStatus* instance : copy.instances()) {
      if (instance->name.view().empty() || !is_printable(instance->name.view())) std::abort();
      (void)to_string(instance->state);
    }
  }
  static void read_transitions() {
    auto reader = TransitionRingReader::open(pool_name(), kInstance);
    if (!reader) return;
    (void)reader->stream_unix_ns();
    for (std::size_t i = 0; i < 2 * kTransitionsKept; ++i) {
      const auto transition = reader->next(MonotonicClock::now() + i * TransitionRingReader::kWriterGone);
      if (!transition) break;
      (void)to_string(transition->source);
      if (!is_printable(transition->reason.view())) std::abort();
    }
  }
  static void read_log() {
    const auto reader = LogRingReader::open(pool_name(), kInstance);
    if (!reader) return;
    constexpr std::size_t kMost = 100;
    for (const LogSlice& slice : {reader->read(0, kMost), reader->newest(2, kMost)}) {
      if (slice.records.size() > kMost) std::abort();
      for (const LogRecord& record : slice.records)
        if (!is_printable(record.text.view())) std::abort();
    }
  }
  static void read_debug_state() {
    const auto part = read_debug_part(pool_name(), kInstance, {.session = 1, .offset = 2});
    if (part && part->text.size() > kMaxDebugState) std::abort();
    if (read_debug_part(pool_name(), "line2", {})) std::abort();
  }

  static void read_flight_recorder() {
    const auto reader = FlightPageReader::open(pool_name(), kInstance);
    if (!reader) return;
    for (std::size_t number = 0; number < kFirstTaskRing + reader->task_count(); ++number) {
      for (const std::int64_t time : {std::int64_t{0}, std::int64_t{590}, INT64_MAX}) {
        const FlightRing::Read read = reader->read_after(number, time);
        if (read.entries.size() > flight_capacity(reader->task_count())) std::abort();
        for (const FlightEntry& entry : read.entries)
          if (entry.time_ns <= time) std::abort();
      }
    }
    for (std::size_t task = 0; task < reader->task_count(); ++task)
      if (!is_printable(reader->task_name(task))) std::abort();
  }

  HostPageWriter page_ = made(HostPageWriter::create(pool_name()));
  TransitionRing transitions_ = made(TransitionRing::open(pool_name(), kInstance));
  LogRing log_ = made(LogRing::open(pool_name(), kInstance));
  DebugPage debug_ = made(DebugPage::create(pool_name(), kInstance));
  FlightPage flight_ = made(FlightPage::create(pool_name(), kInstance, std::array{FlightTask{}}));
};

}  // namespace

// The input is the number of a memory and a list of [ place : 2 bytes ][ value : 1 byte ]: a stranger's
// writes. Places are those of the first and the last 32 KiB.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static Host host;
  if (size == 0) return 0;
  const std::size_t which = data[0] % memories().size();
  const auto bytes = memories()[which].bytes();
  std::vector<std::pair<std::size_t, std::byte>> before;
  constexpr std::size_t kHigh = 0x8000;
  for (++data, --size; size >= 3; data += 3, size -= 3) {
    const std::size_t place = std::size_t{data[0]} << 8 | data[1];
    const std::size_t low = (place & (kHigh - 1)) % bytes.size();
    const std::size_t at = (place & kHigh) != 0 ? bytes.size() - 1 - low : low;
    before.emplace_back(at, bytes[at]);
    bytes[at] = static_cast<std::byte>(data[2]);
  }
  host.read(which);
  for (; !before.empty(); before.pop_back()) bytes[before.back().first] = before.back().second;
  return 0;
}
