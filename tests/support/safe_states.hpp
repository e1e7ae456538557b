#pragma once

#include <array>
#include <cstdint>
#include <string>

namespace plchost::testing {

/// Words of the output area of the application `outputs`.
using OutputWords = std::array<std::uint32_t, 4>;

/// The values that its tasks put out; of Valve, which waits, none.
inline constexpr OutputWords kDriven{0x11111111, 0x22222222, 0, 0x44444444};

/// A SafeState of that area, and what a terminal is shown then.
struct SafeCase {
  const char* name;
  const char* setting;
  OutputWords shown;
  std::uint64_t registers;

  /// While its tasks run, but for Valve, which waits: its bytes are safe until its first cycle.
  [[nodiscard]] constexpr OutputWords driven() const {
    return {0x11111111, 0x22222222, shown[2], 0x44444444};
  }
};

/// Of SafeState Keep it is what the tasks have put out last.
inline constexpr std::array kSafeCases = {
    SafeCase{"Keep", "Keep", kDriven, 0x5555555555555555},
    SafeCase{"Zero", "zero", {}, 0},
    SafeCase{"Values",
             "0xA1A1A1A1B2B2B2B2C3C3C3C3D4D4D4D4",
             {0xA1A1A1A1, 0xB2B2B2B2, 0xC3C3C3C3, 0xD4D4D4D4},
             0xE5E5E5E5E5E5E5E5},
};

/// With the output area in the object io.out, and if there is a `device`, the registers at its beginning.
inline std::string settings_of(const SafeCase& one, const std::string& device = {}) {
  const std::string setting = one.setting;
  std::string text =
      "[SysMem]\nLinux.Area.0.Flags=0x8\nLinux.Area.0.Object=io.out\nLinux.Area.0.Size=16\n"
      "Linux.Area.0.SafeState=" +
      setting + "\n";
  if (device.empty()) return text;
  return text +
         "Linux.Area.1.Flags=0x8000\nLinux.Area.1.Address=0\nLinux.Area.1.Size=8\nLinux.Area.1.Device=" +
         device + "\nLinux.Area.1.SafeState=" + (setting.starts_with("0x") ? "0xE5E5E5E5E5E5E5E5" : setting) +
         "\n";
}

}  // namespace plchost::testing
