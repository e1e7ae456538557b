// One task of each kind, and figures on request: the external event "report" logs them.
#include <array>
#include <atomic>
#include <csignal>
#include <thread>

#include "../../../../instances/plc_app.hpp"

namespace {

using namespace std::chrono_literals;

std::atomic<unsigned> ticks{0};
std::atomic<unsigned> edges{0};
std::atomic<unsigned> works{0};
std::atomic<unsigned> loops{0};
std::atomic<bool> variable{false};
std::atomic<const Task_Info*> fast_info{nullptr};

void fast() {
  constexpr unsigned kHalfPeriod = 25;  // 50 ms: slower than any poll of event variables in these tests
  fast_info = plc_current_task();
  if (++ticks % kHalfPeriod == 0) variable = !variable;
}

void report() {
  const Task_Info* const info = fast_info;
  plc::log("ticks %u edges %u works %u loops %u", ticks.load(), edges.load(), works.load(), loops.load());
  if (info != nullptr) {
    plc::log("%s max %d min %d jitter %d", static_cast<const char*>(info->stName), info->tMaxCycleTime,
             info->tMinCycleTime, info->tJitterMax);
  }
}

void loop() {
  ++loops;
  timespec pause{.tv_sec = 0, .tv_nsec = 2'000'000};
  ::nanosleep(&pause, nullptr);
}

void setup(plc::Application& app) {
  app.cyclic("Fast", 1, 2ms, fast);
  app.event("Edge", 2, [] { return variable.load(); }, [] { ++edges; });
  app.external("Work", 3, "work", [] { ++works; });
  app.external("Late", 4, "late", [] {}, plc::Registration::by_others);
  app.external("Report", 5, "report", report);
  app.external("Crash", 6, "crash", [] { std::thread([] { ::raise(SIGSEGV); }).join(); });
  app.external("Hang", 17, "hang", [] {
    plc::log("hangs");
    for (;;) ::nanosleep(std::array<timespec, 1>{timespec{.tv_sec = 1, .tv_nsec = 0}}.data(), nullptr);
  });
  app.task("Loop", 18, Freewheeling, loop);
  app.on_exit([] { plc::log("exit after %u works", works.load()); });
}

}  // namespace

PLC_APPLICATION("AllKinds", setup)
