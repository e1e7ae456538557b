#include "api/server/downloads/download_table.hpp"

#include <algorithm>
#include <cerrno>
#include <span>
#include <utility>

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include "api/control/application_order.hpp"
#include "api/dds/sample_identity.hpp"
#include "api/dds/sequence.hpp"

namespace plchost {

DownloadTable::DownloadTable(std::string pool, std::uint64_t limit, mode_t mode)
    : pool_(std::move(pool)), limit_(limit), mode_(mode) {
  remove_downloads(pool_);
}

DownloadTable::~DownloadTable() {
  while (!downloads_.empty()) remove(downloads_.begin());
}

Result<void> DownloadTable::check_room(const std::string& instance, std::uint64_t size) const {
  if (size > limit_) {
    return failure(ErrorCode::full, fmt::format("{} bytes; this host takes up to {} ([host] "
                                                "application_limit_mib)",
                                                size, limit_));
  }
  std::uint64_t all = size;
  for (const Download& other : downloads_) {
    if (other.request.instance == instance) {
      return failure(ErrorCode::busy,
                     fmt::format("'{}' is just being sent another one, {} ({} of {} bytes have come)",
                                 instance, other.request.argument, other.received, other.size));
    }
    all += other.size;
  }
  if (downloads_.size() >= kMost) {
    return failure(ErrorCode::busy,
                   fmt::format("{} applications are being sent to this host; at most {} at a "
                               "time",
                               downloads_.size(), kMost));
  }
  if (all <= 2 * limit_) return {};
  return failure(ErrorCode::busy, fmt::format("together with the running downloads this would be {} bytes; "
                                              "at most {} at a time",
                                              all, 2 * limit_));
}

// Any user can put files there: their names are passed over.
Result<void> DownloadTable::make_file(Download& download) {
  constexpr int kMostNames = 100'000;
  for (int i = 0; i < kMostNames; ++i) {
    download.path = download_file_name(pool_, ++last_file_);
    download.file.reset(
        ::open(download.path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, mode_));
    if (download.file) return {};
    if (errno != EEXIST) break;
  }
  return failure(ErrorCode::system, "cannot create " + download.path, errno);
}

Result<void> DownloadTable::begin(const dds::Guid& client, const plc_SampleIdentity& identity,
                                  ControlRequest request, TimePoint now) {
  PLCHOST_TRY_ASSIGN(const auto order, ApplicationOrder::from_options(request.options));
  PLCHOST_TRY(check_room(request.instance, order.size));
  Download download{.client = client,
                    .identity = identity,
                    .request = std::move(request),
                    .size = order.size,
                    .received = 0,
                    .path = {},
                    .file = {},
                    .last = now};
  PLCHOST_TRY(make_file(download));
  download.request.options[std::string(kSourceOption)] = fmt::format("{}", last_file_);
  downloads_.push_back(std::move(download));
  return {};
}

bool DownloadTable::repeat(const plc_SampleIdentity& identity) {
  const auto download = find(identity);
  if (download == downloads_.end()) return false;
  download->told = false;
  return true;
}

void DownloadTable::take(const plc_DownloadChunk& chunk, const dds::Guid& client, TimePoint now) {
  const auto download = find(chunk.download);
  if (download == downloads_.end() || download->client != client || download->failed) return;
  download->told = false;  // also of one that came twice or too early: its client knows then where to go on
  const std::uint64_t left = download->size - download->received;
  if (chunk.offset != download->received || chunk.contents._length == 0) return;
  if (chunk.contents._length > left) {
    download->failed =
        Error{ErrorCode::invalid_argument, 0,
              fmt::format("more than the {} bytes that were announced have come", download->size)};
    return;
  }
  write(*download, chunk);
  download->last = now;
}

void DownloadTable::write(Download& download, const plc_DownloadChunk& chunk) {
  auto bytes = std::as_bytes(dds::parts_of(chunk.contents));
  while (!bytes.empty()) {
    const ssize_t written =
        ::pwrite(download.file.get(), bytes.data(), bytes.size(), static_cast<off_t>(download.received));
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) {
      download.failed = Error{ErrorCode::system, errno, "cannot write " + download.path};
      return;
    }
    download.received += static_cast<std::uint64_t>(written);
    bytes = bytes.subspan(static_cast<std::size_t>(written));
  }
}

std::vector<DownloadProgress> DownloadTable::progress() {
  std::vector<DownloadProgress> all;
  for (Download& download : downloads_) {
    if (std::exchange(download.told, true)) continue;
    all.push_back({download.client, download.identity, download.received});
  }
  return all;
}

std::vector<CompleteDownload> DownloadTable::complete() {
  std::vector<CompleteDownload> all;
  for (Download& download : downloads_) {
    if (download.received != download.size || download.failed) continue;
    if (std::exchange(download.handed_over, true)) continue;
    all.push_back({download.client, download.identity, download.request});
  }
  return all;
}

std::vector<DownloadEnd> DownloadTable::given_up(TimePoint now,
                                                 const std::function<bool(const dds::Guid&)>& is_alive) {
  std::vector<DownloadEnd> all;
  for (auto it = downloads_.begin(); it != downloads_.end();) {
    const auto download = it++;
    if (download->handed_over) continue;  // the manager works on it, and answers
    if (now - download->last >= kPatience) {
      download->failed =
          Error{ErrorCode::timed_out, 0,
                fmt::format("nothing has come for {} s: {} of {} bytes of {} are here",
                            std::chrono::duration_cast<std::chrono::seconds>(kPatience).count(),
                            download->received, download->size, download->request.argument)};
    } else if (!is_alive(download->client)) {
      download->failed = Error{ErrorCode::unavailable, 0, "its client is gone"};
    }
    if (!download->failed) continue;
    all.push_back({download->client, download->identity, *download->failed});
    remove(download);
  }
  return all;
}

void DownloadTable::end(const plc_SampleIdentity& identity) {
  if (const auto found = find(identity); found != downloads_.end()) remove(found);
}

std::list<DownloadTable::Download>::iterator DownloadTable::find(const plc_SampleIdentity& identity) {
  return std::ranges::find_if(
      downloads_, [&](const Download& download) { return same_identity(download.identity, identity); });
}

void DownloadTable::remove(std::list<Download>::iterator download) {
  ::unlink(download->path.c_str());
  downloads_.erase(download);
}

}  // namespace plchost
