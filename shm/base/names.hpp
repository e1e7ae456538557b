#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include "shm/base/result.hpp"

namespace plchost {

/// The longest names, in bytes without the terminating zero. The task and event bounds are the seed's
/// `char stName[51]`.
inline constexpr std::size_t kMaxHostName = 63;
inline constexpr std::size_t kMaxInstanceName = 31;
inline constexpr std::size_t kMaxTaskName = 50;
inline constexpr std::size_t kMaxEventName = 50;
inline constexpr std::size_t kMaxObjectName = 95;
inline constexpr std::size_t kMaxPath = 255;
/// The argument of an operation: a path, a name, or the name and the value of a variable.
inline constexpr std::size_t kMaxArgument = 1535;
inline constexpr std::size_t kMaxSchedulerName = 31;
/// All schedulers of a host, with commas between.
inline constexpr std::size_t kMaxSchedulerList = 511;

/// A host, instance or event name: 1 to `max` characters of A-Z a-z 0-9 _ - and (not first) a dot. Such a
/// name can stand in a path, a DDS partition and a command line unquoted. `what` is how the error calls it.
[[nodiscard]] Result<void> check_name(std::string_view what, std::string_view name, std::size_t max);

/// A-Z a-z 0-9 _ - and the dot.
[[nodiscard]] bool is_name_character(char c) noexcept;

/// Whether it is well-formed UTF-8 without control characters. Characters that change the order of others
/// (U+202E), end a line (U+2028) or are not seen (U+200B, U+FEFF) count as these.
[[nodiscard]] bool is_printable_utf8(std::string_view text) noexcept;

/// The text with '?' in place of each byte that could drive a terminal or make two lines of one, or is no
/// UTF-8.
[[nodiscard]] std::string printable(std::string text);
/// The same of each line of a text.
[[nodiscard]] std::string printable_lines(std::string_view text);

/// Whether an object may have this name: 1 to kMaxObjectName bytes, and is_printable_utf8().
[[nodiscard]] bool is_object_name(std::string_view name) noexcept;
/// The same; invalid_argument says what is allowed.
[[nodiscard]] Result<void> check_object_name(std::string_view name);

/// The object that holds the external event `event` of `instance` in the pool: "instance/event".
[[nodiscard]] std::string event_object_name(std::string_view instance, std::string_view event);

/// `known` that is most like `unknown`, else the only one with it as a word ("domain" of "dds_domain"), else
/// empty: for "did you mean".
[[nodiscard]] std::string_view nearest_name(std::string_view unknown,
                                            std::span<const std::string_view> known);
/// The same, with no more than `most` characters to insert, remove or replace.
[[nodiscard]] std::string_view nearest_name(std::string_view unknown, std::span<const std::string_view> known,
                                            std::size_t most);

/// "a, b, c", for messages that list what is allowed; "none" if there is nothing.
[[nodiscard]] std::string join_names(std::span<const std::string_view> names);

/// "1 task", "3 tasks": a number and its noun. `several`: the plural, if it is not the noun with an s.
[[nodiscard]] std::string count_text(std::uint64_t count, std::string_view one,
                                     std::string_view several = {});

/// The error text for the first word that looks like an option and is none of `options` ("--config", "-o"):
/// "unknown option '--confg' (did you mean '--config'?); known are --config, -o". Empty: there is none.
[[nodiscard]] std::string unknown_option(std::span<const std::string> words,
                                         std::span<const std::string> options);

/// The first `most` bytes, without a torn character of UTF-8 at the end.
[[nodiscard]] std::string_view cut(std::string_view text, std::size_t most) noexcept;

/// The text; a longer one than `most` bytes is cut and says so: it ends in "...".
[[nodiscard]] std::string shortened(std::string_view text, std::size_t most);

/// The last `most` bytes, without a torn character at the beginning.
[[nodiscard]] std::string_view cut_front(std::string_view text, std::size_t most) noexcept;

/// Of a stranger's name or value, this much is told, and as printable() has it.
inline constexpr std::size_t kShownBytes = 80;
[[nodiscard]] std::string shown(std::string_view text);

/// "a, b, c and 7 more", for lists that a stranger wrote: the first kShownNames, each as shown() cuts it.
inline constexpr std::size_t kShownNames = 20;
[[nodiscard]] std::string join_some(std::span<const std::string> names);

/// A bounded text in place, for shared memory: always terminated, cut if too long.
template <std::size_t Max>
struct FixedText {
  std::array<char, Max + 1> bytes{};

  FixedText() = default;
  explicit FixedText(std::string_view text) { assign(text); }
  void assign(std::string_view text) noexcept {
    bytes.fill('\0');
    std::copy_n(text.begin(), std::min(text.size(), Max), bytes.begin());
  }
  /// Never reads past the end, whatever a stranger wrote there.
  [[nodiscard]] std::string_view view() const noexcept {
    const auto end = std::find(bytes.begin(), bytes.end(), '\0');
    return {bytes.data(), static_cast<std::size_t>(end - bytes.begin())};
  }
};

/// Makes a text that a stranger may have written what printable() makes of it.
template <std::size_t Max>
void replace_unprintable(FixedText<Max>& text) {
  if (!is_printable_utf8(text.view())) text.assign(printable(std::string(text.view())));
}

}  // namespace plchost
