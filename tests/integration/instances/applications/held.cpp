// Tasks whose cycles can be held, in a loop that sleeps: by external events, or from the first cycle on by a
// cold start. PLC_HOLD_MS: for so long at most.
#include <atomic>
#include <chrono>
#include <cstdlib>
#include <ctime>

#include "../../../../instances/plc_app.hpp"

namespace {

using namespace std::chrono_literals;

std::atomic<bool> hold_output{false};
std::atomic<bool> hold_other{false};
std::atomic<bool> hold_variable{false};

void wait_while(const std::atomic<bool>& held) {
  if (const Task_Info* const task = held ? plc_current_task() : nullptr; task != nullptr)
    plc::log("%s is held", static_cast<const char*>(task->stName));
  static const char* const limit = std::getenv("PLC_HOLD_MS");
  const auto end = std::chrono::steady_clock::now() + (limit != nullptr ? std::atoi(limit) * 1ms : 24h);
  while (held && std::chrono::steady_clock::now() < end) {
    const timespec pause{.tv_sec = 0, .tv_nsec = 1'000'000};
    ::nanosleep(&pause, nullptr);
  }
}

void setup(plc::Application& app) {
  app.cyclic("Output", 2, 2ms, [] { wait_while(hold_output); });
  app.cyclic("Other", 3, 2ms, [] { wait_while(hold_other); });
  app.cyclic("Free", 4, 2ms, [] {});
  app.external("HoldOutput", 0, "hold_output", [] { hold_output = true; });
  app.external("HoldOther", 0, "hold_other", [] { hold_other = true; });
  app.external("HoldVariable", 0, "hold_variable", [] { hold_variable = true; });
  app.external("LetGo", 0, "let_go", [] { hold_output = hold_other = hold_variable = false; });
  app.external("LetOutputGo", 0, "let_output_go", [] { hold_output = false; });
  app.event("Edge", 5, [] { return wait_while(hold_variable), false; }, [] {});
  app.on_exit([] { plc::log("exit"); });
  hold_other = plc_start_kind() == PLC_START_COLD;
  hold_variable = std::getenv("PLC_HOLD_VARIABLE") != nullptr;
  plc::log("start kind %d", plc_start_kind());
}

}  // namespace

PLC_APPLICATION("Held", setup)
