#pragma once

#include <cstddef>
#include <map>
#include <string>
#include <string_view>
#include <tuple>
#include <vector>

#include <gmock/gmock.h>

#include "manager/supervisor/instance_observer.hpp"

namespace plchost {

/// Notes what it is told. A step that the table of phases has not fails the test, unless the test takes
/// it out of `wrong`.
class FakeObserver : public InstanceObserver {
 public:
  FakeObserver() = default;
  FakeObserver(const FakeObserver&) = delete;
  FakeObserver& operator=(const FakeObserver&) = delete;
  ~FakeObserver() override { EXPECT_THAT(wrong, testing::IsEmpty()) << "steps that no table has"; }

  void changed(std::size_t place, const InstanceStatus& status) override { shown[place] = status; }
  void transition(const InstanceStatus& /*status*/, InstanceState from, InstanceState to,
                  std::string_view reason) override {
    transitions.emplace_back(from, to, reason);
  }
  void wrong_step(const InstanceStatus& /*status*/, std::string_view what) override {
    wrong.emplace_back(what);
  }
  void gone(std::size_t place, const InstanceConfig& config) override { ended[place] = config.name; }

  std::vector<std::string> wrong;
  std::map<std::size_t, InstanceStatus> shown;
  std::map<std::size_t, std::string> ended;
  std::vector<std::tuple<InstanceState, InstanceState, std::string>> transitions;
};

}  // namespace plchost
