#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "instances/launch/launch_contract.hpp"
#include "shm/base/result.hpp"

namespace plchost {

/// The state that an instance is to have, and its history: state of the host that outlives the manager and a
/// power cut.
struct InstanceWish {
  /// Of the process that the instance had when this was written.
  enum class Process : std::uint8_t {
    none,
    setting_up,
    up,
    ending,  ///< it was asked to end
  };

  bool commanded = false;  ///< an operator has started or stopped it; else `autostart` decides
  bool running = true;     ///< its application is to run
  bool stopping = false;   ///< an operator's stop is under way: its end was not seen
  bool offline = false;    ///< it is to have no process
  bool failed = false;     ///< its policy has given it up
  std::string problem;     ///< why it failed
  std::string last_end;    ///< how the last process ended by itself; empty: it did not
  std::string application;
  std::string
      application_before;  ///< the one that ran before `application`, while that has not come up; else empty
  std::string taken_back;  ///< why `application` runs again, with the settings it had; empty: it does not
  std::string scheduler;   ///< empty: as its settings say
  /// The configuration when this was written: a value that is another one now takes effect.
  std::string configured_application;
  std::string configured_scheduler;
  std::string configured_process;  ///< core, priority band, limits and settings file
  bool safe_mode = false;
  StartKind start_kind = StartKind::first;  ///< of the next process
  std::uint32_t restarts = 0;
  std::uint32_t ends_in_a_row = 0;
  std::vector<std::int64_t> crashes_unix_ns;  ///< within the crash window

  Process process = Process::none;
  /// The manager ended in order, or the host lost its power: processes of that time ended with the host.
  bool host_ended = false;
  /// Of two wishes of an instance, the one with the higher number is newer. WishStore sets it; elsewhere 0.
  std::uint32_t number = 0;

  bool operator==(const InstanceWish&) const = default;
  /// The part of it that a power cut leaves: no process.
  [[nodiscard]] InstanceWish after_power_cut() const;
};

/// Longer texts of `problem`, `last_end` and `taken_back` are cut.
inline constexpr std::size_t kMaxWishText = 500;
/// The most bytes of an encoded wish.
inline constexpr std::size_t kMaxWishBytes = 20'000;

/// As text, with a checksum over all of it.
[[nodiscard]] std::string encode(const InstanceWish& wish);
/// corrupt: cut, changed, of another version, or something else.
[[nodiscard]] Result<InstanceWish> decode_wish(std::string_view text);

}  // namespace plchost
