#include "shm/process/capabilities.hpp"

#include <array>
#include <cstdint>
#include <functional>

#include <linux/capability.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <unistd.h>

#include "shm/base/system_call.hpp"

namespace plchost {

namespace {

using Capabilities = std::array<std::uint32_t, _LINUX_CAPABILITY_U32S_3>;

// The system calls: libcap would be a dependency of each instance.
Result<void> change(const std::function<void(__user_cap_data_struct& rights, std::size_t place)>& each) {
  __user_cap_header_struct header{.version = _LINUX_CAPABILITY_VERSION_3, .pid = 0};
  std::array<__user_cap_data_struct, _LINUX_CAPABILITY_U32S_3> rights{};
  PLCHOST_TRY(check_errno(::syscall(SYS_capget, &header, rights.data()), "cannot read the capabilities"));
  for (std::size_t i = 0; i < rights.size(); ++i) each(rights[i], i);
  PLCHOST_TRY(check_errno(::syscall(SYS_capset, &header, rights.data()), "cannot give up capabilities"));
  return {};
}

Result<void> renounce(const Capabilities& given_up) {
  return change([&](__user_cap_data_struct& rights, std::size_t place) {
    rights.effective &= ~given_up.at(place);
    rights.permitted &= ~given_up.at(place);
    rights.inheritable &= ~given_up.at(place);
  });
}

Capabilities bits_of(std::initializer_list<unsigned> capabilities) {
  constexpr unsigned kBits = 32;
  Capabilities bits{};
  for (const unsigned one : capabilities) bits.at(one / kBits) |= std::uint32_t{1} << (one % kBits);
  return bits;
}

}  // namespace

Result<void> give_up_capabilities(std::initializer_list<unsigned> given_up) {
  return renounce(bits_of(given_up));
}

Result<void> keep_capabilities(std::initializer_list<unsigned> kept) {
  const Capabilities bits = bits_of(kept);
  return change([&](__user_cap_data_struct& rights, std::size_t place) {
    rights.permitted &= bits.at(place);
    rights.effective = rights.permitted;
    rights.inheritable = 0;
  });
}

Result<void> give_up_all_capabilities() {
  return renounce({UINT32_MAX, UINT32_MAX});
}

Result<void> refuse_new_rights() {
  PLCHOST_TRY(check_errno(::prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0), "cannot set no_new_privs"));
  return {};
}

bool never_gains_rights() noexcept {
  return ::prctl(PR_GET_NO_NEW_PRIVS, 0, 0, 0, 0) == 1;
}

}  // namespace plchost
