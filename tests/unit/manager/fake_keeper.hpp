#pragma once

#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "manager/store/application_keeper.hpp"

namespace plchost {

/// The kept applications of one instance, in the hands of a test.
class FakeKeeper : public ApplicationKeeper {
 public:
  struct Kept {
    ApplicationOrder order;
    std::string name;
    Loaded loaded;
    LaunchOptions launch;
  };

  [[nodiscard]] Result<void> keep(const ApplicationOrder& order, const std::string& name,
                                  const Loaded& loaded, const LaunchOptions& launch, Done done) override {
    if (!can_start) return failure(ErrorCode::system, "start the helper");
    kept.push_back({order, name, loaded, launch});
    done_ = std::move(done);
    return {};
  }
  [[nodiscard]] Result<void> set_boot(const std::string& path, const std::string& /*configured*/,
                                      Done done) override {
    if (!can_start) return failure(ErrorCode::system, "start the helper");
    booted.push_back(path);
    done_ = std::move(done);
    return {};
  }
  [[nodiscard]] std::string boot() override { return boot_path; }
  [[nodiscard]] std::optional<ApplicationVersion> version_at(const std::string& path) override {
    const auto found = versions.find(path);
    return found == versions.end() ? std::nullopt : std::optional(found->second);
  }

  /// The helper ends.
  void end(const Result<std::string>& path) { std::exchange(done_, nullptr)(path); }
  [[nodiscard]] bool works() const { return static_cast<bool>(done_); }

  std::vector<Kept> kept;
  std::vector<std::string> booted;
  std::string boot_path;
  std::map<std::string, ApplicationVersion> versions;
  bool can_start = true;

 private:
  Done done_;
};

}  // namespace plchost
