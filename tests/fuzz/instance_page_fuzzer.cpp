#include <array>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <string>
#include <vector>

#include "shm/base/histogram_digest.hpp"
#include "shm/pages/instance_page.hpp"
#include "tests/support/own_name.hpp"

namespace {

using namespace plchost;

constexpr std::size_t kTasks = kMaxFineTasks + 1;  // the smaller histograms
constexpr std::string_view kInstance = "line1";

const std::string& pool_name() {
  static const std::string kName = own_name("fuzz");
  return kName;
}

/// The API server's view of a page.
void use(const InstancePageReader& page) {
  (void)page.runtime();
  for (std::uint32_t i = 0; i < page.task_count() && i < 2; ++i) {
    const auto task = page.task(i);
    (void)page.task_sequence(i);
    if (const auto fault = page.fault(i)) (void)describe_fault(*fault);
    if (!task) continue;
    const TaskCounters& counters = task->counters;
    (void)task->identity.name.view();
    (void)average(counters.exec_sum_ns, counters.recorded);
    (void)largest_jitter_ns(counters);
    for (const auto which : {TaskHistogram::latency, TaskHistogram::jitter_positive}) {
      const HistogramDigest digest(page.histogram(i, which), Duration(counters.latency_min_ns),
                                   Duration(counters.latency_max_ns));
      if (digest.bars().size() > HistogramDigest::kMaxBars) std::abort();
    }
  }
}

}  // namespace

// The input is a list of [ place : 2 bytes ][ value : 1 byte ]. These are a stranger's writes into the page,
// into its header and first tasks, or, with the highest bit of the place, among the buckets.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const std::vector<TaskIdentity> kIdentities(kTasks);
  static auto writer = InstancePage::create(pool_name(), kInstance, kIdentities);
  static const bool kCleans = std::atexit([] { InstancePage::remove(pool_name(), kInstance); }) == 0;
  static const auto kMemory =
      MemoryFile::open(instance_page_name(pool_name(), kInstance), 1, MemoryFile::Access::read_write);
  static const auto kBefore = InstancePageReader::open(pool_name(), kInstance);
  if (!writer || !kCleans || !kMemory || !kBefore) std::abort();
  constexpr std::size_t kHead = 8192;
  constexpr std::size_t kHigh = 0x8000;
  static const std::vector<std::byte> kSound(kMemory->bytes().begin(), kMemory->bytes().begin() + kHead);
  const auto bytes = kMemory->bytes();
  const std::size_t buckets = bytes.size() - kTasks * task_bucket_count(HistogramShape(2)) * 4;
  for (; size >= 3; data += 3, size -= 3) {
    const std::size_t place = std::size_t{data[0]} << 8 | data[1];
    const std::size_t at = (place & kHigh) != 0 ? buckets + (place & (kHigh - 1)) : place % kHead;
    bytes[at] = static_cast<std::byte>(data[2]);
  }
  use(*kBefore);  // had it open already
  if (const auto after = InstancePageReader::open(pool_name(), kInstance)) use(*after);
  std::memcpy(bytes.data(), kSound.data(), kHead);
  std::memset(bytes.data() + buckets, 0, kHigh);
  return 0;
}
