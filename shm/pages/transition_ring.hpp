#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>

#include <sys/types.h>

#include "shm/base/names.hpp"
#include "shm/base/time.hpp"
#include "shm/pages/ring_page.hpp"

namespace plchost {

/// The part that changed its state. The numbers are part of the DDS API.
enum class TransitionSource : std::uint32_t {
  application = 0,  ///< the states are ApplicationStates; written by the instance
  process = 1,      ///< the states are InstanceStates; written by the manager
};
[[nodiscard]] std::string_view to_string(TransitionSource source) noexcept;

/// One change of state.
struct Transition {
  std::uint64_t sequence = 0;  ///< from 1, without a gap; given by the ring
  std::int64_t time_unix_ns = 0;
  std::int64_t time_monotonic_ns = 0;
  TransitionSource source = TransitionSource::application;
  std::uint32_t from = 0;
  std::uint32_t to = 0;
  std::int32_t pid = 0;  ///< of the instance's process; 0: none
  FixedText<191> reason;
};

/// How many transitions are kept for late readers.
inline constexpr std::size_t kTransitionsKept = 64;

inline constexpr PageKind kTransitionsKind{.what = "ring of transitions",
                                           .magic = 0x676e6972'6e617274,  // "tranring"
                                           .version = 1};                 // 1: first
using TransitionRingPage = RingPage<Transition, kTransitionsKept, kTransitionsKind>;
using TransitionRingLayout = TransitionRingPage::Layout;

[[nodiscard]] std::string transition_ring_name(std::string_view pool, std::string_view instance);

/// The last transitions of one instance, in a shared memory of its own that outlives its processes, so that
/// there is one numbering over all of them. The manager and the instance both write; neither ever waits.
class TransitionRing {
 public:
  /// Goes on with the ring that is there, or makes one.
  [[nodiscard]] static Result<TransitionRing> open(std::string_view pool, std::string_view instance);
  static void remove(std::string_view pool, std::string_view instance) noexcept;
  /// Lets instances of these users write it, too, and no others but its owner. Where no access list can say
  /// that, it lets its group. Of the own ring only: nothing happens to one of another user. Set-up.
  [[nodiscard]] static Result<void> let_write(std::string_view pool, std::string_view instance,
                                              std::span<const uid_t> users);

  /// Numbers and dates it. Soft threads.
  void add(TransitionSource source, std::uint32_t from, std::uint32_t to, std::int32_t pid,
           std::string_view reason) noexcept;

 private:
  explicit TransitionRing(TransitionRingPage page) noexcept : page_(std::move(page)) {}
  TransitionRingPage page_;
};

/// A reader's end, in any process: the entries since its last look, in order.
class TransitionRingReader {
 public:
  /// A number that was given and is not written for so long was given to a process that ended: it is left
  /// out.
  static constexpr Duration kWriterGone = std::chrono::seconds(1);

  /// Begins with the oldest that is kept. not_found: there is none yet. corrupt: not such a ring.
  [[nodiscard]] static Result<TransitionRingReader> open(std::string_view pool, std::string_view instance);

  [[nodiscard]] std::int64_t stream_unix_ns() const noexcept;
  /// The next one; nothing: no more at present. Numbers that are missing were overtaken. Its reason is
  /// printable.
  [[nodiscard]] std::optional<Transition> next(TimePoint now);

 private:
  explicit TransitionRingReader(TransitionRingPage page) noexcept : page_(std::move(page)) {}
  TransitionRingPage page_;
  std::uint64_t next_ = 1;
  std::optional<TimePoint> waits_since_;
};

}  // namespace plchost
