#include "instances/runtime/setup/sandbox.hpp"

#include <array>
#include <cerrno>
#include <string_view>

#include <fmt/format.h>
#include <sched.h>
#include <sys/syscall.h>

#include "shm/base/transient.hpp"

namespace plchost {

namespace {

// The symbolizer of a sanitizer is a program that it starts, and its search for leaks looks at the process
// from outside. So builds for tests leave both out.
#if defined(PLCHOST_ADDRESS_SANITIZER) || defined(PLCHOST_THREAD_SANITIZER)
constexpr std::array<RefusedCall, 0> kOfSanitizers{};
constexpr std::string_view kExceptions = ", but for those of the sanitizer of this build";
#else
constexpr std::array kOfSanitizers = {
    // Programs.
    RefusedCall{SYS_execve, "execve"},
    RefusedCall{SYS_execveat, "execveat"},
    // The memory of other processes. Not process_vm_readv: a fault in a task reads its own stack by it.
    RefusedCall{SYS_ptrace, "ptrace"},
    RefusedCall{SYS_process_vm_writev, "process_vm_writev"},
};
constexpr std::string_view kExceptions;
#endif

constexpr std::uint32_t kNamespaces =
    CLONE_NEWNS | CLONE_NEWCGROUP | CLONE_NEWUTS | CLONE_NEWIPC | CLONE_NEWUSER | CLONE_NEWPID | CLONE_NEWNET;
constexpr std::uint32_t kTimeNamespace = 0x80;  // CLONE_NEWTIME: to clone() a part of a signal's number

// As the table in instances/settings.md.
constexpr std::array kOthers = {
    // The descriptors of other processes.
    RefusedCall{SYS_pidfd_getfd, "pidfd_getfd"},
    // Code of the kernel.
    RefusedCall{SYS_init_module, "init_module"},
    RefusedCall{SYS_finit_module, "finit_module"},
    RefusedCall{SYS_delete_module, "delete_module"},
    RefusedCall{SYS_kexec_load, "kexec_load"},
    RefusedCall{SYS_kexec_file_load, "kexec_file_load"},
    RefusedCall{SYS_bpf, "bpf"},
    // Parts of the kernel that attacks use most.
    RefusedCall{SYS_perf_event_open, "perf_event_open"},
    RefusedCall{SYS_userfaultfd, "userfaultfd"},
    RefusedCall{SYS_keyctl, "keyctl"},
    RefusedCall{SYS_add_key, "add_key"},
    RefusedCall{SYS_request_key, "request_key"},
    // A way round the filter: the kernel carries out what is asked for in a ring without a system call.
    RefusedCall{SYS_io_uring_setup, "io_uring_setup"},
    // Another view of files, processes and networks. The C library makes threads by clone() where the kernel
    // has no clone3(), whose flags lie in memory that no filter sees.
    RefusedCall{SYS_unshare, "unshare", kNamespaces | kTimeNamespace},
    RefusedCall{SYS_setns, "setns"},
    RefusedCall{SYS_clone, "clone", kNamespaces},
    RefusedCall{SYS_clone3, "clone3", 0, ENOSYS},
    RefusedCall{SYS_mount, "mount"},
    RefusedCall{SYS_umount2, "umount2"},
    RefusedCall{SYS_pivot_root, "pivot_root"},
    RefusedCall{SYS_chroot, "chroot"},
    RefusedCall{SYS_open_tree, "open_tree"},
    RefusedCall{SYS_move_mount, "move_mount"},
    RefusedCall{SYS_mount_setattr, "mount_setattr"},
    RefusedCall{SYS_fsopen, "fsopen"},
    RefusedCall{SYS_fsconfig, "fsconfig"},
    RefusedCall{SYS_fsmount, "fsmount"},
    RefusedCall{SYS_fspick, "fspick"},
    // The host as a whole.
    RefusedCall{SYS_reboot, "reboot"},
    RefusedCall{SYS_swapon, "swapon"},
    RefusedCall{SYS_swapoff, "swapoff"},
    RefusedCall{SYS_acct, "acct"},
    RefusedCall{SYS_quotactl, "quotactl"},
    RefusedCall{SYS_sethostname, "sethostname"},
    RefusedCall{SYS_setdomainname, "setdomainname"},
    // Another user.
    RefusedCall{SYS_setuid, "setuid"},
    RefusedCall{SYS_setgid, "setgid"},
    RefusedCall{SYS_setreuid, "setreuid"},
    RefusedCall{SYS_setregid, "setregid"},
    RefusedCall{SYS_setresuid, "setresuid"},
    RefusedCall{SYS_setresgid, "setresgid"},
    RefusedCall{SYS_setgroups, "setgroups"},
    RefusedCall{SYS_setfsuid, "setfsuid"},
    RefusedCall{SYS_setfsgid, "setfsgid"},
};

constexpr auto kToLoad = [] {
  std::array<RefusedCall, kOfSanitizers.size() + kOthers.size()> all{};
  std::size_t count = 0;
  for (const RefusedCall& call : kOfSanitizers) all[count++] = call;
  for (const RefusedCall& call : kOthers) all[count++] = call;
  return all;
}();

constexpr std::array kToStart = {RefusedCall{SYS_socket, "socket"},
                                 RefusedCall{SYS_socketpair, "socketpair"}};

}  // namespace

std::span<const RefusedCall> calls_refused_to_load() noexcept {
  return kToLoad;
}

std::span<const RefusedCall> calls_refused_to_start() noexcept {
  return kToStart;
}

Result<Confinement> confine_to_load(Seccomp wanted) {
  if (wanted == Seccomp::off) return {};
  const auto done = refuse_system_calls(kToLoad);
  // A start that is repeated after a shortage has its filter.
  const bool must_hold = wanted != Seccomp::no_exec || (!done && is_transient(done.error()));
  if (!done && must_hold) return failure_in("[Sandbox] Seccomp", done.error());
  if (!done) return Confinement{.holds = {}, .remark = done.error().describe()};
  return Confinement{.holds = fmt::format("seccomp: no programs, no changes of the host{}", kExceptions),
                     .remark = {}};
}

Result<Confinement> confine_to_start(Seccomp wanted) {
  if (wanted != Seccomp::no_sockets) return {};
  PLCHOST_TRY(in_step("[Sandbox] Seccomp", refuse_system_calls(kToStart)));
  return Confinement{.holds = "seccomp: no new sockets", .remark = {}};
}

}  // namespace plchost
