// An application whose first process makes a thread above all others, which blocks all signals and never
// ends.

#include <atomic>
#include <csignal>

#include <pthread.h>
#include <sched.h>

#include "instances/plc_app.hpp"

namespace {

std::atomic<bool> always{true};

void* loop(void*) {
  const sched_param highest{.sched_priority = 99};
  pthread_setschedparam(pthread_self(), SCHED_FIFO, &highest);
  while (always) continue;
  return nullptr;
}

void take_the_processor() {
  sigset_t all;
  sigset_t before;
  sigfillset(&all);
  pthread_sigmask(SIG_SETMASK, &all, &before);
  pthread_t thread{};
  pthread_create(&thread, nullptr, &loop, nullptr);
  pthread_sigmask(SIG_SETMASK, &before, nullptr);
}

void setup(plc::Application& app) {
  using namespace std::chrono_literals;
  static int cycles = 0;
  app.cyclic("Main", 5, 10ms, [] {
    if (++cycles == 20 && plc_start_kind() == PLC_START_FIRST) take_the_processor();
  });
}

}  // namespace

PLC_APPLICATION("ProcessorTaker", setup)
