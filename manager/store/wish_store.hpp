#pragma once

#include <optional>
#include <string>
#include <vector>

#include "manager/store/wish_folder.hpp"
#include "manager/store/wish_keeper.hpp"
#include "manager/store/wish_memory.hpp"
#include "manager/store/wish_writer.hpp"
#include "manager/system/disk_thread.hpp"
#include "manager/system/reactor.hpp"
#include "shm/base/time.hpp"

namespace plchost {

/// How long an operator's command waits for the disk before it is answered without.
inline constexpr Duration kWishLimit = std::chrono::seconds(2);
/// How long the manager waits, when it starts, for what the disk has: of an instance that it knows from
/// memory, and of one that nothing else tells of. The host is starting then, and its disk may be, too.
inline constexpr Duration kWishReadLimit = std::chrono::seconds(2);
inline constexpr Duration kOnlyWishReadLimit = std::chrono::seconds(10);
/// A wish that could not be written is tried again after so long.
inline constexpr Duration kWishRetry = std::chrono::seconds(10);

/// The real WishKeeper: a WishMemory, and the files INSTANCE.wish and INSTANCE.events of wishes_folder().
/// Only the part of a wish that outlives a power cut goes to the disk, and only if it is another than before.
/// Of the two find() takes the newer one: the memory can be that of an earlier manager, with another pool
/// since. If the disk does not answer, the memory's counts. If another program has written over the memory,
/// nobody knows whether the disk has the last wish. It then counts only if it starts no machine.
class WishStore : public WishKeeper {
 public:
  struct Settings {
    std::string pool;
    std::string instance;
    std::string folder;         ///< see wishes_folder()
    std::string run_directory;  ///< where instances keep what operators registered
  };

  /// `writer` and `disk` outlive it.
  WishStore(Reactor& reactor, WishWriter& writer, DiskThread& disk, Settings settings);

  [[nodiscard]] Result<std::optional<InstanceWish>> find() override;
  void keep(const InstanceWish& wish) override;
  void keep_events() override;
  void when_kept(Kept kept) override;
  [[nodiscard]] bool is_writing() const override { return writing_; }
  /// To be called once a second: a part of the memory that another program has overwritten is written anew,
  /// and logged.
  void look_after_memory();
  /// The end of the manager in order: nothing stays in memory that is on the disk.
  void end() noexcept;

 private:
  [[nodiscard]] bool on_disk() const { return wanted_ == written_ && !events_wanted_ && !writing_; }
  // Each file has a suffix: without one, "line1.events" would be a file of two instances.
  [[nodiscard]] std::string path() const { return settings_.folder + "/" + settings_.instance + ".wish"; }
  [[nodiscard]] std::string events_path() const {
    return settings_.folder + "/" + settings_.instance + ".events";
  }
  [[nodiscard]] Result<std::string> read_file(const std::string& path, std::size_t most,
                                              Duration limit) const;
  [[nodiscard]] Result<std::optional<InstanceWish>> take_remembered(InstanceWish remembered,
                                                                    std::optional<InstanceWish> kept);
  [[nodiscard]] Result<std::optional<InstanceWish>> take_without_memory(
      const Result<InstanceWish>& kept) const;
  void restore_events() const;
  void write();
  void written(const Result<void>& result, const std::string& text);
  void fail(const std::string& problem);
  void tell(const std::string& problem);

  WishWriter& writer_;
  DiskThread& disk_;
  Settings settings_;
  Reactor::Timer limit_;
  Reactor::Timer retry_;
  std::optional<WishMemory> memory_;
  bool damaged_ = false;      // the memory was written over, and keep() has not been called since
  std::uint32_t number_ = 0;  // of the newest wish
  std::string contents_;      // of wanted_, without its number
  std::string wanted_;        // on the disk
  std::string written_;       // there
  bool events_wanted_ = false;
  bool writing_ = false;
  std::string problem_;  // as it was logged last; empty: none
  std::vector<Kept> waiting_;
};

}  // namespace plchost
