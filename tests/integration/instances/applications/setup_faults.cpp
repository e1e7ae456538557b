// A program of the C++ layer with one fault in its setup function, chosen when it is compiled.
#include "../../../../instances/plc_app.hpp"

using namespace std::chrono_literals;

static void setup(plc::Application& app) {
#ifdef FAULT_EMPTY_CYCLE
  const plc::Application::Cycle nothing;
  app.cyclic("Fill", 1, 10ms, nothing);
#endif
#ifdef FAULT_EMPTY_VARIABLE
  app.event("Cap", 1, {}, [] {});
#endif
#ifdef FAULT_TWO_AREAS
  app.cyclic("Fill", 1, 10ms, [] {});
  (void)app.area<int>("level", PLC_AREA_DATA);
  (void)app.area<int>("level", PLC_AREA_DATA);
#endif
  (void)app;
}
PLC_APPLICATION("Faulty", setup)
