#pragma once

#include <array>
#include <atomic>
#include <bitset>
#include <condition_variable>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "instances/launch/launch_contract.hpp"
#include "instances/runtime/memory/area_memory.hpp"
#include "instances/runtime/memory/retain_files.hpp"
#include "instances/runtime/memory/retain_memory.hpp"
#include "instances/runtime/settings/settings.hpp"
#include "shm/base/result.hpp"
#include "shm/threads/thread.hpp"

namespace plchost {

/// The retain and persistent variables of one application: their memory, where they come from at the start,
/// and a soft thread that writes them to files.
class RetainKeeper {
 public:
  struct Options {
    std::string directory{};  ///< of the files; empty: they live as long as the pool
    Duration interval = std::chrono::seconds(1);
    RetainMismatch mismatch = RetainMismatch::initialise;
    /// How long a moment without any cycle is looked for, before tasks are asked at the ends of theirs.
    Duration postpone = std::chrono::milliseconds(100);
    bool cold = false;  ///< retain areas begin with initial values
  };
  /// Where an area's values come from: PLC_AREA_INITIAL, PLC_AREA_RETAINED, PLC_AREA_RESTORED.
  using Origin = unsigned;

  /// Whether make() would refuse this layout, as it is now: the process that runs goes on. Changes nothing.
  /// `pool` may be empty: only the files count. The bytes of the memory that make() would make; 0: it goes on
  /// in the one that is there. Set-up.
  [[nodiscard]] static Result<std::size_t> check(const std::string& pool, const std::string& instance,
                                                 const RetainImage& initial, const Options& options);
  /// `initial`: the layout with its initial values. Goes on with what is left in memory, else with the newest
  /// file that is whole. Without start() the memory and the files of before stay as they were. `pool`
  /// outlives it. refused: that has another layout and the settings say so. Set-up.
  [[nodiscard]] static Result<std::unique_ptr<RetainKeeper>> make(ObjectPool& pool,
                                                                  const std::string& instance,
                                                                  const RetainImage& initial,
                                                                  const Options& options);
  ~RetainKeeper() { finish(); }
  RetainKeeper(const RetainKeeper&) = delete;
  RetainKeeper& operator=(const RetainKeeper&) = delete;

  [[nodiscard]] RetainMemory& memory() noexcept { return memory_; }
  /// The start of the instance has succeeded: from now on its memory is that of the pool, and its values are
  /// written. Set-up, once.
  [[nodiscard]] Result<void> start();
  [[nodiscard]] Origin origin(std::size_t area) const noexcept { return origins_[area]; }
  /// The text about the start.
  [[nodiscard]] const std::vector<std::string>& remarks() const noexcept { return remarks_; }

  /// Does not wait for the interval. Any thread that may take a lock.
  void save_soon();
  /// Writes the last state and ends the thread. No cycle runs any more.
  void finish();

  /// Why the newest values are not in the files; empty: they are. Any thread that may take a lock.
  [[nodiscard]] std::string problem() const;
  [[nodiscard]] std::uint64_t saves() const noexcept { return saves_.load(std::memory_order_relaxed); }
  [[nodiscard]] std::uint64_t unsaved() const noexcept { return unsaved_.load(std::memory_order_relaxed); }

 private:
  struct Start;
  RetainKeeper(ObjectPool& pool, std::string name, RetainMemory memory, Start start, const Options& options);
  void run();
  void save_first();
  void save();
  [[nodiscard]] bool write_image();
  /// Whether the memory is lost, which is told.
  [[nodiscard]] bool notice_loss();
  /// The state of image_ then: all as it is between cycles now; so of some areas, the others as before;
  /// nothing new.
  enum class Taken : std::uint8_t { all, some, none };
  [[nodiscard]] Taken take_snapshot();
  [[nodiscard]] bool take_whole();
  [[nodiscard]] Taken take_groups();
  /// False: it was woken to end.
  [[nodiscard]] bool rest();
  [[nodiscard]] Result<void> write();
  void put_strange_files_aside();
  void put_aside(std::bitset<2> which) const;
  /// Why it is not saved; the worst first.
  enum class Fault : std::uint8_t { memory, files, cycles };
  static constexpr std::size_t kFaults = 3;
  /// Logs `why` if it was not so before; empty: there is no such fault any more.
  void tell(Fault fault, std::string why);
  void count_unsaved() noexcept;

  ObjectPool& pool_;
  std::string name_;  // of the memory
  RetainMemory memory_;
  std::bitset<2> aside_;  // files that are damaged, or of another layout
  std::optional<RetainFiles> files_;
  std::vector<Origin> origins_;
  std::vector<std::string> remarks_;
  Duration interval_;
  Duration postpone_;
  RetainImage image_;               // the soft thread's: as it was taken last
  std::vector<std::byte> scratch_;  // the same thread's, and that of tasks that it asks
  std::vector<std::byte> written_;  // the same thread's: the contents of the newest file
  bool lost_ = false;               // the same thread's: the memory is
  std::atomic<std::uint64_t> saves_{0};
  std::atomic<std::uint64_t> unsaved_{0};

  mutable std::mutex mutex_;
  std::array<std::string, kFaults> problems_;  // guarded by the mutex
  std::condition_variable wake_;
  bool started_ = false;
  bool soon_ = false;
  bool ending_ = false;
  Thread thread_;
};

/// Writes what the retain memory of an instance holds to the instance's retain files, unless they hold it
/// already. For the time after the end of the instance's process. `launch`: name, pool, settings and state
/// directory. not_found: there is no place for the files. busy: a process has them. Other errors: the files
/// are as they were. Set-up.
[[nodiscard]] Result<void> save_left_behind(const LaunchOptions& launch);

}  // namespace plchost
