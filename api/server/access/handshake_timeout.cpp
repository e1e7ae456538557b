// Cyclone 0.10.2 ends its process when the handshake with a participant times out as a whole (100 s) while
// that participant goes: its timer is taken off the heap, and then once more ("Fix crash caused by security
// overall timeout race", Cyclone 0.11). Anybody can bring that about who has no key and is patient. So in
// plchost-dds no handshake times out as a whole: its steps are repeated each second as before, and a
// participant that falls silent goes by its lease.
#include <cstdint>

// A program's own function goes before that of a library that calls it by name, as Cyclone does.
extern "C" __attribute__((visibility("default"))) void dds_security_fsm_set_timeout(
    void* /*state_machine*/, void (* /*action*/)(void*, void*), std::int64_t /*timeout*/) {}
