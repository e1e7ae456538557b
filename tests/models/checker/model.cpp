#include "tests/models/checker/model.hpp"

#include <chrono>
#include <cstdio>
#include <string_view>

#include "tests/models/checker/explorer.hpp"

namespace plchost::models {

void* Explorer::memory(std::size_t size, std::size_t alignment) {
  return Arena::take(size, alignment);
}

void require(bool holds, const char* what) {
  if (holds) return;
  const Arena::Use off(false);
  explorer()->fail(what);
}

void observe(unsigned outcome) {
  explorer()->observe(outcome);
}

bool was_killed(ThreadNumber thread) {
  return explorer()->killed(thread);
}

int run(int argc, char** argv, std::initializer_list<NamedScene> scenes) {
  bool catches = false;
  std::string_view only;
  for (int i = 1; i < argc; ++i) {
    if (std::string_view(argv[i]) == "--catches")
      catches = true;
    else
      only = argv[i];
  }
  bool faulty = false;
  for (const NamedScene& scene : scenes) {
    if (!only.empty() && only != scene.name) continue;
    const auto begin = std::chrono::steady_clock::now();
    const Report report = Explorer(scene.set_up).explore();
    const std::chrono::duration<double> took = std::chrono::steady_clock::now() - begin;
    std::printf("%s: %llu executions, %llu states, at most %u decisions, %.1f s: %s\n", scene.name,
                static_cast<unsigned long long>(report.executions),
                static_cast<unsigned long long>(report.states), report.longest, took.count(),
                report.fault.empty() ? "sound" : report.fault.c_str());
    if (report.cut > 0)
      std::printf("    %llu executions were cut\n", static_cast<unsigned long long>(report.cut));
    for (const std::string& step : report.trace) std::printf("    %s\n", step.c_str());
    std::fflush(stdout);
    faulty = faulty || !report.fault.empty();
    if (catches && faulty) break;
  }
  if (catches && !faulty) std::puts("the fault was not found");
  return faulty == catches ? 0 : 1;
}

}  // namespace plchost::models
