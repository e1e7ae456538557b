#include "api/cli/debug/dap_messages.hpp"

#include <algorithm>
#include <cctype>
#include <charconv>

#include <fmt/format.h>

#include "api/cli/debug/foreign_json.hpp"
#include "shm/base/names.hpp"
#include "shm/base/plain_json.hpp"

namespace plchost {

namespace {

constexpr std::string_view kHeadEnd = "\r\n\r\n";
constexpr std::string_view kLengthKey = "content-length:";
constexpr std::string_view kTypeKey = "content-type:";

std::unexpected<Error> not_dap(std::string_view what) {
  return failure(ErrorCode::corrupt, fmt::format("no message of the Debug Adapter Protocol: {}", what));
}

bool begins_with(std::string_view key, std::string_view line) noexcept {
  return line.size() >= key.size() && std::ranges::equal(line.substr(0, key.size()), key, [](char a, char b) {
           return std::tolower(static_cast<unsigned char>(a)) == b;
         });
}

Result<std::size_t> length_of(std::string_view line) {
  line.remove_prefix(kLengthKey.size());
  while (!line.empty() && line.front() == ' ') line.remove_prefix(1);
  std::size_t length = 0;
  const auto [last, error] = std::from_chars(line.data(), line.data() + line.size(), length);
  if (error == std::errc{} && last == line.data() + line.size() && length <= DapReader::kMaxBody)
    return length;
  return not_dap(fmt::format("'{}' is no length from 0 to {}", shown(line), DapReader::kMaxBody));
}

// The length that the head says. A page in a browser can send a body of its choice to each port of its
// machine, but behind a head of HTTP.
Result<std::size_t> length_in(std::string_view head) {
  std::optional<std::size_t> length;
  while (!head.empty()) {
    const std::size_t end = std::min(head.find("\r\n"), head.size());
    const auto line = head.substr(0, end);
    head.remove_prefix(std::min(end + 2, head.size()));
    if (begins_with(kLengthKey, line)) {
      PLCHOST_TRY_ASSIGN(length, length_of(line));
    } else if (!begins_with(kTypeKey, line)) {
      return not_dap(
          fmt::format("'{}' is no line of a head: Content-Length and Content-Type are", shown(line)));
    }
  }
  if (length) return *length;
  return not_dap("its head has no Content-Length");
}

}  // namespace

Result<std::optional<nlohmann::json>> DapReader::next() {
  const std::size_t head = pending_.find(kHeadEnd);
  if (head == std::string::npos && pending_.size() <= kMaxHead) return std::nullopt;
  if (head > kMaxHead) return not_dap(fmt::format("its head is longer than {} bytes", kMaxHead));
  PLCHOST_TRY_ASSIGN(const auto length, length_in(std::string_view(pending_).substr(0, head)));
  const std::size_t begin = head + kHeadEnd.size();
  if (pending_.size() - begin < length) return std::nullopt;
  auto message = object_in(std::string_view(pending_).substr(begin, length));
  pending_.erase(0, begin + length);
  if (!message)
    return not_dap(fmt::format("its body is no object of JSON of at most {} levels", kMaxJsonDepth));
  return message;
}

std::string dap_packet(const nlohmann::json& message) {
  const std::string body = message.dump(-1, ' ', true, nlohmann::json::error_handler_t::replace);
  return fmt::format("Content-Length: {}\r\n\r\n{}", body.size(), body);
}

}  // namespace plchost
