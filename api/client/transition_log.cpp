#include "api/client/transition_log.hpp"

#include <charconv>
#include <optional>
#include <span>

#include "api/dds/text.hpp"
#include "api/dds/topics.hpp"

namespace plchost {

namespace {

// As its host tells; nothing: it does not tell.
std::optional<std::uint64_t> last_number(const plc_InstanceStatus& status) {
  for (const plc_KeyValue& entry : std::span(status.ext._buffer, status.ext._length)) {
    if (dds::text_of(entry.name) != dds::kTransitionsEntry) continue;
    const std::string_view text = dds::text_of(entry.value);
    std::uint64_t number = 0;
    const auto read = std::from_chars(text.data(), text.data() + text.size(), number);
    if (read.ec == std::errc() && read.ptr == text.data() + text.size()) return number;
  }
  return std::nullopt;
}

}  // namespace

std::vector<TransitionView> TransitionLog::take() {
  std::vector<TransitionView> news;
  if (!reader_) return news;
  const TimePoint now = MonotonicClock::now();
  dds::take_valid_told<plc_Transition>(reader_.get(), writers_,
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
  const auto told = last_number(status);
  if (!told || *told == 0) return told.has_value();
  const auto found =
      seen_.find({std::string(dds::text_of(status.host)), std::string(dds::text_of(status.instance))});
  return found != seen_.end() && found->second.epoch.value() == status.epoch &&
         found->second.written >= *told;
}

}  // namespace plchost
