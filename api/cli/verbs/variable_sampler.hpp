#pragma once

#include <string>
#include <vector>

#include "api/cli/cli_session.hpp"
#include "api/dds/variable_page.hpp"

namespace plchost {

/// The variables of one instance, asked for again and again.
class VariableSampler {
 public:
  VariableSampler(CliSession& session, std::string host, std::string instance, VariableQuery query)
      : session_(session), host_(std::move(host)), instance_(std::move(instance)), query_(std::move(query)) {}

  [[nodiscard]] const std::string& host() const noexcept { return host_; }
  [[nodiscard]] const std::string& instance() const noexcept { return instance_; }

  /// All of them, page by page: the values of each page are of one moment. not_found: no name is like these.
  [[nodiscard]] Result<std::vector<ListedVariable>> all();
  /// All of them, with their values of one moment. full: they are more than one page holds.
  /// It is waited for until then at most.
  [[nodiscard]] Result<VariableListing> sample(TimePoint until = TimePoint::max());

 private:
  CliSession& session_;
  std::string host_;
  std::string instance_;
  VariableQuery query_;
};

/// For the help of arguments.
inline constexpr const char* kVariableNames =
    "names, as 'Line.speed', 'Grid[1,2]' or 'Grid[*,*]'; '*' any characters, '?' one; case does not count";

}  // namespace plchost
