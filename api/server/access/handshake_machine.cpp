// Cyclone 0.10.2 ends its process when the handshake with a participant times out as a whole (100 s) while
// that participant goes. The timer is then taken off the heap twice ("Fix crash caused by security
// overall timeout race", Cyclone 0.11). Anybody can cause that without a key. So in
// plchost-dds no handshake times out as a whole: its steps are repeated each second as before, and a
// participant that falls silent goes by its lease.
#include <cstdint>

#include <dlfcn.h>

// A program's own function goes before that of a library that calls it by name, as Cyclone does.
extern "C" __attribute__((visibility("default"))) void dds_security_fsm_set_timeout(
    void* /*state_machine*/, void (* /*action*/)(void*, void*), std::int64_t /*timeout*/) {}

// Cyclone 0.10.2 to 0.10.5 tells the state machine of a handshake that the keys of the other side have come
// when it registers that side, so before. The host then waits for nothing after its final message and ends
// the handshake 100 ms later. If that message is lost, the client repeats its reply for ever and gets no
// answer. Fast DDS loses it when Cyclone packs it behind encrypted messages for others: it drops the rest of
// such a datagram. Without that event the host repeats the final message until the keys have really come.
extern "C" __attribute__((visibility("default"))) void dds_security_fsm_dispatch(void* state_machine,
                                                                                 std::int32_t event,
                                                                                 bool before_others) {
  constexpr std::int32_t kKeysHaveCome = 104;
  // Only the thread of the state machines puts events before others. It registers, but receives nothing.
  static thread_local bool is_of_state_machines = false;
  is_of_state_machines |= before_others;
  if (event == kKeysHaveCome && is_of_state_machines) return;
  using Dispatch = void (*)(void*, std::int32_t, bool);
  static const auto dispatch = reinterpret_cast<Dispatch>(::dlsym(RTLD_NEXT, "dds_security_fsm_dispatch"));
  dispatch(state_machine, event, before_others);
}
