#include "tests/models/checker/model.hpp"

#include <array>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <span>
#include <string>
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

enum class Way : std::uint8_t { by_chance, first_ones, all };

// One scene, by so many executions. The fault; empty: there is none.
std::string run_scene(const NamedScene& scene, Way way, std::uint64_t executions) {
  const auto begin = std::chrono::steady_clock::now();
  Explorer search(scene.set_up);
  const Report report = way == Way::by_chance ? search.walk(executions) : search.explore(executions);
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - begin;
  std::printf("%s: %llu executions%s, %llu states, at most %u decisions, %.1f s: %s\n", scene.name,
              static_cast<unsigned long long>(report.executions), way == Way::by_chance ? " by chance" : "",
              static_cast<unsigned long long>(report.states), report.longest, took.count(),
              !report.fault.empty() ? report.fault.c_str()
              : way == Way::all     ? "sound"
                                    : "no fault");
  if (report.cut > 0)
    std::printf("    %llu executions were cut\n", static_cast<unsigned long long>(report.cut));
  for (const std::string& step : report.trace) std::printf("    %s\n", step.c_str());
  std::fflush(stdout);
  return report.fault;
}

struct Stage {
  Way way;
  std::uint64_t executions;
};
constexpr std::uint64_t kAll = ~std::uint64_t{0};
constexpr std::array<Stage, 1> kProof{{{Way::all, kAll}}};
// A fault that is there is mostly found in seconds: by chance, or as one of the first of a small scene.
constexpr std::array<Stage, 4> kSearch{
    {{Way::by_chance, 1'000}, {Way::first_ones, 5'000}, {Way::by_chance, 50'000}, {Way::all, kAll}}};

}  // namespace

int run(int argc, char** argv, std::initializer_list<NamedScene> scenes) {
  // With --catches TEXT a fault that has this text must be found. Another fault is none: it was not planted.
  bool catches = false;
  std::string_view wanted;
  std::string_view only;
  for (int i = 1; i < argc; ++i) {
    if (std::string_view(argv[i]) == "--catches" && i + 1 < argc) {
      catches = true;
      wanted = argv[++i];
    } else
      only = argv[i];
  }
  bool faulty = false;
  for (const Stage& stage : catches ? std::span<const Stage>(kSearch) : std::span<const Stage>(kProof)) {
    for (const NamedScene& scene : scenes) {
      if (faulty && catches) break;
      if (!only.empty() && only != scene.name) continue;
      const std::string fault = run_scene(scene, stage.way, stage.executions);
      faulty = faulty || (!fault.empty() && fault.find(wanted) != std::string::npos);
    }
  }
  if (catches && !faulty)
    std::printf("no fault \"%.*s\" was found\n", static_cast<int>(wanted.size()), wanted.data());
  return faulty == catches ? 0 : 1;
}

}  // namespace plchost::models
