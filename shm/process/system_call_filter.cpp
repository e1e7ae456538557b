#include "shm/process/system_call_filter.hpp"

#include <cstddef>
#include <vector>

#include <fmt/format.h>
#include <linux/audit.h>
#include <linux/filter.h>
#include <linux/seccomp.h>
#include <sys/syscall.h>
#include <unistd.h>

#include "shm/base/system_call.hpp"

// The program for the kernel is written here: libseccomp would be a dependency of each instance.

namespace plchost {

namespace {

#if defined(__x86_64__)
constexpr std::uint32_t kOwnAbi = AUDIT_ARCH_X86_64;
#elif defined(__aarch64__)
constexpr std::uint32_t kOwnAbi = AUDIT_ARCH_AARCH64;
#else
#error "Name the ABI of this processor: an AUDIT_ARCH of <linux/audit.h>."
#endif
// x32 has the ABI of x86-64, and numbers from here on. Nobody else has numbers so large.
constexpr std::uint32_t kFirstOfX32 = 0x40000000;
// Written over the number by a tracer that skips a call.
constexpr std::uint32_t kSkipped = UINT32_MAX;

constexpr sock_filter load(std::size_t offset) {
  return {.code = BPF_LD | BPF_W | BPF_ABS, .jt = 0, .jf = 0, .k = static_cast<std::uint32_t>(offset)};
}

/// Skips so many instructions if the loaded word passes the test, and so many if not.
constexpr sock_filter skip(std::uint16_t test, std::uint32_t operand, std::uint8_t passed,
                           std::uint8_t failed) {
  return {
      .code = static_cast<std::uint16_t>(BPF_JMP | BPF_K | test), .jt = passed, .jf = failed, .k = operand};
}

constexpr sock_filter give(std::uint32_t action) {
  return {.code = BPF_RET | BPF_K, .jt = 0, .jf = 0, .k = action};
}

constexpr sock_filter fail(int error) {
  return give(SECCOMP_RET_ERRNO | static_cast<std::uint32_t>(error));
}

// Calls without a row get the same answer whatever their arguments are. The kernel (5.11 and newer) finds
// that out when it takes the program, and does not run it for them.
std::vector<sock_filter> program_for(std::span<const RefusedCall> calls) {
  std::vector<sock_filter> program = {load(offsetof(seccomp_data, arch)),
                                      skip(BPF_JEQ, kOwnAbi, 1, 0),
                                      fail(EPERM),
                                      load(offsetof(seccomp_data, nr)),
                                      skip(BPF_JEQ, kSkipped, 0, 1),
                                      give(SECCOMP_RET_ALLOW),
                                      skip(BPF_JGE, kFirstOfX32, 0, 1),
                                      fail(EPERM)};
  for (const RefusedCall& call : calls) {
    if (call.flags == 0) {
      program.push_back(skip(BPF_JEQ, call.number, 0, 1));
    } else {
      program.push_back(skip(BPF_JEQ, call.number, 0, 4));
      program.push_back(load(offsetof(seccomp_data, args)));  // its lower half: both processors begin with it
      program.push_back(skip(BPF_JSET, call.flags, 1, 0));
      program.push_back(give(SECCOMP_RET_ALLOW));
    }
    program.push_back(fail(call.error));
  }
  program.push_back(give(SECCOMP_RET_ALLOW));
  return program;
}

Result<void> set_filter(std::span<const RefusedCall> calls, unsigned long log) {
  auto program = program_for(calls);
  const sock_fprog filter{.len = static_cast<unsigned short>(program.size()), .filter = program.data()};
  // The last: kernels before 5.16 would slow down each thread against attacks by speculation.
  const unsigned long flags = log | SECCOMP_FILTER_FLAG_TSYNC | SECCOMP_FILTER_FLAG_SPEC_ALLOW;
  PLCHOST_TRY_ASSIGN(const long thread,
                     check_errno(::syscall(SYS_seccomp, SECCOMP_SET_MODE_FILTER, flags, &filter),
                                 "cannot set a filter of system calls (seccomp)"));
  if (thread == 0) return {};
  return failure(
      ErrorCode::refused,
      fmt::format("cannot set a filter of system calls (seccomp): thread {} has one of its own", thread));
}

}  // namespace

Result<void> refuse_system_calls(std::span<const RefusedCall> calls) {
  std::vector<RefusedCall> refused;
  std::vector<RefusedCall> missing;
  for (const RefusedCall& call : calls) (call.error == EPERM ? refused : missing).push_back(call);
  PLCHOST_TRY(set_filter(refused, SECCOMP_FILTER_FLAG_LOG));
  if (missing.empty()) return {};
  return set_filter(missing, 0);
}

}  // namespace plchost
