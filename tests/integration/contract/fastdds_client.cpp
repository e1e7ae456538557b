// A client of another vendor: eProsima's Fast DDS, and nothing of plchost but types that fastddsgen made from
// api/control.idl. It is the proof that the contract is enough; so it shares no code with plchost.
//   fastdds_client [--domain N] [--host HOST] [--patience SECONDS] [--property NAME=VALUE]... VERB
//   hosts | instances | task INSTANCE/TASK | start INSTANCE | stop INSTANCE | post INSTANCE/EVENT [COUNT]
// --property: of the participant; those of DDS Security make it a secured one.

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <iostream>
#include <map>
#include <memory>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/log/Log.hpp>
#include <fastdds/dds/log/StdoutErrConsumer.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#if __has_include(<fastdds/utils/IPLocator.hpp>)  // version 3
#include <fastdds/rtps/transport/UDPv4TransportDescriptor.hpp>
#include <fastdds/utils/IPLocator.hpp>

#include "controlPubSubTypes.hpp"
namespace rtps = eprosima::fastdds::rtps;
using eprosima::fastdds::dds::RETCODE_OK;
#else
#include <fastdds/rtps/transport/UDPv4TransportDescriptor.h>
#include <fastrtps/utils/IPLocator.h>

#include "controlPubSubTypes.h"
namespace rtps = eprosima::fastrtps::rtps;
constexpr auto RETCODE_OK = eprosima::fastrtps::types::ReturnCode_t::RETCODE_OK;
#endif

namespace {

using namespace eprosima::fastdds::dds;
using rtps::GUID_t;
using Clock = std::chrono::steady_clock;
using std::chrono::milliseconds;

std::chrono::seconds patience{15};  // as --patience says
constexpr std::uint32_t kServersPerMachine = 16;

struct Options {
  std::uint32_t domain = 0;
  std::string host;
  std::vector<std::pair<std::string, std::string>> properties;
  std::vector<std::string> words;
};

/// All that DDS makes is needed until the process ends, and so is never deleted one by one.
template <class Thing>
Thing* made(Thing* thing, const std::string& what) {
  if (thing == nullptr) throw std::runtime_error("Fast DDS cannot make " + what);
  return thing;
}

void wait_until(const std::function<bool()>& happened, const std::string& what) {
  const auto end = Clock::now() + patience;
  while (!happened()) {
    if (Clock::now() > end) throw std::runtime_error("in vain waited for " + what);
    std::this_thread::sleep_for(milliseconds(1));
  }
}

std::array<std::uint8_t, 16> bytes_of(const GUID_t& guid) {
  std::array<std::uint8_t, 16> bytes{};
  std::copy_n(guid.guidPrefix.value, 12, bytes.begin());
  std::copy_n(guid.entityId.value, 4, bytes.begin() + 12);
  return bytes;
}

std::string hex(const std::array<std::uint8_t, 16>& bytes) {
  std::string text;
  for (const unsigned byte : bytes) {
    std::array<char, 3> digits{};
    std::snprintf(digits.data(), digits.size(), "%02x", byte);
    text += digits.data();
  }
  return text;
}

/// By its name in version 3, and in version 2.
template <class Times>
auto& heartbeat_period(Times& times) {
  if constexpr (requires { times.heartbeat_period; }) {
    return times.heartbeat_period;
  } else {
    return times.heartbeatPeriod;
  }
}

/// The client of one domain.
class Client {
 public:
  explicit Client(const Options& options) {
    DomainParticipantQos qos = PARTICIPANT_QOS_DEFAULT;
    qos.name("fastdds_client");
    auto udp = std::make_shared<eprosima::fastdds::rtps::UDPv4TransportDescriptor>();
    udp->interfaceWhiteList = {"127.0.0.1"};
    qos.transport().use_builtin_transports = false;
    qos.transport().user_transports = {udp};
    auto& builtin = qos.wire_protocol().builtin;
    builtin.discovery_config.leaseDuration = {3, 0};
    builtin.discovery_config.leaseDuration_announcementperiod = {1, 0};
    rtps::Locator_t locator;
    rtps::IPLocator::setIPv4(locator, 127, 0, 0, 1);
    builtin.metatrafficUnicastLocatorList.push_back(locator);  // instead of multicast
    for (std::uint32_t i = 0; i < kServersPerMachine; ++i) {
      locator.port = 7400 + 250 * options.domain + 10 + 2 * i;
      builtin.initialPeersList.push_back(locator);
    }
    // Fast DDS 3 describes its types differently from Cyclone. Names of types are enough for both.
    qos.properties().properties().emplace_back("fastdds.type_propagation", "disabled");
    for (const auto& [name, value] : options.properties)
      qos.properties().properties().emplace_back(name, value);
    participant_ = made(DomainParticipantFactory::get_instance()->create_participant(options.domain, qos),
                        "a participant");
  }
  Client(const Client&) = delete;
  Client& operator=(const Client&) = delete;
  ~Client() {
    participant_->delete_contained_entities();
    DomainParticipantFactory::get_instance()->delete_participant(participant_);
  }

