#include "shm/pages/debug_page.hpp"

#include <algorithm>
#include <charconv>
#include <cstring>
#include <memory>

#include <fmt/format.h>

#include "shm/base/names.hpp"
#include "shm/files/fixed_page.hpp"

namespace plchost {

namespace {

// A debugger that has not asked for the next part by then does not go on.
constexpr auto kNextPart = std::chrono::milliseconds(100);

/// 1: first.
constexpr PageKind kDebugPageKind{.what = "page of a debugger",
                                  .magic = 0x6567'6170'6775'6264,  // "dbugpage"
                                  .version = 1};

static_assert(offsetof(DebugPageLayout, version) == 8 && sizeof(DebugState) == 65536);

}  // namespace

std::optional<DebugPart> DebugPart::parse(std::string_view text) noexcept {
  DebugPart part;
  const char* const last = text.data() + text.size();
  const auto session = std::from_chars(text.data(), text.data() + text.size(), part.session);
  if (session.ec != std::errc{} || session.ptr == last || *session.ptr != ' ') return std::nullopt;
  const auto offset = std::from_chars(session.ptr + 1, last, part.offset);
  if (offset.ec != std::errc{} || offset.ptr != last) return std::nullopt;
  return part;
}

std::string debug_page_name(std::string_view pool, std::string_view instance) {
  return fmt::format("{}.debug.{}", pool, instance);
}

Result<DebugPage> DebugPage::create(std::string_view pool, std::string_view instance) {
  PLCHOST_TRY_ASSIGN(auto memory,
                     MemoryFile::replace(debug_page_name(pool, instance), sizeof(DebugPageLayout),
                                         new_page<DebugPageLayout>(kDebugPageKind)));
  return DebugPage(std::move(memory));
}

void DebugPage::remove(std::string_view pool, std::string_view instance) noexcept {
  MemoryFile::remove(debug_page_name(pool, instance));
}

void DebugPage::write(std::string_view state) {
  if (state == shown_ || state.size() > kMaxDebugState) return;
  shown_ = state;
  read_since_.reset();
  const auto made = std::make_unique<DebugState>();
  made->version = ++version_;
  made->size = static_cast<std::uint32_t>(state.size());
  std::ranges::copy(state, made->text.begin());
  layout().state.write(*made);
}

DebugPage::Asked DebugPage::asked() const noexcept {
  return {.session = layout().asking_session.load(std::memory_order_acquire),
          .when = TimePoint(Duration(layout().asked_ns.load(std::memory_order_relaxed)))};
}

bool DebugPage::is_being_read(TimePoint now) noexcept {
  const TimePoint last{Duration(layout().reading_ns.load(std::memory_order_acquire))};
  // A stranger may have written it.
  if (last > now || now - last >= kNextPart) {
    read_since_.reset();
    return false;
  }
  if (!read_since_) read_since_ = now;
  return now - *read_since_ < kLongestRead;
}

Result<std::string> read_debug_part(std::string_view pool, std::string_view instance, DebugPart part,
                                    std::size_t most) {
  auto memory = open_fixed_page<DebugPageLayout>(debug_page_name(pool, instance), kDebugPageKind,
                                                 MemoryFile::Access::read_write);
  if (!memory && memory.error().code == ErrorCode::not_found) {
    return failure(
        ErrorCode::not_found,
        fmt::format("instance '{}': its application is no debug build: build it with 'plcctl build "
                    "application --debug'",
                    instance));
  }
  if (!memory) return std::unexpected(std::move(memory).error());
  auto& page = *reinterpret_cast<DebugPageLayout*>(memory->bytes().data());
  const std::int64_t now_ns = MonotonicClock::now().time_since_epoch().count();
  if (part.session != 0) {
    page.asked_ns.store(now_ns, std::memory_order_relaxed);
    page.asking_session.store(part.session, std::memory_order_release);
  }
  const auto state = page.state.read();
  if (!state) return failure(ErrorCode::busy, "the state of the debugger is being written; ask again");
  const std::size_t size = std::min<std::size_t>(state->size, kMaxDebugState);
  const std::string head = fmt::format("{} {} ", state->version, size);
  const std::string_view rest =
      std::string_view(state->text.data(), size).substr(std::min<std::size_t>(part.offset, size));
  const auto given = rest.substr(0, most - std::min(most, head.size()));
  page.reading_ns.store(given.size() < rest.size() ? now_ns : 0, std::memory_order_release);
  // Another user may have written the page.
  return head + printable(std::string(given));
}

}  // namespace plchost
