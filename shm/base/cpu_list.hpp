#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace plchost {

/// The largest core number that a list or mask may name: the kernel's own bound.
inline constexpr int kMaxCoreNumber = 8191;

/// The kernel's form of a set of cores, "0-3,8": sorted, each once. Empty text: no core. Nothing: not such a
/// list.
[[nodiscard]] std::optional<std::vector<int>> parse_cpu_list(std::string_view text);

/// The kernel's other form, "ff,00000003": hexadecimal words of 32 cores, the highest first.
[[nodiscard]] std::optional<std::vector<int>> parse_cpu_mask(std::string_view text);

/// Back to the first form.
[[nodiscard]] std::string format_cpu_list(const std::vector<int>& sorted);
/// Back to the other form.
[[nodiscard]] std::string format_cpu_mask(const std::vector<int>& sorted);

/// Sorted, each once.
[[nodiscard]] std::vector<int> each_once(std::vector<int> cores);

/// The cores in both, and those only in the first; sorted in, sorted out.
[[nodiscard]] std::vector<int> common_cores(const std::vector<int>& a, const std::vector<int>& b);
[[nodiscard]] std::vector<int> cores_without(const std::vector<int>& a, const std::vector<int>& b);

}  // namespace plchost
