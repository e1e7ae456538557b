#include "api/library/records.hpp"

#include <algorithm>
#include <concepts>
#include <string_view>
#include <type_traits>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <status_fields.hpp>

#include "api/client/client_core_status.hpp"
#include "api/dds/sequence.hpp"
#include "api/dds/text.hpp"
#include "api/library/convert_parts.hpp"
#include "shm/base/names.hpp"

namespace plchost {

namespace {

template <class Value>
Client::Value value_of(const dds::FieldInfo& field, const Value& value) {
  if constexpr (std::same_as<Value, bool>) {
    return value;
  } else if constexpr (std::integral<Value>) {
    if (!field.words.empty()) return dds::word_for(field.words, static_cast<std::uint64_t>(value));
    if constexpr (std::is_signed_v<Value>) {
      return static_cast<long long>(value);
    } else {
      return static_cast<unsigned long long>(value);
    }
  } else if constexpr (std::convertible_to<Value, std::string_view>) {
    return printable_lines(value);
  } else {
    return fmt::format("{:02x}", fmt::join(value, ""));
  }
}

template <class Sample>
Client::Record record_of(const Sample& sample) {
  Client::Record record;
  dds::visit_fields(sample, [&](const dds::FieldInfo& field, const auto& value) {
    record.emplace_back(field.name, value_of(field, value));
  });
  // The members that a newer host has more.
  for (const plc_KeyValue& entry : dds::parts_of(sample.ext)) {
    std::string name = printable_lines(dds::text_of(entry.name));
    if (std::ranges::find(record, name, &Client::Record::value_type::first) != record.end()) continue;
    record.emplace_back(std::move(name), printable_lines(dds::text_of(entry.value)));
  }
  return record;
}

using Records = Result<std::vector<Client::Record>>;

template <class Sample>
Async<Records> read_one(ClientCore& core, std::string host, TimePoint deadline) {
  PLCHOST_CO_TRY_ASSIGN(const auto samples, co_await core.status<Sample>(host, deadline));
  std::vector<Client::Record> records;
  for (const Sample& sample : samples) records.push_back(record_of(sample));
  co_return records;
}

template <class... Samples>
struct Topics {
  using Read = Async<Records> (*)(ClientCore&, std::string, TimePoint);

  static std::vector<std::string> names() { return {std::string(dds::kCountedAs<Samples>)...}; }
  /// The members that are keys; none: no such topic.
  static std::vector<std::string_view> keys(std::string_view topic) {
    std::vector<std::string_view> keys;
    const auto look_at = [&]<class Sample>(std::type_identity<Sample> /*type*/) {
      if (topic != dds::kCountedAs<Sample>) return;
      dds::visit_fields(Sample{}, [&](const dds::FieldInfo& field, const auto& /*value*/) {
        if (field.key) keys.push_back(field.name);
      });
    };
    (look_at(std::type_identity<Samples>()), ...);
    return keys;
  }
  /// nullptr: no such topic.
  static Read reader_of(std::string_view topic) {
    Read found = nullptr;
    ((topic == dds::kCountedAs<Samples> ? void(found = read_one<Samples>) : void()), ...);
    return found;
  }
};

}  // namespace

std::vector<std::string> status_names() {
  return dds::OfCountedStatus<Topics>::names();
}

Result<void> check_status_name(const std::string& topic) {
  const auto all = status_names();
  const std::vector<std::string_view> names(all.begin(), all.end());
  if (std::ranges::find(names, topic) != names.end()) return {};
  return failure(ErrorCode::invalid_argument,
                 fmt::format("no status topic '{}'; there are: {}", shown(topic), join_names(names)));
}

std::vector<Client::Value> status_key(const std::string& topic, const Client::Record& record) {
  const auto keys = dds::OfCountedStatus<Topics>::keys(topic);
  std::vector<Client::Value> values;
  for (const auto& [name, value] : record) {
    if (std::ranges::find(keys, name) != keys.end()) values.push_back(value);
  }
  return values;
}

Async<Records> read_status(ClientCore& core, std::string topic, std::string host, TimePoint deadline) {
  PLCHOST_CO_TRY(check_status_name(topic));
  co_return co_await dds::OfCountedStatus<Topics>::reader_of(topic)(core, host, deadline);
}

}  // namespace plchost