  template <class Type>
  DataReader* reader(const std::string& topic, const std::string& partition = "s.*") {
    SubscriberQos subscriber_qos = SUBSCRIBER_QOS_DEFAULT;
    subscriber_qos.partition().push_back(partition.c_str());
    auto* const subscriber = made(participant_->create_subscriber(subscriber_qos), "a subscriber");
    DataReaderQos qos = DATAREADER_QOS_DEFAULT;
    qos.reliability().kind = RELIABLE_RELIABILITY_QOS;
    qos.durability().kind = TRANSIENT_LOCAL_DURABILITY_QOS;
    qos.history().kind = KEEP_ALL_HISTORY_QOS;
    qos.resource_limits().max_instances = 4096;
    qos.resource_limits().max_samples_per_instance = 64;
    qos.resource_limits().max_samples = 4096 * 64;
    qos.endpoint().history_memory_policy = rtps::PREALLOCATED_WITH_REALLOC_MEMORY_MODE;
    return made(subscriber->create_datareader(topic_of<Type>(topic), qos), "a reader of " + topic);
  }

  template <class Type>
  DataWriter* writer(const std::string& topic, const std::string& host) {
    PublisherQos publisher_qos = PUBLISHER_QOS_DEFAULT;
    publisher_qos.partition().push_back(("h." + host).c_str());
    auto* const publisher = made(participant_->create_publisher(publisher_qos), "a publisher");
    DataWriterQos qos = DATAWRITER_QOS_DEFAULT;
    qos.reliability().kind = RELIABLE_RELIABILITY_QOS;
    qos.durability().kind = VOLATILE_DURABILITY_QOS;
    qos.history().kind = KEEP_ALL_HISTORY_QOS;
    qos.endpoint().history_memory_policy = rtps::PREALLOCATED_WITH_REALLOC_MEMORY_MODE;
    heartbeat_period(qos.reliable_writer_qos().times) = {0, 10'000'000};
    auto* const writer =
        made(publisher->create_datawriter(topic_of<Type>(topic), qos), "a writer of " + topic);
    wait_until(
        [&] {
          PublicationMatchedStatus status;
          writer->get_publication_matched_status(status);
          return status.current_count > 0;
        },
        "a reader of " + topic + " at host '" + host + "'");
    return writer;
  }

  /// Where replies to this client go.
  [[nodiscard]] std::string partition() const { return "c." + hex(bytes_of(participant_->guid())) + "/*"; }

 private:
  template <class Type>
  Topic* topic_of(const std::string& name) {
    const TypeSupport type(new Type);
    type.register_type(participant_);
    return made(participant_->create_topic(name, type.get_type_name(), TOPIC_QOS_DEFAULT), "topic " + name);
  }

  DomainParticipant* participant_;
};

/// Takes what has come. `use(sample)` for each that is valid.
template <class Sample, class Use>
void take(DataReader* reader, Use use) {
  Sample sample;
  SampleInfo info;
  while (reader->take_next_sample(&sample, &info) == RETCODE_OK) {
    if (info.valid_data) use(sample);
  }
}

/// The newest presence and status of each host.
class Hosts {
 public:
  Hosts(Client& client, std::string wanted)
      : presence_(client.reader<plc::PresencePubSubType>("plc/v1/presence")),
        status_(client.reader<plc::HostStatusPubSubType>("plc/v1/status/host")),
        wanted_(std::move(wanted)) {}

