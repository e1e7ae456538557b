#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "shm/base/names.hpp"
#include "shm/log/log_line.hpp"
#include "shm/pages/ring_page.hpp"

namespace plchost {

/// The origin of a line. The numbers are part of the DDS API.
enum class LogSource : std::uint32_t {
  runtime = 0,      ///< plc-instance
  application = 1,  ///< the application, by plc_log
  output = 2,       ///< the process on its standard output or error, in a form of its own
  manager = 3,
};

/// A line, before it is written down.
struct LogEntry {
  std::int64_t time_unix_ns = 0;
  std::int32_t pid = 0;  ///< of the instance's process; 0: none
  LogLevel level = LogLevel::info;
  LogSource source = LogSource::output;
  std::string_view text;
};

inline constexpr std::size_t kMaxLogText = 215;

/// A record of the ring: a line, or a part of a long one.
struct LogRecord {
  std::uint64_t sequence = 0;  ///< from 1, without a gap; given by the ring
  std::int64_t time_unix_ns = 0;
  std::int32_t pid = 0;
  LogLevel level = LogLevel::info;
  LogSource source = LogSource::output;
  std::uint32_t goes_on = 0;  ///< 1: the next record is the rest of this line
  FixedText<kMaxLogText> text;
};

/// How many records are kept: 256 KiB.
inline constexpr std::size_t kLogRecordsKept = 1024;

inline constexpr PageKind kLogRingKind{.what = "log",
                                       .magic = 0x676e6972'2d676f6c,  // "log-ring"
                                       .version = 1};                 // 1: first
using LogRingPage = RingPage<LogRecord, kLogRecordsKept, kLogRingKind>;
using LogRingLayout = LogRingPage::Layout;

[[nodiscard]] std::string log_ring_name(std::string_view pool, std::string_view instance);

/// The last lines of an instance, in a shared memory of its own that outlives the instance and the manager.
/// One writer: the manager. It never waits, and no process of an instance writes to it.
class LogRing {
 public:
  /// Continues the ring that is there, or makes one.
  [[nodiscard]] static Result<LogRing> open(std::string_view pool, std::string_view instance);
  static void remove(std::string_view pool, std::string_view instance) noexcept;

  /// Writes a line, in several records if it is long. '?' replaces control characters and what is no UTF-8.
  /// If a stranger has cut the memory short, a new ring is made first.
  void add(const LogEntry& entry);

 private:
  LogRing(std::string name, LogRingPage page) noexcept;
  void add_record(const LogRecord& record) noexcept;
  std::string name_;
  LogRingPage page_;
  // As it was written last: a stranger may change the memory's own.
  std::uint64_t last_ = 0;
  std::int64_t stream_ = 0;
};

/// A part of a ring.
struct LogSlice {
  std::int64_t stream_unix_ns = 0;
  std::uint64_t last = 0;  ///< number of the newest record of the ring
  std::vector<LogRecord> records = {};
};

/// A reader's end, in any process.
class LogRingReader {
 public:
  /// not_found: there is none yet. corrupt: not such a ring.
  [[nodiscard]] static Result<LogRingReader> open(std::string_view pool, std::string_view instance);

  /// The records after number `after`, at most `most`, in order. Missing numbers were pushed out of the ring.
  /// Texts are printable.
  [[nodiscard]] LogSlice read(std::uint64_t after, std::size_t most) const;
  /// The newest `count` of them.
  [[nodiscard]] LogSlice newest(std::size_t count, std::size_t most) const;

 private:
  explicit LogRingReader(LogRingPage page) noexcept : page_(std::move(page)) {}
  LogRingPage page_;
};

}  // namespace plchost
