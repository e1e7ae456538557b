// Tasks with options of their own, and the clock of applications on request.
#include "../../../../instances/plc_app.hpp"

namespace {

using namespace std::chrono_literals;

void report() {
  RTS_SYSTIME us = 0;
  RTS_SYSTIME ns = 0;
  SysTimeGetUs(&us);
  SysTimeGetNs(&ns);
  plc::log("time us %lu ns %lu ms %u", us, ns, SysTimeGetMs());
}

void setup(plc::Application& app) {
  app.cyclic("Fast", 1, 2ms, [] {});
  app.cyclic("Moved", 2, 8ms, [] {});
  app.cyclic("Late", 3, 4ms, [] {
    static int cycles = 0;
    timespec pause{.tv_sec = 0, .tv_nsec = 6'000'000};
    if (++cycles % 5 == 0) ::nanosleep(&pause, nullptr);
  });
  app.external("Report", 5, "report", report);
  plc::TaskOptions moved;
  moved.start_offset = 3ms;
  app.options("Moved", moved);
  const std::string name(plc::instance_name());
  const std::string speed(plc::parameter("speed").value_or("not set"));
  plc::log("instance %s, speed %s, empty is %s", name.c_str(), speed.c_str(),
           plc::parameter("empty") == std::string_view() ? "set" : "not set");
}

}  // namespace

PLC_APPLICATION("Optioned", setup)
