#pragma once

#include <contract_bounds.hpp>
#include <control.h>

#include "api/dds/page_sample.hpp"
#include "shm/pages/debug_page.hpp"

namespace plchost {

/// The query as it travels, and back.
[[nodiscard]] plc_ListPart part_of(const DebugQuery& query) noexcept;
[[nodiscard]] DebugQuery debug_query_of(const plc_ListPart& part) noexcept;

static_assert(kMaxDebugState <= dds::bounds::DebugPage::contents, "a page holds the whole state");

/// A part of the state of a debugger as it travels.
class DebugPageSample : public PageSample<plc_DebugPage> {
 public:
  /// Of at most kMaxDebugState bytes. The part outlives it.
  explicit DebugPageSample(const DebugPart& part) noexcept;
};

[[nodiscard]] DebugPart listing_of(const plc_DebugPage& page);

}  // namespace plchost
