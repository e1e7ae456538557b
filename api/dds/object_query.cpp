#include "api/dds/object_query.hpp"

#include <algorithm>
#include <array>
#include <utility>

#include <fmt/format.h>

#include "api/dds/text.hpp"
#include "shm/base/names.hpp"
#include "shm/base/utf8.hpp"

namespace plchost {

namespace {

static_assert(sizeof(plc_ListPart::name) == kMaxObjectName + 1);

Result<void> check_pattern(std::string_view pattern) {
  if (pattern.size() <= kMaxObjectName && is_printable_utf8(pattern)) return {};
  return failure(
      ErrorCode::invalid_argument,
      fmt::format("a pattern of {} bytes is not valid: allowed are up to {} bytes of UTF-8 without "
                  "control characters",
                  pattern.size(), kMaxObjectName));
}

Result<void> check_query(const ObjectQuery& query) {
  const bool others = query.type || !query.match.empty() || !query.after.empty();
  if (!query.name.empty() && others) {
    return failure(ErrorCode::invalid_argument, "either one object by name, or a type, a pattern or both");
  }
  for (const std::string* name : {&query.name, &query.after}) {
    if (name->empty()) continue;
    PLCHOST_TRY(check_object_name(*name));
  }
  return check_pattern(query.match);
}

// Where the next character of UTF-8 begins.
std::size_t next_character(std::string_view text, std::size_t at) noexcept {
  do {
    ++at;
  } while (at < text.size() && continues_utf8(text[at]));
  return at;
}

}  // namespace

Result<ObjectType> parse_object_type(std::string_view text) {
  const auto found = std::ranges::find(kObjectTraits, text, &ObjectTraits::name);
  if (found != kObjectTraits.end()) return found->type;
  std::array<std::string_view, kObjectTypes> names;
  std::ranges::transform(kObjectTraits, names.begin(), &ObjectTraits::name);
  return failure(ErrorCode::invalid_argument, fmt::format("no type of object is called '{}'; allowed are: {}",
                                                          shown(text), join_names(names)));
}

Result<plc_ListPart> part_of(const ObjectQuery& query) {
  PLCHOST_TRY(check_query(query));
  plc_ListPart part{};
  dds::copy_text(part.name, query.name);
  if (query.type) dds::copy_text(part.type, to_string(*query.type));
  dds::copy_text(part.match, query.match);
  dds::copy_text(part.after_name, query.after);
  return part;
}

Result<ObjectQuery> object_query_of(const plc_ListPart& part) {
  ObjectQuery query{.name = std::string(dds::text_of(part.name)),
                    .match = std::string(dds::text_of(part.match)),
                    .after = std::string(dds::text_of(part.after_name))};
  if (const auto type = dds::text_of(part.type); !type.empty()) {
    PLCHOST_TRY_ASSIGN(query.type, parse_object_type(type));
  }
  PLCHOST_TRY(check_query(query));
  return query;
}

// On a mismatch only the last '*' takes one character more: at most pattern times name steps.
bool matches_pattern(std::string_view pattern, std::string_view name) noexcept {
  constexpr std::size_t kNone = std::string_view::npos;
  std::size_t at = 0;
  std::size_t in_name = 0;
  std::size_t star = kNone;
  std::size_t taken = 0;  // the name up to here belongs to that '*' and what was before it
  while (in_name < name.size()) {
    if (at < pattern.size() && pattern[at] == '*') {
      star = at++;
      taken = in_name;
    } else if (at < pattern.size() && pattern[at] == '?') {
      ++at;
      in_name = next_character(name, in_name);
    } else if (at < pattern.size() && pattern[at] == name[in_name]) {
      ++at;
      ++in_name;
    } else if (star != kNone) {
      at = star + 1;
      in_name = taken = next_character(name, taken);
    } else {
      return false;
    }
  }
  return pattern.find_first_not_of('*', at) == kNone;
}

}  // namespace plchost
