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

namespace {

// One scene: how often it was run, and the fault.
bool run_scene(const NamedScene& scene, std::uint64_t walks) {
  const auto begin = std::chrono::steady_clock::now();
  Explorer search(scene.set_up);
  const Report report = walks > 0 ? search.walk(walks) : search.explore();
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - begin;
  std::printf("%s: %llu executions%s, %llu states, at most %u decisions, %.1f s: %s\n", scene.name,
              static_cast<unsigned long long>(report.executions), walks > 0 ? " by chance" : "",
              static_cast<unsigned long long>(report.states), report.longest, took.count(),
              !report.fault.empty() ? report.fault.c_str()
              : walks > 0           ? "no fault"
                                    : "sound");
  if (report.cut > 0)
    std::printf("    %llu executions were cut\n", static_cast<unsigned long long>(report.cut));
  for (const std::string& step : report.trace) std::printf("    %s\n", step.c_str());
  std::fflush(stdout);
  return !report.fault.empty();
}

}  // namespace

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
  // By chance first: a fault that is there is mostly found in seconds.
  constexpr std::uint64_t kWalks = 50'000;
  for (const std::uint64_t walks : {catches ? kWalks : 0, std::uint64_t{0}}) {
    for (const NamedScene& scene : scenes) {
      if (faulty && catches) break;
      if (only.empty() || only == scene.name) faulty = run_scene(scene, walks) || faulty;
    }
    if (!catches) break;
  }
  if (catches && !faulty) std::puts("the fault was not found");
  return faulty == catches ? 0 : 1;
}

}  // namespace plchost::models
