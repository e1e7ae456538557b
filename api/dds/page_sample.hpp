#pragma once

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

}  // namespace plchost
