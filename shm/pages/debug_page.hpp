#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>

#include "shm/base/result.hpp"
#include "shm/base/seqlock.hpp"
#include "shm/base/time.hpp"
#include "shm/files/memory_file.hpp"

namespace plchost {

/// Which part of the state is asked for, and by whose debugger.
struct DebugQuery {
  std::uint64_t session = 0;  ///< 0: of a client that only looks
  std::uint64_t offset = 0;   ///< of the first byte
};

/// A part of the state.
struct DebugPart {
  std::uint64_t version = 0;  ///< of the state: parts of two versions do not fit together
  std::uint64_t size = 0;     ///< of the whole state
  std::uint64_t offset = 0;   ///< of the first byte of `text` in it
  std::string text = {};
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

 private:
  explicit DebugPage(MemoryFile memory) noexcept : memory_(std::move(memory)) {}
  [[nodiscard]] DebugPageLayout& layout() const noexcept {
    return *reinterpret_cast<DebugPageLayout*>(memory_.bytes().data());
  }

  MemoryFile memory_;
  std::uint64_t version_ = 0;
  std::string shown_;
};

/// The API server's end: the state from the offset on. Tells the instance that its debugger is there.
/// not_found: the application of the instance is no debug build. corrupt: not such a page. busy: it was
/// written all the time; ask again.
[[nodiscard]] Result<DebugPart> read_debug_part(std::string_view pool, std::string_view instance,
                                                const DebugQuery& query);

}  // namespace plchost