  /// The host that is wanted, or the only one, as soon as it shows its status.
  const plc::HostStatus& host() {
    const plc::HostStatus* found = nullptr;
    const auto look = [&] {
      update();
      for (const auto& [name, status] : statuses_) {
        if ((wanted_.empty() || name == wanted_) && status.epoch() == epochs_[name]) found = &status;
      }
      return found != nullptr;
    };
    wait_until(look, "a host" + (wanted_.empty() ? "" : " '" + wanted_ + "'"));
    return *found;
  }
  [[nodiscard]] std::int32_t pid(const std::string& host) { return pids_[host]; }
  /// For what is waited for from now on for so long as `patience` says.
  plc::TimeLimit limit(const std::string& host) {
    update();
    const auto& [clock_ns, taken] = clocks_[host];
    plc::TimeLimit limit;
    limit.epoch(epochs_[host]);
    limit.clock_ns(clock_ns + std::chrono::nanoseconds(Clock::now() - taken + patience).count());
    return limit;
  }
  void update() {
    take<plc::Presence>(presence_, [this](const plc::Presence& presence) {
      const std::string name = presence.host().to_string();
      epochs_[name] = std::max(epochs_[name], presence.epoch());
      pids_[name] = presence.pid();
      clocks_[name] = {presence.clock_ns(), Clock::now()};
    });
    take<plc::HostStatus>(
        status_, [this](const plc::HostStatus& status) { statuses_[status.host().to_string()] = status; });
  }

