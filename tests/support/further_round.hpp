#pragma once

#include <string_view>

#include <fmt/format.h>
#include <gtest/gtest.h>

namespace plchost {

/// Says that the running test needs another of its rounds, and why. tests/suite.py prints it again at the end
/// of the run. The run fails if tests/retries.txt does not have the test under `rounds`.
inline void say_further_round(std::string_view why) {
  const auto* const test = testing::UnitTest::GetInstance()->current_test_info();
  fmt::print("further round: {}.{}: {}\n", test->test_suite_name(), test->name(), why);
}

}  // namespace plchost
