#pragma once

#include <string>

#include <fmt/format.h>

#include "shm/base/result.hpp"

namespace plchost {

/// A page that points to parts beside it, so it stays where it was made. The caller of page() fills in the
/// members by which it is told: identity, host and epoch.
template <class Page>
class PageSample {
 public:
  PageSample(const PageSample&) = delete;
  PageSample& operator=(const PageSample&) = delete;

  [[nodiscard]] Page& page() noexcept { return page_; }

 protected:
  PageSample() = default;
  ~PageSample() = default;

  Page page_{};
};

/// Whether a host lists more than `page` and those before it: then `query` asks for the next page. corrupt:
/// the host goes on where it was.
template <class Page, class Query>
[[nodiscard]] Result<bool> next_page(const std::string& host, const Page& page, Query& query) {
  if (page.complete) return false;
  if (page.next_after <= query.after) {
    return failure(ErrorCode::corrupt, fmt::format("host '{}' lists nothing after '{}'", host, query.after));
  }
  query.after = page.next_after;
  return true;
}

}  // namespace plchost
