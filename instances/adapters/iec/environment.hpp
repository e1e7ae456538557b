#pragma once

#include <cstdlib>
#include <filesystem>
#include <ranges>
#include <string>
#include <vector>

namespace plchost::iec {

/// A variable of the environment; empty: it is not set.
inline std::string environment(const char* name) {
  const char* const value = std::getenv(name);  // NOLINT(concurrency-mt-unsafe): plcctl has one thread here
  return value == nullptr ? "" : value;
}

/// Where a program of that name may lie, by PATH.
inline std::vector<std::filesystem::path> in_path(const std::string& program) {
  std::vector<std::filesystem::path> result;
  const std::string path = environment("PATH");
  for (const auto part : std::views::split(path, ':'))
    result.push_back(std::filesystem::path(std::string(part.begin(), part.end())) / program);
  return result;
}

}  // namespace plchost::iec
