#include "api/cli/verbs/variable_sampler.hpp"

#include <algorithm>
#include <iterator>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "api/dds/page_sample.hpp"

namespace plchost {

Result<std::vector<ListedVariable>> VariableSampler::all() {
  std::vector<ListedVariable> variables;
  VariableQuery query = query_;
  for (bool goes_on = true; goes_on;) {
    PLCHOST_TRY_ASSIGN(
        auto page, session_.client().value()->list_variables(host_, instance_, query, session_.deadline()));
    PLCHOST_TRY_ASSIGN(goes_on, next_page(host_, page, query));
    std::ranges::move(page.variables, std::back_inserter(variables));
  }
  return variables;
}

Result<VariableListing> VariableSampler::sample(TimePoint until) {
  PLCHOST_TRY_ASSIGN(auto page, session_.client().value()->list_variables(
                                    host_, instance_, query_, std::min(session_.deadline(), until)));
  PLCHOST_TRY(is_whole(page));
  if (page.variables.empty() && !query_.patterns.empty()) {
    return failure(ErrorCode::not_found, fmt::format("no variable of '{}' is like {}", instance_,
                                                     fmt::join(query_.patterns, ", ")));
  }
  return page;
}

}  // namespace plchost
