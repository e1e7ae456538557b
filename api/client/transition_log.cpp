#include "api/client/transition_log.hpp"

#include "api/dds/samples.hpp"
#include "api/dds/text.hpp"

namespace plchost {

std::vector<TransitionView> TransitionLog::take() {
  std::vector<TransitionView> news;
  if (!reader_) return news;
  dds::take_valid<plc_Transition>(reader_.get(), [&](const plc_Transition& sample, const auto& /*info*/) {
    TransitionView view;
    if (!is_news(sample, view.missed)) return;
    view.sample = sample;
    view.sample.ext = {};  // lives on loan only
    news.push_back(view);
  });
  return news;
}

bool TransitionLog::is_news(const plc_Transition& sample, std::uint64_t& missed) {
  Seen& seen = seen_[{std::string(dds::text_of(sample.host)), std::string(dds::text_of(sample.instance))}];
  if (sample.stream < seen.stream) return false;
  const bool first = sample.stream > seen.stream;
  if (!first && sample.sequence_number <= seen.last) return false;
  missed = first ? 0 : sample.sequence_number - seen.last - 1;
  seen = {.stream = sample.stream, .last = sample.sequence_number};
  return true;
}

}  // namespace plchost
