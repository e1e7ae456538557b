#include "api/audit/audit_record.hpp"

#include <array>
#include <ctime>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "api/security/sha256.hpp"
#include "shm/base/time.hpp"

namespace plchost {

namespace {

using Json = nlohmann::ordered_json;
constexpr std::string_view kHashField = R"("hash":")";
constexpr std::size_t kHashDigits = 64;

// "2026-01-31T12:00:00.123456789Z"
std::string utc(std::int64_t unix_ns) {
  constexpr std::int64_t kSecond = 1'000'000'000;
  const std::time_t seconds = unix_ns / kSecond;
  std::tm broken{};
  ::gmtime_r(&seconds, &broken);
  std::array<char, sizeof "2026-01-31T12:00:00"> text{};
  std::strftime(text.data(), text.size(), "%Y-%m-%dT%H:%M:%S", &broken);
  return fmt::format("{}.{:09}Z", text.data(), unix_ns % kSecond);
}

}  // namespace

std::string chain(const AuditRecord& record, AuditHead& head) {
  const Json fields = {{"n", head.number + 1},        {"time", utc(record.time_unix_ns)},
                       {"who", record.who},           {"from", record.from},
                       {"what", record.what},         {"on", record.on},
                       {"argument", record.argument}, {"result", record.result},
                       {"text", record.text},         {"before", head.hash}};
  std::string line = fields.dump(-1, ' ', false, Json::error_handler_t::replace);
  line.back() = ',';
  head.hash = sha256(line);
  ++head.number;
  return fmt::format("{}{}{}\"}}\n", line, kHashField, head.hash);
}

Result<AuditLink> read_link(std::string_view line) {
  const auto damaged = [](std::string_view why) { return failure(ErrorCode::corrupt, std::string(why)); };
  const Json fields = Json::parse(line, nullptr, /*allow_exceptions=*/false);
  if (!fields.is_object()) return damaged("no record: it is no JSON object");
  const auto text = [&](const char* name) -> std::string {
    const auto found = fields.find(name);
    return found != fields.end() && found->is_string() ? found->get<std::string>() : std::string();
  };
  const auto number = fields.find("n");
  if (number == fields.end() || !number->is_number_unsigned()) return damaged("no record: it has no number");
  AuditLink link{.number = number->get<std::uint64_t>(),
                 .before = text("before"),
                 .hash = text("hash"),
                 .what = text("what")};
  constexpr std::size_t kTail = kHashField.size() + kHashDigits + 2;  // and "}
  if (line.size() <= kTail || !line.substr(line.size() - kTail).starts_with(kHashField)) {
    return damaged("no record: its last field is not its hash");
  }
  if (sha256(line.substr(0, line.size() - kTail)) != link.hash) {
    return damaged("the hash is not that of the record: it was changed");
  }
  return link;
}

}  // namespace plchost
