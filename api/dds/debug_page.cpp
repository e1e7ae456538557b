#include "api/dds/debug_page.hpp"

#include <span>

#include "api/dds/sequence.hpp"

namespace plchost {

plc_ListPart part_of(const DebugQuery& query) noexcept {
  plc_ListPart part{};
  part.session = query.session;
  part.offset = query.offset;
  return part;
}

DebugQuery debug_query_of(const plc_ListPart& part) noexcept {
  return {.session = part.session, .offset = part.offset};
}

DebugPageSample::DebugPageSample(const DebugPart& part) noexcept {
  page_.version = part.version;
  page_.size = part.size;
  page_.offset = part.offset;
  dds::lend_bytes(page_.contents, std::as_bytes(std::span(part.text)));
}

DebugPart listing_of(const plc_DebugPage& page) {
  const auto contents = dds::parts_of(page.contents);
  return {.version = page.version,
          .size = page.size,
          .offset = page.offset,
          .text = std::string(contents.begin(), contents.end())};
}

}  // namespace plchost
