#include "api/library/records.hpp"

#include <concepts>
#include <optional>
#include <type_traits>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <status_fields.hpp>

#include "api/client/control_client_status.hpp"
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
    return std::string(value);
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
  return record;
}

template <class... Samples>
struct Topics {
  static std::vector<std::string> names() { return {std::string(dds::kCountedAs<Samples>)...}; }

  using Records = Result<std::vector<Client::Record>>;
  static std::optional<Records> read(ControlClient& client, const std::string& topic, const std::string& host,
                                     TimePoint deadline) {
    std::optional<Records> found;
    const auto read_one = [&]<class Sample>(std::type_identity<Sample> /*type*/) {
      if (topic != dds::kCountedAs<Sample>) return;
      const auto samples = client.template status<Sample>(host, deadline);
      if (!samples) {
        found = std::unexpected(samples.error());
        return;
      }
      std::vector<Client::Record> records;
      for (const Sample& sample : *samples) records.push_back(record_of(sample));
      found = std::move(records);
    };
    (read_one(std::type_identity<Samples>()), ...);
    return found;
  }
};

}  // namespace

std::vector<std::string> status_names() {
  return dds::OfCountedStatus<Topics>::names();
}

Result<std::vector<Client::Record>> read_status(ControlClient& client, const std::string& topic,
                                                const std::string& host, TimePoint deadline) {
  if (auto found = dds::OfCountedStatus<Topics>::read(client, topic, host, deadline))
    return *std::move(found);
  const auto all = status_names();
  const std::vector<std::string_view> names(all.begin(), all.end());
  return failure(ErrorCode::invalid_argument,
                 fmt::format("no status topic '{}'; there are: {}", shown(topic), join_names(names)));
}

}  // namespace plchost
