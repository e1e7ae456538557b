#include "shm/pages/transition_ring.hpp"

#include <cerrno>
#include <cstddef>

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include "shm/base/time.hpp"
#include "shm/base/unique_fd.hpp"
#include "shm/files/access_list.hpp"
#include "shm/files/memory_rights.hpp"

namespace plchost {

static_assert(offsetof(TransitionRingLayout, version) == 8 && sizeof(Transition) == 232);

std::string_view to_string(TransitionSource source) noexcept {
  switch (source) {
    case TransitionSource::application:
      return "application";
    case TransitionSource::process:
      return "process";
  }
  return "unknown";
}

std::string transition_ring_name(std::string_view pool, std::string_view instance) {
  return fmt::format("{}.transitions.{}", pool, instance);
}

Result<TransitionRing> TransitionRing::open(std::string_view pool, std::string_view instance) {
  PLCHOST_TRY_ASSIGN(auto page,
                     TransitionRingPage::open(transition_ring_name(pool, instance), managers_page()));
  return TransitionRing(std::move(page));
}

void TransitionRing::remove(std::string_view pool, std::string_view instance) noexcept {
  MemoryFile::remove(transition_ring_name(pool, instance));
}

Result<void> TransitionRing::let_write(std::string_view pool, std::string_view instance,
                                       std::span<const uid_t> users) {
  constexpr mode_t kGroupReads = 0640;
  constexpr mode_t kGroupWrites = 0660;
  constexpr mode_t kWrites = 6;
  const std::string path = MemoryFile::path(transition_ring_name(pool, instance));
  const UniqueFd fd(::open(path.c_str(), O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC));
  struct stat status{};
  if (!fd || ::fstat(fd.get(), &status) != 0) return failure(ErrorCode::system, "cannot open " + path, errno);
  if (!S_ISREG(status.st_mode) || status.st_uid != ::geteuid() || status.st_nlink != 1) return {};
  const auto done = let_users(fd.get(), users, kWrites, kGroupReads, path);
  if (done || done.error().code != ErrorCode::unsupported) return done;
  return give_rights(fd.get(), {.mode = kGroupWrites}, path);
}

// Each number has its slot, so two writers never write the same one, unless one of them stands still in here
// while the other goes through the whole ring. A reader then sees a number that is not the slot's.
void TransitionRing::add(TransitionSource source, std::uint32_t from, std::uint32_t to, std::int32_t pid,
                         std::string_view reason) noexcept {
  Transition transition{.sequence = page_.layout().last.fetch_add(1, std::memory_order_acq_rel) + 1,
                        .time_unix_ns = unix_time_ns(),
                        .time_monotonic_ns = MonotonicClock::now().time_since_epoch().count(),
                        .source = source,
                        .from = from,
                        .to = to,
                        .pid = pid,
                        .reason = {}};
  transition.reason.assign(reason);
  page_.put(transition);
}

Result<TransitionRingReader> TransitionRingReader::open(std::string_view pool, std::string_view instance) {
  PLCHOST_TRY_ASSIGN(auto page, TransitionRingPage::open_to_read(transition_ring_name(pool, instance)));
  return TransitionRingReader(std::move(page));
}

std::int64_t TransitionRingReader::stream_unix_ns() const noexcept {
  return page_.layout().stream_unix_ns;
}

std::optional<Transition> TransitionRingReader::next(TimePoint now) {
  for (;;) {
    const std::uint64_t last = page_.last();
    if (next_ > last) return std::nullopt;
    if (last - next_ >= kTransitionsKept) next_ = last - kTransitionsKept + 1;
    auto found = page_.get(next_);
    if (!found) {
      if (!waits_since_) waits_since_ = now;
      if (now - *waits_since_ < kWriterGone) return std::nullopt;
    }
    waits_since_.reset();
    ++next_;
    if (!found) continue;
    replace_unprintable(found->reason);
    return found;
  }
}

}  // namespace plchost
