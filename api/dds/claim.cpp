#include "api/dds/claim.hpp"

#include <array>
#include <cerrno>
#include <memory>
#include <string_view>

#include <fmt/format.h>
#include <unistd.h>

#include "shm/base/names.hpp"

namespace plchost::dds {

namespace {

constexpr std::size_t kMaxClaim = 127;
constexpr std::string_view kBegin = "plchost: ";  // others use the same data for something else

}  // namespace

Qos client_participant_qos() {
  std::array<char, 65> machine{};
  (void)::gethostname(machine.data(), machine.size() - 1);
  Qos qos;
  qos.user_data(fmt::format("{}{} {}, user {}, on {}", kBegin, ::program_invocation_short_name, ::getpid(),
                            ::getuid(), machine.data()));
  return qos;
}

std::string claim_of(const dds_qos_t* qos) {
  void* data = nullptr;
  std::size_t size = 0;
  if (qos == nullptr || !dds_qget_userdata(qos, &data, &size) || data == nullptr) return "";
  const std::unique_ptr<void, decltype(&dds_free)> owner(data, &dds_free);
  const std::string_view text(static_cast<const char*>(data), size);
  if (!text.starts_with(kBegin)) return "";
  const std::string_view claim = cut(text.substr(kBegin.size()), kMaxClaim);
  return is_printable_utf8(claim) ? std::string(claim) : "";
}

}  // namespace plchost::dds
