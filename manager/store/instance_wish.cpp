#include "manager/store/instance_wish.hpp"

#include <array>
#include <span>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "shm/base/crc32c.hpp"
#include "shm/base/names.hpp"

namespace plchost {

namespace {

using Json = nlohmann::json;

// 2: number. A member that a manager can do without gets no new version: the wishes of an older or a newer
// manager would be unreadable, and no instance would start.
constexpr std::uint32_t kWishVersion = 2;

template <class T>
struct WishMember {
  const char* key;
  T InstanceWish::* member;
};
constexpr std::array kWishTexts = {
    WishMember<std::string>{"problem", &InstanceWish::problem},
    WishMember<std::string>{"last_end", &InstanceWish::last_end},
    WishMember<std::string>{"application", &InstanceWish::application},
    WishMember<std::string>{"scheduler", &InstanceWish::scheduler},
    WishMember<std::string>{"configured_application", &InstanceWish::configured_application},
    WishMember<std::string>{"configured_scheduler", &InstanceWish::configured_scheduler},
    WishMember<std::string>{"configured_process", &InstanceWish::configured_process}};
// Empty, or false, where an older manager has written the wish.
constexpr std::array kLaterWishTexts = {
    WishMember<std::string>{"application_before", &InstanceWish::application_before},
    WishMember<std::string>{"taken_back", &InstanceWish::taken_back}};
constexpr std::array kLaterWishFlags = {WishMember<bool>{"stopping", &InstanceWish::stopping}};
constexpr std::array kWishFlags = {WishMember<bool>{"commanded", &InstanceWish::commanded},
                                   WishMember<bool>{"running", &InstanceWish::running},
                                   WishMember<bool>{"offline", &InstanceWish::offline},
                                   WishMember<bool>{"failed", &InstanceWish::failed},
                                   WishMember<bool>{"safe_mode", &InstanceWish::safe_mode},
                                   WishMember<bool>{"host_ended", &InstanceWish::host_ended}};
constexpr std::array kWishNumbers = {
    WishMember<std::uint32_t>{"number", &InstanceWish::number},
    WishMember<std::uint32_t>{"restarts", &InstanceWish::restarts},
    WishMember<std::uint32_t>{"ends_in_a_row", &InstanceWish::ends_in_a_row}};

std::string wish_checksum(std::string_view text) {
  return fmt::format("{:08x}", crc32c(std::as_bytes(std::span(text))));
}

template <class T>
bool take(const Json& json, const char* key, T& value) {
  const auto found = json.find(key);
  if (found == json.end()) return false;
  if constexpr (std::is_same_v<T, bool>) {
    if (!found->is_boolean()) return false;
  } else if constexpr (std::is_same_v<T, std::string>) {
    if (!found->is_string()) return false;
  } else {
    if (!found->is_number_unsigned() || found->template get<std::uint64_t>() > UINT32_MAX) return false;
  }
  value = found->template get<T>();
  return true;
}

bool take_crashes(const Json& json, std::vector<std::int64_t>& crashes) {
  const auto found = json.find("crashes_unix_ns");
  if (found == json.end() || !found->is_array()) return false;
  for (const Json& crash : *found) {
    if (!crash.is_number_integer()) return false;
    crashes.push_back(crash.get<std::int64_t>());
  }
  return true;
}

bool take_all(const Json& json, InstanceWish& wish) {
  bool whole = true;
  for (const auto& text : kWishTexts) whole = whole && take(json, text.key, wish.*text.member);
  for (const auto& text : kLaterWishTexts) {
    whole = whole && (!json.contains(text.key) || take(json, text.key, wish.*text.member));
  }
  for (const auto& flag : kLaterWishFlags) {
    whole = whole && (!json.contains(flag.key) || take(json, flag.key, wish.*flag.member));
  }
  for (const auto& flag : kWishFlags) whole = whole && take(json, flag.key, wish.*flag.member);
  for (const auto& number : kWishNumbers) whole = whole && take(json, number.key, wish.*number.member);
  std::uint32_t kind = 0;
  std::uint32_t process = 0;
  whole = whole && take(json, "start_kind", kind) && take(json, "process", process);
  if (!whole || kind > static_cast<std::uint32_t>(StartKind::after_fault) ||
      process > static_cast<std::uint32_t>(InstanceWish::Process::ending)) {
    return false;
  }
  wish.start_kind = static_cast<StartKind>(kind);
  wish.process = static_cast<InstanceWish::Process>(process);
  return take_crashes(json, wish.crashes_unix_ns);
}

}  // namespace

InstanceWish InstanceWish::after_power_cut() const {
  InstanceWish wish = *this;
  wish.process = Process::none;
  wish.host_ended = true;
  return wish;
}

std::string encode(const InstanceWish& wish) {
  Json json{{"version", kWishVersion},
            {"start_kind", static_cast<std::uint32_t>(wish.start_kind)},
            {"process", static_cast<std::uint32_t>(wish.process)},
            {"crashes_unix_ns", wish.crashes_unix_ns}};
  for (const auto& text : kWishTexts) json[text.key] = std::string(cut(wish.*text.member, kMaxWishText));
  for (const auto& text : kLaterWishTexts) json[text.key] = std::string(cut(wish.*text.member, kMaxWishText));
  for (const auto& flag : kLaterWishFlags) json[flag.key] = wish.*flag.member;
  for (const auto& flag : kWishFlags) json[flag.key] = wish.*flag.member;
  for (const auto& number : kWishNumbers) json[number.key] = wish.*number.member;
  const std::string text = json.dump(-1, ' ', false, Json::error_handler_t::replace);
  return fmt::format("{} {}\n", wish_checksum(text), text);
}

Result<InstanceWish> decode_wish(std::string_view text) {
  constexpr std::size_t kChecksum = 9;  // eight digits and a space
  if (text.size() <= kChecksum + 1 || text.size() > kMaxWishBytes || !text.ends_with('\n')) {
    return failure(ErrorCode::corrupt, fmt::format("it has {} bytes", text.size()));
  }
  const std::string_view body = text.substr(kChecksum, text.size() - kChecksum - 1);
  if (text.substr(0, kChecksum) != wish_checksum(body) + " ") {
    return failure(ErrorCode::corrupt, "its checksum does not fit its contents");
  }
  const Json json = Json::parse(body, nullptr, false);
  std::uint32_t version = 0;
  if (!json.is_object() || !take(json, "version", version) || version != kWishVersion) {
    return failure(ErrorCode::corrupt, fmt::format("it has version {}; {} is known", version, kWishVersion));
  }
  InstanceWish wish;
  if (!take_all(json, wish)) return failure(ErrorCode::corrupt, "a value is missing in it");
  return wish;
}

}  // namespace plchost
