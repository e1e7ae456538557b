// An application whose set-up does not return and takes the processor by a real-time priority: by a thread of
// its own that it waits for, or by itself.

#include <atomic>
#include <chrono>
#include <csignal>

#include <pthread.h>
#include <sched.h>

#include "instances/plc_app.hpp"

namespace {

std::atomic<bool> always{true};

void* loop(void* name) {
#ifdef BLOCKS_SIGNALS
  sigset_t all;
  sigfillset(&all);
  pthread_sigmask(SIG_BLOCK, &all, nullptr);
#endif
  const sched_param priority{.sched_priority = 60};
  pthread_setschedparam(pthread_self(), SCHED_FIFO, &priority);
  if (name != nullptr) pthread_setname_np(pthread_self(), static_cast<const char*>(name));
  while (always) continue;
  return nullptr;
}

void setup(plc::Application& app) {
  app.cyclic("Main", 5, std::chrono::milliseconds(10), [] {});
#ifdef BY_A_THREAD
  static char name[] = "hog";
  pthread_t thread{};
  pthread_create(&thread, nullptr, &loop, name);
  pthread_join(thread, nullptr);
#else
  loop(nullptr);
#endif
}

}  // namespace

PLC_APPLICATION("SetupTaker", setup)
