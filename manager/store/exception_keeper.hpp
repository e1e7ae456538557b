#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>

#include "manager/store/wish_writer.hpp"
#include "manager/system/disk_thread.hpp"
#include "shm/base/time.hpp"
#include "shm/files/file_version.hpp"

namespace plchost {

/// How long the manager waits for the disk when it starts, before an instance begins without the exceptions
/// of before the power cut. The disk has them all the same.
inline constexpr Duration kExceptionLimit = std::chrono::seconds(2);
/// Exceptions that the disk has not taken are tried again after so long.
inline constexpr Duration kExceptionRetry = std::chrono::seconds(10);

/// Has the disk keep the exceptions of instances, which they write down in the run directory: that is memory,
/// and instances may not write where the manager's own files are. Nothing in it waits for the disk, but for
/// restore(), and that within a limit. The manager's thread.
class ExceptionKeeper {
 public:
  struct Settings {
    std::string folder;  ///< see exceptions_folder()
    std::string run_directory;
  };

  /// `writer` and `disk` outlive it, and it outlives the last call of `writer`.
  ExceptionKeeper(WishWriter& writer, DiskThread& disk, Settings settings);

  /// Before the first process of an instance: the run directory has its exceptions again.
  void restore(const std::string& instance);
  /// Has what is new written. To be called once a second for each instance, and at the end of the manager.
  void look(const std::string& instance, TimePoint now);
  /// An order has not been answered yet.
  [[nodiscard]] bool is_writing() const noexcept;

 private:
  struct Watched {
    std::optional<FileVersion> kept;  // the file that was written last
    bool writing = false;
    TimePoint next;       // not before
    std::string problem;  // as it was logged last; empty: none
  };
  void written(const std::string& instance, const FileVersion& version, const Result<void>& result);

  WishWriter& writer_;
  DiskThread& disk_;
  Settings settings_;
  std::map<std::string, Watched, std::less<>> watched_;
};

}  // namespace plchost
