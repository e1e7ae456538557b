#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "api/control/host_finding.hpp"

namespace plchost {

/// Puts the parts together in which the manager tells what it found at the host.
class FindingsCollector {
 public:
  /// Takes the text of a reply. Returns the argument for the next request; nothing: complete. corrupt: not
  /// such a part; busy: others have had the host checked again and again meanwhile.
  [[nodiscard]] Result<std::optional<std::string>> add(std::string_view text);
  [[nodiscard]] const std::vector<HostFinding>& findings() const noexcept { return findings_; }

  static constexpr int kMaxRestarts = 8;

 private:
  std::uint64_t check_ = 0;
  int restarts_ = 0;
  std::vector<HostFinding> findings_;
};

}  // namespace plchost
