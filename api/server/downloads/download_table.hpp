#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <list>
#include <optional>
#include <string>
#include <vector>

#include <control.h>
#include <sys/types.h>

#include "api/dds/guid.hpp"
#include "shm/base/result.hpp"
#include "shm/base/time.hpp"
#include "shm/base/unique_fd.hpp"
#include "shm/sockets/control_message.hpp"

namespace plchost {

/// How much of a download has come.
struct DownloadProgress {
  dds::Guid client;  ///< participant
  plc_SampleIdentity identity{};
  std::uint64_t received = 0;
};

/// A download that is no more, and why; its client is to be told.
struct DownloadEnd {
  dds::Guid client;
  plc_SampleIdentity identity{};
  Error why;
};

/// A download that is complete: the manager's command for it.
struct CompleteDownload {
  dds::Guid client;
  plc_SampleIdentity identity{};
  ControlRequest request;
};

/// The applications that are on their way to this host. The pieces of each lie in shared memory, not on a
/// disk that could make this thread wait. They are not trusted: the manager's helper checks the digest of its
/// copy. A piece is taken when it begins where the one before has ended, from the client that asked for the
/// download, and else not at all. Control loop only.
class DownloadTable {
 public:
  static constexpr std::size_t kMost = 4;
  static constexpr std::size_t kWindow = std::size_t{16} * 32768;  ///< bytes that may be under way
  /// A download of which nothing comes for so long is given up.
  static constexpr Duration kPatience = std::chrono::seconds(10);

  /// Rights to the files: the manager reads them as their owner, or by its group.
  static constexpr mode_t kForOwner = 0600;
  static constexpr mode_t kForGroup = 0640;

  /// `limit`: the largest file, bytes; together twice as much. Removes what an earlier process has left.
  DownloadTable(std::string pool, std::uint64_t limit, mode_t mode = kForOwner);
  DownloadTable(const DownloadTable&) = delete;
  DownloadTable& operator=(const DownloadTable&) = delete;
  ~DownloadTable();

  /// `request`: as check_request() has made it, with the options of its sender. busy: another one to that
  /// instance, or too many; full: the file, or all together, is larger than allowed; system: no file can be
  /// made.
  [[nodiscard]] Result<void> begin(const dds::Guid& client, const plc_SampleIdentity& identity,
                                   ControlRequest request, TimePoint now);
  /// There is such a download: it is told how far it is, and no second one begins.
  bool repeat(const plc_SampleIdentity& identity);
  /// `client`: participant of the piece's real writer.
  void take(const plc_DownloadChunk& chunk, const dds::Guid& client, TimePoint now);
  /// Those of which something is to be told since the last call.
  [[nodiscard]] std::vector<DownloadProgress> progress();
  /// Those that are complete, each once. They stay until end().
  [[nodiscard]] std::vector<CompleteDownload> complete();
  /// Those that were given up: nothing came, the client is gone, or it could not be written down.
  [[nodiscard]] std::vector<DownloadEnd> given_up(TimePoint now,
                                                  const std::function<bool(const dds::Guid&)>& is_alive);
  /// The manager has done with it, or has not taken it.
  void end(const plc_SampleIdentity& identity);

  [[nodiscard]] std::size_t size() const noexcept { return downloads_.size(); }

 private:
  struct Download {
    dds::Guid client;
    plc_SampleIdentity identity{};
    ControlRequest request;
    std::uint64_t size = 0;
    std::uint64_t received = 0;
    std::string path;
    UniqueFd file;
    TimePoint last;
    bool told = false;
    bool handed_over = false;
    std::optional<Error> failed = {};
  };
  [[nodiscard]] std::list<Download>::iterator find(const plc_SampleIdentity& identity);
  [[nodiscard]] Result<void> check_room(const std::string& instance, std::uint64_t size) const;
  [[nodiscard]] Result<void> make_file(Download& download);
  static void write(Download& download, const plc_DownloadChunk& chunk);
  void remove(std::list<Download>::iterator download);

  std::string pool_;
  std::uint64_t limit_;
  mode_t mode_;
  std::uint64_t last_file_ = 0;
  std::list<Download> downloads_;
};

}  // namespace plchost
