#include "api/client/transition_log.hpp"

#include "api/dds/text.hpp"

namespace plchost {

std::vector<TransitionView> TransitionLog::take() {
  std::vector<TransitionView> news;
  if (!from_) return news;
  const TimePoint now = MonotonicClock::now();
  dds::take_valid_told<plc_Transition>(from_.reader.get(), writers_,
                                       [&](const plc_Transition& sample, const auto& /*info*/) {
                                         TransitionView view;
                                         if (!is_news(sample, now, view.missed)) return;
                                         view.sample = sample;
                                         view.sample.ext = {};  // lies on loan only
                                         news.push_back(view);
                                       });
  return news;
}

TransitionLog::Seen& TransitionLog::seen(const plc_Transition& sample) {
  return seen_[{std::string(dds::text_of(sample.host)), std::string(dds::text_of(sample.instance))}];
}

bool TransitionLog::is_news(const plc_Transition& sample, TimePoint now, std::uint64_t& missed) {
  Seen& before = seen(sample);
  if (!before.epoch.accept(sample.epoch, now)) return false;
  before.written = sample.sequence_number;
  // Not a greater one: the host's clock may have been set back.
  const bool first = sample.stream != before.stream;
  if (!first && sample.sequence_number <= before.last) return false;
  missed = first ? 0 : sample.sequence_number - before.last - 1;
  before.stream = sample.stream;
  before.last = sample.sequence_number;
  return true;
}

bool TransitionLog::has_all(const plc_InstanceStatus& status) const {
  if (status.transitions == 0) return true;
  const auto found =
      seen_.find({std::string(dds::text_of(status.host)), std::string(dds::text_of(status.instance))});
  return found != seen_.end() && found->second.epoch.value() == status.epoch &&
         found->second.written >= status.transitions;
}

}  // namespace plchost
