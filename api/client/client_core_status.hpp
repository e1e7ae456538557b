// The parts of ClientCore that are made for each type of status.
#pragma once

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "api/client/check_names.hpp"
#include "api/client/client_core.hpp"
#include "api/client/status_count.hpp"

namespace plchost {

template <class Cache>
Result<void> ClientCore::open_cache(Cache& cache, const dds::TopicInfo& info, const dds::Qos& qos,
                                    std::uint32_t statuses) {
  if (cache) return {};
  PLCHOST_TRY_ASSIGN(auto opened,
                     open_reader(entity(), status_subscriber_.get(), info, qos, pump_->set(), statuses));
  cache = Cache(std::move(opened));
  return {};
}

template <class Cache>
Result<void> ClientCore::open_cache(Cache& cache, const dds::TopicInfo& info) {
  return open_cache(cache, info, dds::shown_qos(info), DDS_DATA_AVAILABLE_STATUS);
}

template <class Answer>
Result<void> ClientCore::open_own_reader(dds::TopicReader& answers, const dds::Qos& qos) {
  if (answers) return {};
  PLCHOST_TRY_ASSIGN(auto made, make_own_topic(dds::kTopicOf<Answer>));
  if (auto filtered = own_answers_.filter<Answer>(made.get()); !filtered) return filtered;
  return read_own(answers, std::move(made), qos);
}

template <class Sample>
Async<Result<std::vector<Sample>>> ClientCore::status(std::string host, TimePoint deadline) {
  auto& cache = std::get<StatusCache<Sample>>(status_);
  PLCHOST_CO_TRY(check_host_name(host, only_));
  PLCHOST_CO_TRY(open_cache(cache, dds::kTopicOf<Sample>));
  look();
  for (;;) {
    if (const auto view = present(host)) {
      const auto expected = count_of<Sample>(view->status);
      if (!expected) {
        co_return failure(ErrorCode::unsupported,
                          fmt::format("host '{}' has no topic {}: it is of another version", host,
                                      dds::kTopicOf<Sample>.name));
      }
      if (cache.count(host, view->epoch) == *expected) {
        auto samples = cache.of_host(host, view->epoch);
        std::ranges::sort(samples, {}, [](const Sample& sample) { return dds::order_of(sample); });
        co_return samples;
      }
    }
    if (MonotonicClock::now() >= deadline) break;
    co_await pump_->change(deadline);
  }
  co_return failure(ErrorCode::timed_out,
                    fmt::format("the status of host '{}' has not come completely", host));
}

}  // namespace plchost
