#include "api/cli/verbs/variable_sampler.hpp"

#include <algorithm>
#include <iterator>
#include <utility>

#include "api/dds/page_sample.hpp"
#include "api/recording/variable_recording.hpp"

namespace plchost {

Result<std::vector<ListedVariable>> VariableSampler::all() {
  VariableListing all;
  VariableQuery query = query_;
  for (bool goes_on = true; goes_on;) {
    PLCHOST_TRY_ASSIGN(
        auto page, session_.client().value()->list_variables(host_, instance_, query, session_.deadline()));
    PLCHOST_TRY_ASSIGN(goes_on, next_page(host_, page, query));
    std::ranges::move(page.variables, std::back_inserter(all.variables));
  }
  PLCHOST_TRY_ASSIGN(all, sample_in(std::move(all), instance_, query_));
  return std::move(all.variables);
}

Result<VariableListing> VariableSampler::sample(TimePoint until) {
  PLCHOST_TRY_ASSIGN(auto page, session_.client().value()->list_variables(
                                    host_, instance_, query_, std::min(session_.deadline(), until)));
  return sample_in(std::move(page), instance_, query_);
}

}  // namespace plchost
