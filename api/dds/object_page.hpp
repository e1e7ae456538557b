#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include <contract_bounds.hpp>
#include <control.h>

#include "api/dds/kept_record.hpp"
#include "api/dds/page_sample.hpp"
#include "api/dds/text.hpp"
#include "shm/pool/object_info.hpp"

namespace plchost {

/// An object of a pool as it is shown to clients.
struct ListedObject {
  dds::Kept<plc_ObjectRecord> record{};  ///< but for its references
  std::vector<plc_ObjectReference> references;

  [[nodiscard]] std::string_view name() const noexcept { return dds::text_of(record.object_name); }
  [[nodiscard]] ObjectType type() const noexcept { return static_cast<ObjectType>(record.type); }
};

/// Facts of an object that the host knows and its pool does not.
struct ObjectUsers {
  std::uint32_t holder_pid = 0;  ///< mutex: process of the thread that holds it; 0: none, or it has ended
  std::string holder_program = {};
  std::string owner_name = {};  ///< of the user, as the host knows it; empty: it knows none
  std::string group_name = {};
};
[[nodiscard]] ListedObject listed_of(const ObjectInfo& info, const ObjectUsers& users);

/// A part of what was asked for, by name in the order of bytes.
struct ObjectListing {
  std::vector<ListedObject> objects;
  bool complete = true;
  std::string next_after;  ///< not complete: the next part is what comes after this name
};

/// The bounds of a page.
inline constexpr std::size_t kPageObjects = dds::bounds::ObjectPage::objects;
inline constexpr std::size_t kPageReferences = 1024;

/// A listing as it travels.
class ObjectPageSample : public PageSample<plc_ObjectPage> {
 public:
  /// At most kPageObjects. The listing outlives it.
  explicit ObjectPageSample(const ObjectListing& listing);

 private:
  std::vector<plc_ObjectRecord> records_;
  std::vector<std::vector<plc_ObjectReference>> references_;
};

[[nodiscard]] ObjectListing listing_of(const plc_ObjectPage& page);

}  // namespace plchost
