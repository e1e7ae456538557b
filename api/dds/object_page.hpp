#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <string>
#include <vector>

#include <control.h>

#include "api/dds/page_sample.hpp"
#include "shm/pool/object_info.hpp"

namespace plchost {

/// An object of a pool as it is shown to clients.
struct ListedObject {
  ObjectInfo info;
  std::uint32_t holder_pid = 0;  ///< mutex: process of the thread that holds it; 0: none, or it has ended
  std::string holder_program;
  std::string owner_name;  ///< of the user, as the host knows it; empty: it knows none
  std::string group_name;
};

/// A part of what was asked for, by name in the order of bytes.
struct ObjectListing {
  std::vector<ListedObject> objects;
  bool complete = true;
  std::string next_after;  ///< not complete: the next part is what comes after this name
};

/// The bounds of a page.
inline constexpr std::size_t kPageObjects = 256;
inline constexpr std::size_t kPageReferences = 1024;

/// A listing as it travels.
class ObjectPageSample : public PageSample<plc_ObjectPage> {
 public:
  /// At most kPageObjects.
  explicit ObjectPageSample(const ObjectListing& listing);

 private:
  std::vector<plc_ObjectRecord> records_;
  std::deque<std::vector<plc_ObjectReference>> references_;
};

[[nodiscard]] ObjectListing listing_of(const plc_ObjectPage& page);

}  // namespace plchost
