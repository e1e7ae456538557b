#include "api/client/transition_log.hpp"

#include "api/dds/samples.hpp"
#include "api/dds/text.hpp"

namespace plchost {

std::vector<TransitionView> TransitionLog::take() {
  std::vector<TransitionView> news;
  for (bool more = static_cast<bool>(reader_); more;) {
    const dds::Samples<plc_Transition> batch(reader_.get());
    for (std::size_t i = 0; i < batch.size(); ++i) {
      TransitionView view;
      if (!batch.valid(i) || !is_news(batch[i], view.missed)) continue;
      view.sample = batch[i];
      view.sample.ext = {};  // lives on loan only
      news.push_back(view);
    }
    more = batch.full();
  }
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