 private:
  DataReader* presence_;
  DataReader* status_;
  std::string wanted_;
  std::map<std::string, std::uint64_t> epochs_;
  std::map<std::string, std::int32_t> pids_;
  std::map<std::string, std::pair<std::int64_t, Clock::time_point>> clocks_;  // and when they were taken
  std::map<std::string, plc::HostStatus> statuses_;
};

std::uint32_t instances_of(const plc::HostStatus& host) {
  for (const plc::TopicCount& count : host.counts()) {
    if (count.topic().to_string() == "instance") return count.samples();
  }
  return 0;
}

void list_hosts(Client& client, const Options& options) {
  Hosts hosts(client, options.host);
  const plc::HostStatus& status = hosts.host();
  std::cout << status.host().to_string() << ' ' << hosts.pid(status.host().to_string()) << ' '
            << status.version().to_string() << ' ' << instances_of(status) << '\n';
}

/// All instances of a host: complete when there are as many as it says.
void list_instances(Client& client, const Options& options) {
  Hosts hosts(client, options.host);
  auto* const reader = client.reader<plc::InstanceStatusPubSubType>("plc/v1/status/instance");
  std::map<std::string, plc::InstanceStatus> found;
  wait_until(
      [&] {
        const plc::HostStatus& host = hosts.host();
        take<plc::InstanceStatus>(reader, [&](const plc::InstanceStatus& status) {
          if (status.host().to_string() == host.host().to_string() && status.epoch() == host.epoch())
            found[status.instance().to_string()] = status;
        });
        return found.size() == instances_of(host);
      },
      "the status of all instances");
  for (const auto& [name, status] : found)
    std::cout << name << ' ' << status.state() << ' ' << status.scheduler().to_string() << ' '
              << status.application().to_string() << '\n';
}

std::pair<std::string, std::string> split(const std::string& name) {
  const auto slash = name.find('/');
  if (slash == std::string::npos) throw std::invalid_argument("'" + name + "' has no '/'");
  return {name.substr(0, slash), name.substr(slash + 1)};
}

void show_task(Client& client, const std::string& name) {
  const auto [instance, task] = split(name);
  auto* const reader = client.reader<plc::TaskStatusPubSubType>("plc/v1/status/task");
  plc::TaskStatus found;
  wait_until(
      [&, wanted_instance = instance, wanted_task = task] {
        take<plc::TaskStatus>(reader, [&](const plc::TaskStatus& status) {
          if (status.instance().to_string() == wanted_instance && status.task().to_string() == wanted_task)
            found = status;
        });
        return found.epoch() != 0;
      },
      "the status of task '" + name + "'");
  std::cout << found.cycles() << ' ' << found.kind() << ' ' << found.external_event().to_string() << '\n';
}

/// Asks, and repeats the same request until it is answered.
int call(Client& client, const Options& options, std::int32_t operation, const std::string& instance) {
  Hosts hosts(client, options.host);
  const std::string host = hosts.host().host().to_string();
  auto* const replies = client.reader<plc::ReplyPubSubType>("plc/v1/reply", client.partition());
  auto* const writer = client.writer<plc::RequestPubSubType>("plc/v1/op/request", host);
  plc::Request request;
  request.header().request_identity().writer_guid(bytes_of(writer->guid()));
  request.header().request_identity().sequence_number(1);
  request.header().instance_name(host);
  request.limit(hosts.limit(host));
  request.operation(operation);
  request.instance(instance);
  std::unique_ptr<plc::Reply> answer;
  Clock::time_point next{};
  wait_until(
      [&] {
        if (Clock::now() >= next) writer->write(&request);
        if (Clock::now() >= next) next = Clock::now() + milliseconds(250);
        take<plc::Reply>(replies, [&](const plc::Reply& reply) {
          if (reply.header().related_identity().writer_guid() == bytes_of(writer->guid()) &&
              reply.header().related_identity().sequence_number() == 1)
            answer = std::make_unique<plc::Reply>(reply);
        });
        return answer != nullptr;
      },
      "an answer");
  std::cout << answer->code() << ' ' << answer->text().to_string() << '\n';
  return answer->code() == 0 ? 0 : 1;
}

/// Posts in order, as many at once as the host gives credits for, and repeats what is not acknowledged.
int post(Client& client, const Options& options, const std::string& name, std::uint64_t count) {
  const auto [instance, event] = split(name);
  Hosts hosts(client, options.host);
  const std::string host = hosts.host().host().to_string();
  auto* const acks = client.reader<plc::EventAckPubSubType>("plc/v1/event_ack", client.partition());
  auto* const writer = client.writer<plc::EventPostPubSubType>("plc/v1/event", host);
  plc::EventPost sample;
  sample.source(bytes_of(writer->guid()));
  sample.host(host);
  sample.limit(hosts.limit(host));
  sample.instance(instance);
  sample.event(event);
  plc::EventAck ack;
  ack.credits(1);
  std::uint64_t sent = 0;
  auto progress = Clock::now();
  const auto write = [&](std::uint64_t number) {
    sample.sequence_number(number);
    sample.base_sequence(ack.sequence_number() + 1);
    writer->write(&sample);
  };
  wait_until(
      [&] {
        take<plc::EventAck>(acks, [&](const plc::EventAck& news) {
          if (news.source() != sample.source()) return;
          if (news.sequence_number() > ack.sequence_number()) progress = Clock::now();
          ack = news;
        });
        while (sent < count && sent - ack.sequence_number() < ack.credits()) write(++sent);
        if (Clock::now() - progress > milliseconds(200)) {
          for (std::uint64_t number = ack.sequence_number() + 1; number <= sent; ++number) write(number);
          progress = Clock::now();
        }
        return ack.sequence_number() >= count;
      },
      "acknowledgements");
  std::cout << "accepted " << ack.accepted() << " no_task " << ack.no_task() << " rejected " << ack.rejected()
            << ' ' << ack.rejected_text().to_string() << '\n';
  return ack.rejected() == 0 ? 0 : 1;
}

Options parse(int argc, char** argv) {
  Options options;
  for (int i = 1; i < argc; ++i) {
    const std::string word = argv[i];
    const bool has_value = i + 1 < argc;
    if (word == "--domain" && has_value) {
      options.domain = static_cast<std::uint32_t>(std::stoul(argv[++i]));
    } else if (word == "--host" && has_value) {
      options.host = argv[++i];
    } else if (word == "--patience" && has_value) {
      patience = std::chrono::seconds(std::stoul(argv[++i]));
    } else if (word == "--property" && has_value) {
      const std::string property = argv[++i];
      const auto equals = property.find('=');
      if (equals == std::string::npos) throw std::invalid_argument("a property is NAME=VALUE");
      options.properties.emplace_back(property.substr(0, equals), property.substr(equals + 1));
    } else {
      options.words.push_back(word);
    }
  }
  return options;
}

int run(const Options& options) {
  if (options.words.empty()) throw std::invalid_argument("no verb");
  const std::string& verb = options.words[0];
  const std::string name = options.words.size() > 1 ? options.words[1] : "";
  Client client(options);
  if (verb == "hosts") return list_hosts(client, options), 0;
  if (verb == "instances") return list_instances(client, options), 0;
  if (verb == "task") return show_task(client, name), 0;
  if (verb == "start") return call(client, options, plc::OPERATION_START, name);
  if (verb == "stop") return call(client, options, plc::OPERATION_STOP, name);
  if (verb == "post")
    return post(client, options, name, options.words.size() > 2 ? std::stoull(options.words[2]) : 1);
  throw std::invalid_argument("'" + verb + "' is no verb: hosts, instances, task, start, stop, post");
}

// The library's words go where errors go: by themselves they stand among what was asked for.
void log_as_errors() {
  auto consumer = std::make_unique<StdoutErrConsumer>();
  consumer->stderr_threshold(Log::Kind::Info);
  Log::ClearConsumers();
  Log::RegisterConsumer(std::move(consumer));
}

}  // namespace

int main(int argc, char** argv) {
  log_as_errors();
  try {
    return run(parse(argc, argv));
  } catch (const std::exception& error) {
    std::cerr << "fastdds_client: " << error.what() << '\n';
    return 2;
  }
}
