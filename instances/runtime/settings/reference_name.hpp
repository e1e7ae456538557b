#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace plchost {

/// The clock that [DistributedClock] Reference names.
struct ReferenceName {
  enum class Kind : std::uint8_t {
    record,    ///< "bus1": a reference record in the pool
    realtime,  ///< "realtime": CLOCK_REALTIME
    tai,       ///< "tai": CLOCK_TAI
    device,    ///< "ptp:/dev/ptp0": the clock of a network card, or of the host of a virtual machine
  };
  Kind kind = Kind::record;
  std::string text;  ///< name of the record, or path of the device
};

inline constexpr std::string_view kReferenceForm =
    "realtime, tai, ptp:/dev/NAME, or the name of a shared memory of the pool, 1 to 95 letters, digits, "
    "_ - .";

/// Words count in any case, so no record can have their names. A record has no ':' in its name, so the prefix
/// tells a device from it. Nothing: see kReferenceForm.
[[nodiscard]] std::optional<ReferenceName> parse_reference(std::string_view text);

}  // namespace plchost
