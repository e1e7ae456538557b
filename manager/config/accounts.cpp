#include "manager/config/accounts.hpp"

#include <charconv>
#include <limits>
#include <optional>
#include <string_view>
#include <vector>

#include <fmt/format.h>
#include <grp.h>
#include <pwd.h>

#include "shm/base/names.hpp"

namespace plchost {

namespace {

constexpr std::size_t kMaxRecord = 1 << 20;  // a group lists its members

std::optional<std::uint32_t> number_in(std::string_view text, int base) {
  std::uint32_t number = 0;
  const char* const end = text.data() + text.size();
  // NOLINTNEXTLINE(bugprone-suspicious-stringview-data-usage): `end` is the size
  const auto [stopped, error] = std::from_chars(text.data(), end, number, base);
  const bool whole = error == std::errc() && stopped == end;
  // The greatest number means "leave it as it is" to chown(2).
  return whole && number != std::numeric_limits<std::uint32_t>::max() ? std::optional(number) : std::nullopt;
}

/// getpwnam_r or getgrnam_r, with as much room as the record needs.
template <class Record, class Lookup>
std::optional<Record> look_up(const std::string& name, Lookup lookup) {
  Record record{};
  for (std::size_t room = 1024; room <= kMaxRecord; room *= 2) {
    std::vector<char> buffer(room);
    Record* found = nullptr;
    const int error = lookup(name.c_str(), &record, buffer.data(), buffer.size(), &found);
    if (error == ERANGE) continue;
    if (error == 0 && found != nullptr)
      return record;  // only its number is used: the texts go with the buffer
    break;
  }
  return std::nullopt;
}

std::unexpected<Error> no_such(std::string_view what, const std::string& text) {
  return failure(
      ErrorCode::invalid_argument,
      fmt::format("there is no {} \"{}\" on this host; allowed is a {}'s name or number, in quotes", what,
                  shown(text), what));
}

}  // namespace

Result<uid_t> user_number(const std::string& text) {
  if (const auto number = number_in(text, 10)) return *number;
  if (const auto found = look_up<passwd>(text, ::getpwnam_r)) return found->pw_uid;
  return no_such("user", text);
}

Result<gid_t> group_number(const std::string& text) {
  if (const auto number = number_in(text, 10)) return *number;
  if (const auto found = look_up<group>(text, ::getgrnam_r)) return found->gr_gid;
  return no_such("group", text);
}

Result<mode_t> parse_mode(const std::string& text) {
  constexpr mode_t kAllowed = 0666;
  constexpr mode_t kNeeded = 0600;
  const auto mode = text.size() == 3 || text.size() == 4 ? number_in(text, 8) : std::nullopt;
  if (mode && (*mode & ~kAllowed) == 0 && (*mode & kNeeded) == kNeeded) return *mode;
  return failure(
      ErrorCode::invalid_argument,
      fmt::format("\"{}\" is not allowed; allowed are permission bits as chmod takes them, \"0600\" to "
                  "\"0666\": the owner reads and writes, nobody executes",
                  shown(text)));
}

}  // namespace plchost
