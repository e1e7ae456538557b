// The time that applications see: see plc_app.h.

#include "instances/runtime/time/system_time.hpp"

RTS_RESULT SysTimeGetUs(RTS_SYSTIME* pTime) {
  return plchost::system_time_us(pTime);
}

RTS_RESULT SysTimeGetNs(RTS_SYSTIME* pTime) {
  return plchost::system_time_ns(pTime);
}

unsigned int SysTimeGetMs() {
  constexpr RTS_SYSTIME kNsPerMs = 1'000'000;
  RTS_SYSTIME ns = 0;
  (void)plchost::system_time_ns(&ns);
  return static_cast<unsigned int>(ns / kNsPerMs);
}
