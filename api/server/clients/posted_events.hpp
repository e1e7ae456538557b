#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

#include "api/dds/guid.hpp"

namespace plchost {

/// How often a source has posted to which events since the last take(), for the records. Bounded: of more
/// events of one source, and of more sources, the posts are counted without a name. One thread at a time.
class PostedEvents {
 public:
  static constexpr std::size_t kEventsOfSource = 16;
  static constexpr std::size_t kSources = 256;

  struct Event {
    std::string instance;
    std::string event;
    std::uint64_t count = 0;
  };
  struct Posts {
    std::vector<Event> events;
    std::uint64_t others = 0;  ///< to events that are not named

    void add(std::string_view instance, std::string_view event, std::uint64_t count);
    void add(const Posts& more);
    [[nodiscard]] bool empty() const noexcept { return events.empty() && others == 0; }
  };
  using BySource = std::unordered_map<dds::Guid, Posts, dds::GuidHash>;

  void note(const dds::Guid& source, std::string_view instance, std::string_view event);
  /// Then there are none.
  [[nodiscard]] BySource take();

 private:
  BySource sources_;
};

}  // namespace plchost
