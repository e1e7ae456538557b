#include "manager/system/oom_score.hpp"

#include <algorithm>
#include <fstream>

#include <fmt/format.h>

#include "shm/files/kernel_file.hpp"

namespace plchost {

namespace {

constexpr const char* kOomScore = "/proc/self/oom_score_adj";

bool write_score(int score) {
  return write_kernel_file(kOomScore, fmt::format("{}", score)).has_value();
}

}  // namespace

bool take_oom_score(int lowest, int own) noexcept {
  int before = 0;
  std::ifstream(kOomScore) >> before;
  // The kernel remembers the lowest score that a right allowed; a higher one needs none and forgets nothing.
  return write_score(lowest) && write_score(std::max(before, own));
}

}  // namespace plchost
