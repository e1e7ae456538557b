#include "manager/host_check/host_check_handler.hpp"

#include <utility>

#include <fmt/format.h>

namespace plchost {

namespace {

// Of a packet of kMaxPacket; the reply around it and one finding more than fits leave room.
constexpr std::size_t kMaxPart = 12'000;

}  // namespace

void HostCheckHandler::handle(const ControlRequest& request, ControlReplyFunction reply) {
  if (request.verb != ControlVerb::check_host || !request.instance.empty()) {
    return instances_.handle(request, std::move(reply));
  }
  auto text = part(request);
  if (text) {
    reply({.number = request.number, .code = ErrorCode::ok, .text = *std::move(text)});
  } else {
    reply({.number = request.number, .code = text.error().code, .text = text.error().describe()});
  }
}

Result<std::string> HostCheckHandler::part(const ControlRequest& request) {
  std::size_t first = 0;
  if (request.argument.empty()) {
    findings_ = look_();
    ++check_;
  } else {
    PLCHOST_TRY_ASSIGN(const auto wanted, parse_first_finding(request.argument));
    if (check_ == 0 || wanted > findings_.size()) {
      return failure(ErrorCode::not_found,
                     fmt::format("there is no finding {}; there are {}", wanted, findings_.size()));
    }
    first = wanted;
  }
  return encode_part(check_, findings_, first, kMaxPart);
}

}  // namespace plchost
