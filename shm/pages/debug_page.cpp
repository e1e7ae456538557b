#include "shm/pages/debug_page.hpp"

#include <algorithm>
#include <cstring>
#include <memory>

#include <fmt/format.h>

#include "shm/base/names.hpp"
#include "shm/files/fixed_page.hpp"

namespace plchost {

namespace {

/// 1: first. 2: it is read in one part.
constexpr PageKind kDebugPageKind{.what = "page of a debugger",
                                  .magic = 0x6567'6170'6775'6264,  // "dbugpage"
                                  .version = 2};

static_assert(offsetof(DebugPageLayout, version) == 8 && sizeof(DebugState) == 65536);

}  // namespace

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

Result<DebugPart> read_debug_part(std::string_view pool, std::string_view instance, const DebugQuery& query) {
  auto memory = open_fixed_page<DebugPageLayout>(debug_page_name(pool, instance), kDebugPageKind,
                                                 MemoryFile::Access::read_write);
  if (!memory && memory.error().code == ErrorCode::not_found) {
    return failure(
        ErrorCode::not_found,
        fmt::format("instance '{}': its application is no debug build: build it with 'plcctl build "
                    "application --debug'",
                    instance));
  }
  PLCHOST_TRY(memory);
  auto& page = *reinterpret_cast<DebugPageLayout*>(memory->bytes().data());
  if (query.session != 0) {
    page.asked_ns.store(MonotonicClock::now().time_since_epoch().count(), std::memory_order_relaxed);
    page.asking_session.store(query.session, std::memory_order_release);
  }
  const auto state = page.state.read();
  if (!state) return failure(ErrorCode::busy, "the state of the debugger is being written; ask again");
  const std::size_t size = std::min<std::size_t>(state->size, kMaxDebugState);
  // Another user may have written the page.
  std::string text = printable(std::string(state->text.data(), size));
  text.erase(0, std::min<std::size_t>(query.offset, size));
  return DebugPart{.version = state->version, .size = size, .offset = query.offset, .text = std::move(text)};
}

}  // namespace plchost
