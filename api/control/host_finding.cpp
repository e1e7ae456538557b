#include "api/control/host_finding.hpp"

#include <array>
#include <charconv>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace plchost {

namespace {

using Json = nlohmann::json;

constexpr std::array kLevels = {std::string_view("ok"), std::string_view("note"), std::string_view("warning"),
                                std::string_view("problem")};

struct TextField {
  const char* key;
  std::string HostFinding::* member;
  std::size_t bound;
};
constexpr std::array kTexts = {
    TextField{"id", &HostFinding::id, kMaxFindingId},
    TextField{"subject", &HostFinding::subject, kMaxFindingSubject},
    TextField{"found", &HostFinding::found, kMaxFindingFound},
    TextField{"why", &HostFinding::why, kMaxFindingWhy},
    TextField{"advice", &HostFinding::advice, kMaxFindingAdvice},
};

Json to_json(const HostFinding& finding) {
  Json json{{"level", static_cast<unsigned>(finding.level)}};
  for (const TextField& field : kTexts) json[field.key] = (finding.*field.member).substr(0, field.bound);
  return json;
}

std::string dump(const Json& json) {
  // A text cut within a character, or a hostile name, is replaced, never thrown about.
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

// The length of a text as a JSON string inside a reply.
std::size_t quoted_size(const std::string& text) {
  return dump(Json(text)).size();
}

Result<std::uint64_t> number_of(const Json& json, const char* key, std::uint64_t max) {
  const auto found = json.find(key);
  if (found == json.end() || !found->is_number_unsigned() || found->get<std::uint64_t>() > max) {
    return failure(ErrorCode::corrupt, fmt::format("findings have no valid '{}'", key));
  }
  return found->get<std::uint64_t>();
}

Result<HostFinding> finding_of(const Json& json) {
  if (!json.is_object()) return failure(ErrorCode::corrupt, "a finding is not a JSON object");
  PLCHOST_TRY_ASSIGN(const auto level, number_of(json, "level", kLevels.size() - 1));
  HostFinding finding;
  finding.level = static_cast<FindingLevel>(level);
  for (const TextField& field : kTexts) {
    const auto found = json.find(field.key);
    if (found == json.end() || !found->is_string()) {
      return failure(ErrorCode::corrupt, fmt::format("a finding has no text '{}'", field.key));
    }
    finding.*field.member = found->get<std::string>();
    // Replaced bytes may have made it longer than it was when it was cut.
    if ((finding.*field.member).size() > field.bound) (finding.*field.member).resize(field.bound);
  }
  if (finding.id.empty()) return failure(ErrorCode::corrupt, "a finding has an empty 'id'");
  return finding;
}

}  // namespace

std::string_view to_string(FindingLevel level) noexcept {
  const auto index = static_cast<std::size_t>(level);
  return index < kLevels.size() ? kLevels.at(index) : std::string_view("unknown");
}

std::string encode_part(std::uint64_t check, std::span<const HostFinding> all, std::size_t first,
                        std::size_t max_bytes) {
  Json part{{"check", check}, {"total", all.size()}, {"first", first}, {"findings", Json::array()}};
  std::size_t size = quoted_size(dump(part));
  for (std::size_t i = first; i < all.size(); ++i) {
    Json finding = to_json(all[i]);
    size += quoted_size(dump(finding)) + 1;
    if (i > first && size > max_bytes) break;
    part["findings"].push_back(std::move(finding));
  }
  return dump(part);
}

Result<FindingsPart> decode_part(std::string_view text) {
  const Json json = Json::parse(text, nullptr, false);
  if (!json.is_object()) return failure(ErrorCode::corrupt, "findings are not a JSON object");
  FindingsPart part;
  PLCHOST_TRY_ASSIGN(part.check, number_of(json, "check", UINT64_MAX));
  PLCHOST_TRY_ASSIGN(part.total, number_of(json, "total", kMaxFindings));
  PLCHOST_TRY_ASSIGN(part.first, number_of(json, "first", kMaxFindings));
  const auto findings = json.find("findings");
  if (findings == json.end() || !findings->is_array() || part.first + findings->size() > part.total) {
    return failure(ErrorCode::corrupt, "findings have no array 'findings' within their total");
  }
  for (const Json& each : *findings) {
    PLCHOST_TRY_ASSIGN(auto finding, finding_of(each));
    part.findings.push_back(std::move(finding));
  }
  return part;
}

Result<std::size_t> parse_first_finding(std::string_view argument) {
  std::size_t first = 0;
  const char* const end = argument.data() + argument.size();
  // NOLINTNEXTLINE(bugprone-suspicious-stringview-data-usage): `end` is the size
  const auto [stopped, error] = std::from_chars(argument.data(), end, first);
  if (error != std::errc() || stopped != end || first > kMaxFindings) {
    return failure(ErrorCode::invalid_argument,
                   fmt::format("the argument is the number of a finding, 0 to {}, or empty", kMaxFindings));
  }
  return first;
}

}  // namespace plchost
