#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "shm/base/result.hpp"
#include "shm/base/seqlock.hpp"
#include "shm/base/time.hpp"
#include "shm/files/memory_file.hpp"

namespace plchost {

/// A request of a debugger: a part of the state, for a session.
struct DebugPart {
  std::uint64_t session = 0;  ///< 0: of a client that only looks
  std::uint64_t offset = 0;
  /// "SESSION OFFSET"; nothing: it is not that.
  [[nodiscard]] static std::optional<DebugPart> parse(std::string_view text) noexcept;
};

inline constexpr std::size_t kMaxDebugState = 65520;

/// In shared memory.
struct DebugState {
  std::uint64_t version = 0;  ///< counted up with each change
  std::uint32_t size = 0;
  std::array<char, kMaxDebugState> text{};
};
struct DebugPageLayout {
  std::uint64_t magic = 0;
  std::uint32_t version = 0;
  std::uint32_t size = 0;
  // Written by the API server: the debugger that asked last, and when (CLOCK_MONOTONIC).
  std::atomic<std::uint64_t> asking_session{0};
  std::atomic<std::int64_t> asked_ns{0};
  std::atomic<std::int64_t> reading_ns{0};  ///< when a part was read behind which there are others; 0: none
  Seqlock<DebugState> state;
};

[[nodiscard]] std::string debug_page_name(std::string_view pool, std::string_view instance);

/// The instance's end of "POOL.debug.INSTANCE": the state of the debugger of its application. Control thread.
class DebugPage {
 public:
  /// Takes the place of the page of before.
  [[nodiscard]] static Result<DebugPage> create(std::string_view pool, std::string_view instance);
  static void remove(std::string_view pool, std::string_view instance) noexcept;

  /// Shows another state, of at most kMaxDebugState bytes; nothing is done if it is the same.
  void write(std::string_view state);
  /// The session for which the state was asked last, and when: as the page says, which a stranger may have
  /// written.
  struct Asked {
    std::uint64_t session = 0;
    TimePoint when;
  };
  [[nodiscard]] Asked asked() const noexcept;
  /// A debugger is about to read the other parts of the state: another one would make it begin anew. Not for
  /// longer than kLongestRead since the first such call, or since write().
  [[nodiscard]] bool is_being_read(TimePoint now) noexcept;
  static constexpr Duration kLongestRead = std::chrono::milliseconds(500);

 private:
  explicit DebugPage(MemoryFile memory) noexcept : memory_(std::move(memory)) {}
  [[nodiscard]] DebugPageLayout& layout() const noexcept {
    return *reinterpret_cast<DebugPageLayout*>(memory_.bytes().data());
  }

  MemoryFile memory_;
  std::uint64_t version_ = 0;
  std::string shown_;
  std::optional<TimePoint> read_since_;
};

/// The API server's end: "VERSION SIZE " and as much of the state from the offset on as `most` bytes hold.
/// Tells the instance that its debugger is there. not_found: the application of the instance is no debug
/// build. corrupt: not such a page. busy: it was written all the time; ask again.
[[nodiscard]] Result<std::string> read_debug_part(std::string_view pool, std::string_view instance,
                                                  DebugPart part, std::size_t most);

}  // namespace plchost
