#pragma once

#include <cstddef>
#include <map>
#include <string>
#include <string_view>
#include <tuple>
#include <utility>
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
  void stepped(const InstanceStatus& status, InstancePhase from, InstancePhase to) override {
    if (from != to) steps.emplace_back(from, to);
    if (std::string what = wrong_step(from, to, status.state); !what.empty())
      wrong.push_back(std::move(what));
  }
  void gone(std::size_t place, const InstanceConfig& config) override { ended[place] = config.name; }

  std::vector<std::string> wrong;
  std::vector<std::pair<InstancePhase, InstancePhase>> steps;
  std::map<std::size_t, InstanceStatus> shown;
  std::map<std::size_t, std::string> ended;
  std::vector<std::tuple<InstanceState, InstanceState, std::string>> transitions;
};

}  // namespace plchost
